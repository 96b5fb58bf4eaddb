"""Commands of weather."""
