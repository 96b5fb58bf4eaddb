"""Commands about what the library holds."""
