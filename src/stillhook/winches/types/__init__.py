"""The winch types, a module each; `stillhook.winches.interface` says what a module declares."""
