"""Drum, load and friction."""
