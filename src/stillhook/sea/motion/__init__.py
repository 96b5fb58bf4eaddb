"""Motion of the crane tip over time."""
