"""Uncertainty of a winch's data, propagated into its results."""
