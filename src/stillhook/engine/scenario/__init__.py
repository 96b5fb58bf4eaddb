"""Runs of a scenario: checks before, run, batch, summary."""
