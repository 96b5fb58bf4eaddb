"""Synthetic logs: what sensors and a PLC make of a simulated run."""
