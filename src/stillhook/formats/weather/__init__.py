"""Files of weather over time."""
