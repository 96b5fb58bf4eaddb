"""The engine: packs a crane and a scenario into records, steps them one at a time or sixteen side by side."""
