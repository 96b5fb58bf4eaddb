"""Folders of results with figures, series and summary."""
