"""Step 2: the controller in isolation."""
