"""Describing function, remnant and compliance of a winch, from runs of its twin."""
