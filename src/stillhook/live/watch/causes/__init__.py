"""Causes of what fails: signs, patterns, and what a trial tells apart."""
