"""How inputs are tried, kept and changed in a loop."""
