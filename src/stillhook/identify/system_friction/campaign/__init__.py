"""Crane tests that friction is identified from."""
