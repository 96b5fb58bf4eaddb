"""Steady operation of the whole plant, and what limits it."""
