"""Commands of the weather."""
