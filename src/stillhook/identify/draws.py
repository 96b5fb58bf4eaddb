"""Cranes drawn from the uncertainty of their friction, to run beside each other in `simulate`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.crane import Crane, SourceKind, SystemFriction, TorqueLoss
from stillhook.errors import IdentifyError
from stillhook.library import changed
from stillhook.library.draws import Draws, draw
from stillhook.library.sets import FrictionSet, LossSet
from stillhook.library.write import leaf_tree
from stillhook.units import show

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
    crane: the machine. friction_set: its system friction, see `stillhook.library.load_friction`; loss_set: its motors' loss, for every
    circuit with motors of that size. Parameters without a covariance keep the value of the set.
    n, seed: how many draws, and from which seed; the same seed gives the same cranes.

    The parameters are drawn from the normal distribution of the set's covariance; draws with a value that physics does not allow
    (a negative friction; Y_4 of 0) are drawn again, none is clipped. So the distribution is truncated, and its mean lies beside the set's
    values where one of them is near zero.

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
        drawn = draw(friction_set, n, np.random.default_rng(streams[0]))
        out = [_with_friction(c, friction_set, drawn, i, f"draw {i} of {n} (seed {seed})") for i, c in enumerate(out)]
    if loss_set is not None:
        drawn = draw(loss_set, n, np.random.default_rng(streams[1]))
        out = [_with_loss(c, loss_set, drawn, i, f"draw {i} of {n} (seed {seed})") for i, c in enumerate(out)]
    return out


def crane_with(crane: Crane, *sets: FrictionSet | LossSet) -> Crane:
    """The crane with the values of its sets themselves, undrawn. Errors: IdentifyError where a motor does not fit."""
    for item in sets:
        at_value = Draws((), np.empty((1, 0)), 1.0)
        step = _with_friction if isinstance(item, FrictionSet) else _with_loss
        crane = step(crane, item, at_value, 0, "values")  # type: ignore[arg-type]
    return crane


def _leaves(spec: SystemFriction | TorqueLoss, drawn: Draws, i: int, sources: dict[str, Any], source: str) -> dict[str, Any]:
    """Leaves for `changed`: drawn values with where they are from, the others as they are in the set."""
    new = spec.model_copy(update={name: float(x) for name, x in zip(drawn.names, drawn.values[i], strict=True)})
    out: dict[str, Any] = {}
    for name, leaf in leaf_tree(new, sources).items():
        kind, text = (SourceKind.DERIVED, source) if name in drawn.names else (leaf.source.kind, leaf.source.text)  # type: ignore[union-attr]
        out[name] = {"value": leaf.value, "kind": kind.value, "source": text}  # type: ignore[union-attr]
    return out


def _with_friction(crane: Crane, item: FrictionSet, drawn: Draws, i: int, what: str) -> Crane:
    system = _leaves(item.system, drawn, i, dict(item.sources), f"{what} from {item.name}")
    known = item.evidence.T_d if item.evidence is not None else None
    ends = {} if known is None else {"T_d_min": f"{known[0]!r} N m", "T_d_max": f"{known[1]!r} N m"}
    return changed(crane, {"friction": {"system": system, **ends}})


def _with_loss(crane: Crane, item: LossSet, drawn: Draws, i: int, what: str) -> Crane:
    sources = {name.removeprefix("loss."): s for name, s in item.sources.items() if name.startswith("loss.")}
    loss = _leaves(item.motor.loss, drawn, i, sources, f"{what} from {item.name}")
    circuits = {"active": crane.active} | ({"passive": crane.passive} if crane.passive is not None else {})
    fits = [name for name, c in circuits.items() if c.motor.D_max == item.motor.D_max]
    if not fits:
        raise IdentifyError(
            f'set "{item.name}" is of a motor of {show(item.motor.D_max, "displacement")}, and those of "{crane.name}" have '
            f"{show(crane.active.motor.D_max, 'displacement')}. Choose a set for them."
        )
    return changed(crane, {name: {"motor": {"loss": loss}} for name in fits})


def quantiles(run: xarray.Dataset, names: Sequence[str] = ("e_c_pp", "p_max")) -> dict[str, dict[str, float]]:
    """Median and 90 % band of summary numbers over the draws [SI]: name -> low, median, high."""
    edge = 0.5 * (1.0 - BAND)
    out = {}
    for name in names:
        values = run[name].values[np.isfinite(run[name].values)]  # a diverged draw has no numbers, and manual mode no error
        ends = np.quantile(values, (edge, 0.5, 1.0 - edge)) if len(values) else np.full(3, np.nan)
        low, median, high = (float(x) for x in ends)
        out[name] = {"low": low, "median": median, "high": high}
    return out
