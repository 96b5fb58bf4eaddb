"""Friction from tests: motor loss models, crane tests, system friction, their uncertainty, and what to test next."""
