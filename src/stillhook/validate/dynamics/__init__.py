"""Step 4: acceleration and oscillation, and the tuned parameters."""
