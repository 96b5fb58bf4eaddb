"""Commands of lift plans."""
