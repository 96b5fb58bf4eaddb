"""Lift files."""
