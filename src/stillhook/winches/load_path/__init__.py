"""What is below a winch, from the drum down, an element a module: chosen by name, see `registry`."""
