"""Fuzzing of every reader and text parser: `python -m fuzz --help`, `make fuzz`.

A target is a function of bytes that gives a value or raises `StillhookError` with one line; all else is an escape.
"""
