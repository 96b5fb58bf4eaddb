"""Closed circuits: their tables in a crane file, and the active and the passive one as kernels know them."""
