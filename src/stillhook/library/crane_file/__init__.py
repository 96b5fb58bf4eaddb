"""Crane files: loaded, shown, varied."""
