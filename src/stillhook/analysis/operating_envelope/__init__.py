"""How fast a winch can follow at each load."""
