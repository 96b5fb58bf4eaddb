"""Criteria of validation on sliding windows of a stream of rows."""
