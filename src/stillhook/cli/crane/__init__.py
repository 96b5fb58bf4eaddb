"""Commands that show cranes and single equations."""
