"""Acceptance criteria, verdicts and detection limits."""
