"""Targets: every reader and text parser of the package, by room."""
