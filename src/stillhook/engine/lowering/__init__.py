"""Runs of a lowering: checks before, run, batch, summary."""
