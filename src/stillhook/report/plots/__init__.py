"""Figures of runs, lowerings, waves, vessels and weather."""
