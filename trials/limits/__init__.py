"""Limits of repeated lift plans against those of many more runs."""
