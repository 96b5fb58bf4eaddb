"""Level 4 on the independent crane: what a model learned from some cranes and seas is worth on others."""
