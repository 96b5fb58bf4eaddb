"""Step 5: heave compensation of the complete twin."""
