"""Compiled drivers of the plants, one trajectory or sixteen lanes, and how they are built and cached."""
