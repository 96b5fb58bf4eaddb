"""The result of a plan as labelled arrays."""
