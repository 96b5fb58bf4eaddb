"""Friction verified in the running twin: staircases and runs in heave compensation repeated, pressures compared."""
