"""Draws of the parameters of a set from its evidence, normal and truncated to what physics allows; cranes with a set or
a draw of it."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import IdentifyError
from stillhook.library.crane_file import changed
from stillhook.library.parameter_sets import Evidence, FrictionSet, LossSet, loss_range
from stillhook.library.write import leaf_tree
from stillhook.spec.crane import Crane, SourceKind
from stillhook.tables.table import Spec
from stillhook.units import show
from stillhook.winches.circuits.losses import MJ4, SCALE, loss_fields, loss_values

LEAST_ALLOWED = 0.02
"""Least share of draws that must be physically allowed [-]: below it the normal distribution of the evidence says
nothing about the set."""
TRIAL = 10_000
"""Draws by which that share is estimated, and the least number that is drawn at once."""
MOST = 10_000
"""Draws at most: a crane takes a few milliseconds to build."""


@dataclass(frozen=True)
class Draws:
    """names of the parameters; values shape (n, names) [SI]; allowed share of all draws that were physically allowed
    [-]."""

    names: tuple[str, ...]
    values: FloatArray
    allowed: float


def draw(item: FrictionSet | LossSet, n: int, rng: np.random.Generator) -> Draws:
    """Draws of the parameters of a set from its evidence, truncated to what physics allows by drawing again. Errors:
    IdentifyError."""
    evidence = item.evidence
    if evidence is None:
        do = "Identify it from tests, or give its covariance."
        raise IdentifyError(f'set "{item.name}": it has no [evidence], so its uncertainty is unknown. {do}')
    if isinstance(item, FrictionSet):
        fitted = item.system.model_dump()
    elif not set(evidence.names) <= set(fitted := loss_values(item.motor)):
        raise IdentifyError(
            f'set "{item.name}": its evidence is that of MJ4, and it names "{item.motor.law}". Draw the factor'
            " loss_model, or motor_loss with a distribution."
        )
    mean = np.array([fitted[name] for name in evidence.names])
    least = np.array([np.nextafter(0.0, 1.0) if name == "Y_4" else 0.0 for name in evidence.names])
    accepted: list[FloatArray] = []
    have, tried = 0, 0
    while have < n:
        values = mean + _normal(evidence, max(TRIAL, n), rng)
        good = values[np.all(values >= least, axis=1)]
        tried, have = tried + len(values), have + len(good)
        accepted.append(good)
        if have < LEAST_ALLOWED * tried:
            problem = f"only {have / tried:.2%} of the draws have no negative parameter ({_worst(evidence, mean)})"
            do = "Its data leave these open: hold one of them, or test more."
            raise IdentifyError(f'set "{item.name}": {problem}. {do}')
    return Draws(evidence.names, np.concatenate(accepted)[:n], have / tried)


def _normal(evidence: Evidence, n: int, rng: np.random.Generator) -> FloatArray:
    """Normal deviates with the covariance of the evidence, (n, names); by correlations, for the numbers' sake."""
    C = evidence.matrix
    s = np.sqrt(np.diag(C))
    unit = np.where(s > 0.0, s, 1.0)
    values, vectors = np.linalg.eigh(C / np.outer(unit, unit))
    root = vectors * np.sqrt(np.maximum(values, 0.0))  # below zero is rounding: the evidence has been checked
    return np.asarray(rng.standard_normal((n, len(s))) @ root.T * s)


def _worst(evidence: Evidence, mean: FloatArray) -> str:
    """The parameters whose deviation is as large as their value, in words."""
    pairs = [(n, m, evidence.deviation(n)) for n, m in zip(evidence.names, mean, strict=True)]
    return ", ".join(f"{n} {m:.3g} ± {s:.3g}" for n, m, s in pairs if s >= m) or "all of them together"


def crane_with(crane: Crane, *sets: FrictionSet | LossSet) -> Crane:
    """The crane with the values of its sets themselves, undrawn. Errors: IdentifyError where a motor does not fit, or
    two sets replace the same numbers."""
    replaced: dict[float | None, str] = {}
    for item in sets:
        of = item.motor.D_max if isinstance(item, LossSet) else None
        if of in replaced:
            both = f'Sets "{replaced[of]}" and "{item.name}"'
            raise IdentifyError(f'{both} replace the same numbers of "{crane.name}". Choose one.')
        replaced[of] = item.name
        at_value = Draws((), np.empty((1, 0)), 1.0)
        step = with_friction if isinstance(item, FrictionSet) else with_loss
        crane = step(crane, item, at_value, 0, "values")  # type: ignore[arg-type]
    return crane


def _draw(draws: Draws, i: int) -> dict[str, float]:
    return dict(zip(draws.names, map(float, draws.values[i]), strict=True))


