"""The reference plant as a crane of its own."""
