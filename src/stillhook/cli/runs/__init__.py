"""Commands that run scenarios and lowerings, and the demonstration."""
