"""Level 2: the twin against the measured crane, in windows; logs played back."""
