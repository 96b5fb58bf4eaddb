"""Runs and logs as tables of other programs; a format is a file with SUFFIX, TITLE and write."""
