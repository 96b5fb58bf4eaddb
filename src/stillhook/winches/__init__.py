"""Whole winches: each module holds one `rates()` that reads like its circuit diagram."""
