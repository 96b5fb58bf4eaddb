"""The friction model and its fit, with drift and uncertainty."""
