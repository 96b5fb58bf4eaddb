"""Parameter sets of friction and motor losses with their uncertainty."""
