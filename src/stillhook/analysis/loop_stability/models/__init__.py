"""Linear and reduced models of the winch."""