def _leaves(new: Spec, drawn: Container[str], sources: dict[str, Any], source: str) -> dict[str, Any]:
    """Leaves for `changed`: drawn values with where they are from, the others as they are in the set."""
    out: dict[str, Any] = {}
    for name, leaf in leaf_tree(new, sources).items():
        kind, text = (SourceKind.DERIVED, source) if name in drawn else (leaf.source.kind, leaf.source.text)  # type: ignore[union-attr]
        out[name] = {"value": leaf.value, "kind": kind.value, "source": text}  # type: ignore[union-attr]
    return out


def with_friction(crane: Crane, item: FrictionSet, draws: Draws, i: int, label: str) -> Crane:
    """The crane with draw i of a system friction; label describes the values in its sources."""
    new = item.system.model_copy(update=_draw(draws, i))
    system = _leaves(new, draws.names, dict(item.sources), f"{label} from {item.name}")
    torques = item.evidence.T_d if item.evidence is not None else None
    ends = {} if torques is None else {"T_d_min": f"{torques[0]!r} N m", "T_d_max": f"{torques[1]!r} N m"}
    return changed(crane, {"friction": {"system": system, **ends}})


def with_loss(crane: Crane, item: LossSet, draws: Draws, i: int, label: str) -> Crane:
    """The crane with draw i of a motor's loss in every circuit with motors of that size. Errors: IdentifyError."""
    drawn, source = _draw(draws, i), f"{label} from {item.name}"
    motor = item.motor.model_copy(update=loss_fields(item.motor, drawn) if drawn else {})
    known, of_model = (
        {path.removeprefix(place): s for path, s in item.sources.items() if path.startswith(place)}
        for place in ("loss.", "loss_model.")
    )
    loss = _leaves(motor.loss, drawn, known, source)
    fits = [name for name, c in crane.circuits.items() if c.motor.D_max == item.motor.D_max]
    if not fits:
        theirs, ours = (show(m.D_max, "displacement") for m in (item.motor, crane.active.motor))
        problem = f'is of a motor of {theirs}, and those of "{crane.name}" have {ours}'
        raise IdentifyError(f'set "{item.name}" {problem}. Choose a set for them.')
    model, fields = motor.loss_model, ("C", SCALE) if drawn else ()
    named = {"law": MJ4} if model is None else _leaves(model, fields, of_model, source)
    own = model is None and all(crane.circuits[name].motor.loss_model is None for name in fits)
    models = {"loss": loss} if own else {"loss": loss, "loss_model": named}
    return changed(crane, {name: {"motor": {**models, **loss_range(item.evidence)}} for name in fits})


def draw_cranes(
    crane: Crane, friction_set: FrictionSet | None = None, loss_set: LossSet | None = None, n: int = 64, seed: int = 0
) -> list[Crane]:
    """Cranes that differ in what the evidence of their friction leaves open; the rest of the crane is unchanged.

    Parameters
    ----------
    crane : Crane
        The machine.
    friction_set : FrictionSet, optional
        Its system friction, see `stillhook.library.load_friction`.
    loss_set : LossSet, optional
        Its motors' loss, for every circuit with motors of that size.
    n : int, default 64
        Draws.
    seed : int, default 0
        The same seed gives the same cranes.

    Returns
    -------
    list of Crane
        n cranes, as in ``simulate(draw_cranes(crane, load_friction("my.friction.toml")), case)``.

    Raises
    ------
    IdentifyError
        One line, where a set has no evidence, or hardly any draw is allowed.

    Notes
    -----
    Parameters without a covariance keep the value of the set. The others are drawn from the normal distribution of the
    set's covariance; draws with a value that physics does not allow (a negative friction; Y_4 of 0) are drawn again,
    none is clipped. So the distribution is truncated, and its mean is next to the set's values where one of them is
    near zero.
    """
    if friction_set is None and loss_set is None:
        raise IdentifyError("draw_cranes: no set. Give a friction set, a loss set, or both, with evidence.")
    if type(n) is not int or not 1 <= n <= MOST:
        raise IdentifyError(f"n = {n!r}: give a whole number of draws from 1 to {MOST}.")
    streams = np.random.SeedSequence(seed).spawn(2)
    out = [crane] * n
    names = [f"draw {i} of {n} (seed {seed})" for i in range(n)]
    if friction_set is not None:
        samples = draw(friction_set, n, np.random.default_rng(streams[0]))
        out = [with_friction(out[i], friction_set, samples, i, name) for i, name in enumerate(names)]
    if loss_set is not None:
        samples = draw(loss_set, n, np.random.default_rng(streams[1]))
        out = [with_loss(out[i], loss_set, samples, i, name) for i, name in enumerate(names)]
    return out
