"""Leakage of the active circuit: rows of the flow balance, fits of its laws, the choice between them, and texts."""
