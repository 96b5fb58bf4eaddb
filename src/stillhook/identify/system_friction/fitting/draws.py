"""Cranes drawn from the uncertainty of their friction, to run side by side in `simulate`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from stillhook.errors import IdentifyError
from stillhook.library.crane_file.draws import crane_with as crane_with
from stillhook.library.crane_file.draws import draw, with_friction, with_loss
from stillhook.library.parameter_sets.sets import FrictionSet, LossSet
from stillhook.spec.crane import Crane

if TYPE_CHECKING:
    import xarray

MOST = 10_000
"""Draws at most: a crane takes a few milliseconds to build."""
BAND = 0.9
"""Share of the draws inside a printed band."""


def draw_cranes(
    crane: Crane, friction_set: FrictionSet | None = None, loss_set: LossSet | None = None, n: int = 64, seed: int = 0
) -> list[Crane]:
    """Cranes that differ in what the evidence of their friction leaves open; the rest of the crane is unchanged.

    Parameters
    ----------
    crane: the machine. friction_set: its system friction, see `stillhook.library.load_friction`; loss_set: its motors'
    loss, for every circuit with motors of that size. Parameters without a covariance keep the value of the set.
    n, seed: how many draws, and from which seed; the same seed gives the same cranes.

    The parameters are drawn from the normal distribution of the set's covariance; draws with a value that physics does
    not allow (a negative friction; Y_4 of 0) are drawn again, none is clipped. So the distribution is truncated, and
    its mean is next to the set's values where one of them is near zero.

    Use: ``simulate(draw_cranes(crane, load_friction("my.friction.toml")), case)``.
    Errors: IdentifyError of one line where a set has no evidence, or hardly any draw is allowed.
    """
    if friction_set is None and loss_set is None:
        raise IdentifyError("draw_cranes: no set. Give a friction set, a loss set, or both, with evidence.")
    if type(n) is not int or not 1 <= n <= MOST:
        raise IdentifyError(f"n = {n!r}: give a whole number of draws from 1 to {MOST}.")
    streams = np.random.SeedSequence(seed).spawn(2)
    out = [crane] * n
    if friction_set is not None:
        samples = draw(friction_set, n, np.random.default_rng(streams[0]))
        out = [with_friction(c, friction_set, samples, i, f"draw {i} of {n} (seed {seed})") for i, c in enumerate(out)]
    if loss_set is not None:
        samples = draw(loss_set, n, np.random.default_rng(streams[1]))
        out = [with_loss(c, loss_set, samples, i, f"draw {i} of {n} (seed {seed})") for i, c in enumerate(out)]
    return out


def quantiles(run: xarray.Dataset, names: Sequence[str] = ("e_c_pp", "p_max")) -> dict[str, dict[str, float]]:
    """Median and 90 % band of the summary numbers that the winch type has, over the draws [SI]: name -> low, median,
    high."""
    edge = 0.5 * (1.0 - BAND)
    out = {}
    for name in (name for name in names if name in run):
        values = run[name].values[
            np.isfinite(run[name].values)
        ]  # a diverged draw has no numbers, and manual mode no error
        ends = np.quantile(values, (edge, 0.5, 1.0 - edge)) if len(values) else np.full(3, np.nan)
        low, median, high = (float(x) for x in ends)
        out[name] = {"low": low, "median": median, "high": high}
    return out
