"""Drives of a winch side by side: each sized by one rule for the same hook, drum, wire and sea."""
