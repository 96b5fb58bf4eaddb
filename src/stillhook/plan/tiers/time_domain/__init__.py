"""The time-domain tier: lowerings of the twin."""
