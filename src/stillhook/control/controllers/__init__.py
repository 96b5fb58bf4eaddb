"""The controllers, a module each; `stillhook.control.interface` says what a module declares."""
