"""What an engineer asks of the twin: comparisons, linear analysis, steady operation."""
