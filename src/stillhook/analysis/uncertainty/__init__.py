"""What is not known about a winch, carried into its results."""
