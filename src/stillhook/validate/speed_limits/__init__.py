"""Step 3: the winch's speed limits."""
