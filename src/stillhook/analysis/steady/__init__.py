"""Steady operation of the complete plant, and what limits it."""
