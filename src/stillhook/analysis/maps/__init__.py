"""Maps of a winch over load and speed."""
