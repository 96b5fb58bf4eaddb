"""What a sensor makes of a signal."""

from stillhook.physics.scalar import ceil, scalar


@scalar
def quantise(x, step):
    """The nearest multiple of step; x itself where step is 0."""
    return x if step <= 0.0 else step * ceil(x / step - 0.5)
