"""Commands that write models, controllers and results for other programs."""
