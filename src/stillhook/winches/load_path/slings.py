"""Slings alone between hook and payload."""

from stillhook.physics.load_path.rope import pull_of_sling, sling_energy, sling_mean
from stillhook.physics.scalar import scalar

Link = Signals = Stats = None
"""They have no record beyond that of every lift, and show nothing of their own."""


@scalar
def pull(x, v, z, A_up, R_up, A_down, R_down, h, sling, link):
    """Force between hook and payload over a step, and their speeds in its middle."""
    return pull_of_sling(x, A_up, R_up, A_down, R_down, h, sling)


@scalar
def mean(x, v, z, rate, h, sling, link):
    """Their force over the step [N], and the part of it that the sea does [N]."""
    return sling_mean(x, rate, h, sling), 0.0


@scalar
def energy(x, sling, link):
    """Energy in them [J]."""
    return sling_energy(x, sling)
