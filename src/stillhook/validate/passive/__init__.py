"""Step 6: the passive circuit that carries the load."""
