"""Step 5: heave compensation of the whole twin."""
