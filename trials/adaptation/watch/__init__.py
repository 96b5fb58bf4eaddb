"""The independent crane with one fault at a time, and what the watch of `stillhook.live` makes of its logs."""
