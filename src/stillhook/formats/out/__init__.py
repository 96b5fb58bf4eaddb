"""Runs and logs as tables of other programs."""
