"""Steady operation of the complete plant, what limits it, and how fast a winch can follow at each load."""
