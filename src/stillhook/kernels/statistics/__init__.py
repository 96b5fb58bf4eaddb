"""What a kernel counts in every cycle of a run, and the oscillation that it looks for."""
