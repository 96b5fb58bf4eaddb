"""Steady parts of tests."""
