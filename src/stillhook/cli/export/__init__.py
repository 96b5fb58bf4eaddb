"""Commands that take models, controllers and results to other programs."""
