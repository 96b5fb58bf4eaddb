"""Friction of the power transmission from crane tests."""
