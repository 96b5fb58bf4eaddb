"""The independent crane with friction that steps, oil that warms and clocks that differ, and what the friction
estimator of `stillhook.live` makes of its logs."""
