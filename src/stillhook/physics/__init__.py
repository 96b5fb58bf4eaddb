"""Scalar equations of the winch, one room per component: floats and NamedTuples in and out, SI, pure."""
