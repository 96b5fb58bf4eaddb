"""The twin beside its crane: history, estimates, running in real time, servers."""
