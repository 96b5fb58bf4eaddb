"""The reference plant as an independent crane."""
