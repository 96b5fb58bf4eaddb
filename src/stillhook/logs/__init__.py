"""Logs of crane tests: read in pieces, brought to SI, checked, and averaged on bins of time."""
