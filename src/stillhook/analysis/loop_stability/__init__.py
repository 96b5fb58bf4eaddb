"""Stability of the position loop."""
