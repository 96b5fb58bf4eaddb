"""The same kernels as portable C99."""
