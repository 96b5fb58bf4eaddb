"""The table of limits over all phases, tiers and rules, and what of it may be credited."""
