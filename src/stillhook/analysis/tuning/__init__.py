"""Controllers with their best tuning under limits."""
