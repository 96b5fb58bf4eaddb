"""The closed table of what is uncertain about a winch, how wide, and what each factor does to crane and scenario.

What is known of a number that is not known: its distribution, as text with units in and SI inside.
"""

from __future__ import annotations

import math
import operator
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.analysis.effects import idle
from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.settings import SCALED
from stillhook.engine.pack.winch import load_record
from stillhook.engine.scenario.checks import case_friction, friction_parts, layer_diameter_at, loss_notes
from stillhook.errors import SpecError
from stillhook.sea.vessel.vessel_tip import VesselTip
from stillhook.spec.crane import Crane, Wire, effective_inertia, inertia_ratio_without_wire
from stillhook.spec.scenario import Scenario
from stillhook.statistics.estimate import NORMAL_95
from stillhook.units import KINDS, in_display, number, parse, quote
from stillhook.winches.circuits.losses import alternatives_of
from stillhook.winches.circuits.tables import Motor, ServoVariant

MOST_OUTSIDE = 0.01
"""Largest share of a normal distribution beyond what the number may be [-]: more, and a normal distribution is the
wrong one."""
OPEN = 1e-10
"""The least part by which a uniform draw is moved off 0 and 1, where the normal law is infinite (as scipy.stats.qmc
does)."""


class Law(StrEnum):
    """Shape of a distribution. The values are, in this order: normal mean and standard deviation; lognormal median and
    the factor of one standard deviation; uniform both ends; triangular low end, peak, high end; fixed the value."""

    NORMAL = "normal"
    LOGNORMAL = "lognormal"
    UNIFORM = "uniform"
    TRIANGULAR = "triangular"
    FIXED = "fixed"


COUNT = {Law.NORMAL: 2, Law.LOGNORMAL: 2, Law.UNIFORM: 2, Law.TRIANGULAR: 3, Law.FIXED: 1}


@dataclass(frozen=True)
class Distribution:
    """A law and its values [SI]; see `Law`. Build one from text with `distribution`."""

    law: Law
    values: tuple[float, ...]

    def at(self, u: FloatArray, low: float = -math.inf, high: float = math.inf) -> FloatArray:
        """The quantiles at u in (0, 1); a normal distribution is that of the values between low and high, and none is
        clipped."""
        from scipy.special import ndtr, ndtri

        v = self.values
        u = 0.5 + (1.0 - OPEN) * (u - 0.5)
        out: FloatArray
        if self.law is Law.FIXED:
            out = np.full_like(u, v[0])
        elif self.law is Law.NORMAL:
            p_low, p_high = ndtr((low - v[0]) / v[1]), ndtr((high - v[0]) / v[1])
            out = v[0] + v[1] * ndtri(p_low + (p_high - p_low) * u)
        elif self.law is Law.LOGNORMAL:
            out = v[0] * v[1] ** ndtri(u)
        elif self.law is Law.UNIFORM:
            out = v[0] + (v[1] - v[0]) * u
        else:
            a, m, b = v
            part = (m - a) / (b - a)
            out = np.where(u < part, a + np.sqrt(u * (b - a) * (m - a)), b - np.sqrt((1.0 - u) * (b - a) * (b - m)))
        return out

    def problem(self, low: float, high: float) -> str:
        """Why this is not a distribution of a number between low and high; "" where it is one."""
        from scipy.special import ndtr

        v = self.values
        if not all(math.isfinite(x) for x in v):
            return "a value is not finite. Give numbers."
        if (self.law is Law.NORMAL and v[1] <= 0.0) or (self.law is Law.LOGNORMAL and not (v[0] > 0.0 and v[1] > 1.0)):
            need = "a deviation above 0" if self.law is Law.NORMAL else "a median above 0 and a factor above 1"
            return f"{self.law} takes {need}. Give it, or a fixed value."
        if self.law in (Law.UNIFORM, Law.TRIANGULAR) and not (v[0] < v[-1] and sorted(v) == list(v)):
            return f"{self.law} takes values that rise. Sort them, or give a fixed value."
        if self.law is Law.NORMAL:
            outside = float(ndtr((low - v[0]) / v[1]) + ndtr((v[0] - high) / v[1]))
            advice = f"{outside:.0%} of it is outside {low:g} to {high:g}. Use lognormal, uniform or triangular."
            return advice if outside > MOST_OUTSIDE else ""
        ends = (v[0],) if self.law in (Law.LOGNORMAL, Law.FIXED) else (v[0], v[-1])
        if not all(low <= x <= high for x in ends):
            return f"beyond {low:g} to {high:g}. Give values in between."
        return ""

    def describe(self, kind: str = "") -> str:
        """In words, in display units: "lognormal 1, x/ 1.3"."""
        unit = f" {KINDS[kind].display}" if kind else ""
        show = [number(in_display(x, kind) if kind else x, 3) for x in self.values]
        if self.law is Law.LOGNORMAL:
            return f"lognormal {show[0]}{unit}, times or over {number(self.values[1], 3)}"
        if self.law is Law.NORMAL:
            return f"normal {show[0]} ± {show[1]}{unit}"
        if self.law is Law.FIXED:
            return f"fixed {show[0]}{unit}"
        return f"{self.law} {' to '.join((show[0], show[-1]))}{unit}" + (
            f", most often {show[1]}" if self.law is Law.TRIANGULAR else ""
        )

    def to_dict(self, kind: str = "") -> dict[str, Any]:
        """What `distribution` reads back."""
        units = [kind] * len(self.values)
        if self.law is Law.LOGNORMAL:
            units[1] = ""
        written = [f"{x!r} {KINDS[k].si}" if k else x for x, k in zip(self.values, units, strict=True)]
        return {self.law.value: written[0] if self.law is Law.FIXED else written}


def distribution(value: Any, kind: str, where: str, low: float = -math.inf, high: float = math.inf) -> Distribution:
    """A distribution from the table of a file.

    Parameters: value ``{normal = [1, 0.1]}``, ``{uniform = ["0 ms", "20 ms"]}`` and so on with the names of `Law`, or a
    plain value, which is fixed; kind of quantity ("" a pure number); where what comes first in an error; low, high what
    the number may be [SI].
    Errors: SpecError, UnitError of one line.
    """
    if not isinstance(value, Mapping):
        value = {Law.FIXED.value: value}
    if len(value) != 1 or (name := next(iter(value))) not in tuple(Law):
        raise SpecError(
            f"{where} = {quote(dict(value))}: choose one of {', '.join(Law)}, such as {{ normal = [1.0, 0.1] }}."
        )
    law, rows = Law(name), value[name]
    rows = rows if isinstance(rows, (list, tuple)) else [rows]
    if len(rows) != COUNT[law]:
        raise SpecError(f"{where}: {law} takes {COUNT[law]} value{'s' * (COUNT[law] > 1)}, came {len(rows)}.")
    kinds = [kind] * len(rows)
    if law is Law.LOGNORMAL:
        kinds[1] = ""
    result = Distribution(law, tuple(_value(x, k, where) for x, k in zip(rows, kinds, strict=True)))
    if problem := result.problem(low, high):
        raise SpecError(f"{where} = {quote({law.value: list(rows)})}: {problem}")
    return result


def _value(x: Any, kind: str, where: str) -> float:
    if kind:
        return parse(x, kind, where)
    if isinstance(x, bool) or not isinstance(x, (int, float)):
        raise SpecError(f"{where} = {quote(x)}: must be a number.")
    return float(x)


CASE = "case."
"""Begin of the paths that lie in the scenario; all others lie in the crane."""
CIRCUITS = ("active", "passive")
LEAST_RATIO = 1e-3
"""Low end of a positive number over its high end, where the file gives 0 [-]."""


class Target(NamedTuple):
    """A number that a factor changes: dotted path, and the share of it that follows the factor.

    The number becomes `base (1 + share (factor - 1))`; share None: it is the factor's value itself.
    """

    path: str
    share: Callable[[Crane], float] | None


def passive_outside_fit(crane: Crane, case: Scenario) -> bool:
    """Whether the passive motors carry this load where their loss was not fitted."""
    d = layer_diameter_at(crane, case.s_w)
    return any(
        p.circuit == "passive" and p.beyond for p in friction_parts(crane, load_record(crane, case).W, d, 0.0, 1.0)
    )


def _all(crane: Crane) -> float:
    return 1.0


def _of_scaled_inertia(crane: Crane) -> float:
    """Total inertia over the part that the factor scales [-]: gears, drum and motors of closed circuits. The wire keeps
    its mass, and motors of another kind keep their inertia."""
    ratio, circuits = inertia_ratio_without_wire(crane), [circuit.motor for circuit in crane.circuits.values()]
    others = sum(m.count * m.J for m in crane.motors if not any(m is motor for motor in circuits))
    return ratio if others == 0.0 else 1.0 / (1.0 / ratio - others / effective_inertia(crane))


@dataclass(frozen=True)
class Factor:
    """An uncertain quantity.

    kind of quantity ("": a pure number); default distribution with the reason of its width; whether it is among those
    drawn by default; least, most what it may be [SI]; targets what it changes, those that a crane does not have left
    out; of: the distribution where a crane file gives its width, in place of the default; outside: its ends where
    the default distribution does not hold at the working point (`outside_fit`).
    """

    name: str
    meaning: str
    targets: tuple[Target, ...]
    default: Distribution
    reason: str
    by_default: bool = True
    kind: str = ""
    least: float = 0.0
    most: float = math.inf
    of: Callable[[Crane], Distribution] | None = None
    outside: tuple[float, float] | None = None

    def outside_fit(self, crane: Crane, case: Scenario) -> bool:
        """Whether its default distribution does not hold at the working point of this run, where `outside` does: losses
        of motors that work outside their fit are a considerable part of the run's friction."""
        return self.outside is not None and bool(loss_notes(case_friction(crane, case)))

    def absent(self, crane: Crane, case: Scenario) -> str:
        """Reason why it has no effect here; "" where it has one."""
        tables = {t.path.partition(".")[0] for t in self.targets}
        lacking = all(table in Crane.model_fields and crane.table(table) is None for table in tables)
        if lacking and not crane.circuits and tables & {*CIRCUITS, "hpu"}:
            return f'"{crane.name}" has no closed circuit. Leave it out.'
        if lacking and "passive" in tables:
            return f'"{crane.name}" has no passive circuit. Leave it out.'
        if lacking:
            return f'"{crane.name}" has no table [{self.targets[0].path.partition(".")[0]}]. Leave it out.'
        if all(missing(crane, t.path) for t in self.targets):
            path = self.targets[0].path if self.name != LOSS_MODEL else "alternatives of its motors' loss models"
            return f'"{crane.name}" does not give {path}. State it, or leave it out.'
        if idle(crane, (t.path for t in self.targets if not missing(crane, t.path))):
            table = self.targets[-1].path.partition(".")[0]
            return f'the winch of "{crane.name}" moves by no number of [{table}]. Leave it out.'
        if self.name == "motor_offset" and crane.active.motor.variant is ServoVariant.CLOSED_LOOP:
            return f'the motors of "{crane.name}" are closed-loop. Set active.motor.variant, or leave it out.'
        if self.name == PASSIVE_LOSS and not passive_outside_fit(crane, case):
            return f'the passive motors of "{crane.name}" work where their loss was fitted. Leave it out.'
        if self.name == HEAVE_FILTER and not (isinstance(case.tip, VesselTip) and case.tip.unit.heave_period):
            return "no motion unit of the case filters heave. Leave it out."
        if self.name == "load" and case.load == 0.0:
            return "only the hook is on the wire. Leave this factor out."
        return ""


RATES = tuple(
    f"{unit}.servo.{rate}"
    for rate in ("rate_max", "rate_down", "dead_time")
    for unit in (
        *(f"{circuit}.{part}" for circuit in CIRCUITS for part in ("pump", "motor")),
        *("secondary.unit", "secondary.pump", "open.valve", "cylinder.pump"),
    )
)
OPTIONAL = (
    *("active.boost.Q_max", "cylinder.boost.Q_max", "control.compute_share", "hpu.P_max", "hpu.P_back"),
    *RATES,
)
"""Fields that a crane file may leave out, without a default."""


def missing(crane: Crane, path: str) -> bool:
    """Whether a crane leaves out a field, or the table that it is in."""
    table = path.partition(".")[0]
    if table in Crane.model_fields and crane.table(table) is None:
        return True
    motor, of_model, inner = path.partition(".loss_model")
    if of_model:
        return operator.attrgetter(f"{motor}.loss_model" if inner else f"{motor}.alternatives")(crane) is None
    return path in OPTIONAL and operator.attrgetter(path)(crane) is None


def damping_range(wire: Wire) -> tuple[float, float]:
    """Low and high end of the wire's damping ratio [-]: as the file gives them, else a third of the ratio and three
    times it; the ratio itself is between them."""
    low = wire.zeta / 3.0 if wire.zeta_low is None else wire.zeta_low
    high = 3.0 * wire.zeta if wire.zeta_high is None else wire.zeta_high
    return min(low, wire.zeta), max(high, wire.zeta)


def between(low: float, high: float) -> Distribution:
    """A positive number of which 95 % lie between two values."""
    low = max(low, LEAST_RATIO * high)
    return Distribution(Law.LOGNORMAL, (math.sqrt(low * high), (high / low) ** (0.5 / NORMAL_95)))


PASSIVE_LOSS = "passive_motor_loss"
LOSS_MODEL = "loss_model"
HEAVE_FILTER = "heave_filter"


def equal_models(crane: Crane) -> Distribution:
    """Place of a loss model among those that fit the motors equally well: 0 to 1 the one in force, and so on."""
    count = max((len(alternatives_of(motor)) for motor in crane.motors if isinstance(motor, Motor)), default=0)
    return Distribution(Law.UNIFORM, (0.0, 1.0 + count))


WIDTHS = {"wire_damping": lambda crane: between(*damping_range(crane.wire)), LOSS_MODEL: equal_models}
"""Factors whose distribution a crane file gives."""
SHARES: Mapping[str, Callable[[Crane], float] | None] = {
    "inertia_share": _of_scaled_inertia,
    "scaled": _all,
    "value": None,
}
"""Keys of `factors.toml` that name the numbers of a factor, with the share of them that follows it."""


def _factor(name: str, row: dict[str, Any]) -> Factor:
    """A factor from its table in `factors.toml`, and `SCALED`."""
    targets: list[Target] = []
    for key, share in SHARES.items():
        paths = row.pop(key, SCALED.get(name, ()) if key == "scaled" else ())
        each = dict.fromkeys(path.format(circuit=c) for c in CIRCUITS for path in paths)
        targets += [Target(path, share) for path in each]
    (law, values), outside = row.pop("default").popitem(), row.pop("outside", None)
    return Factor(
        name=name,
        targets=tuple(targets),
        default=Distribution(Law(law), tuple(values)),
        of=WIDTHS.get(name),
        outside=None if outside is None else tuple(outside),
        **row,
    )


FACTORS: Mapping[str, Factor] = {
    name: _factor(name, row)
    for name, row in tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")).items()
}
"""Every factor by name, in the order in which tables show them."""
EXCLUSIVE = (("leakage", "pump_leakage"), ("leakage", "motor_leakage"))
"""Pairs that would count the same thing twice."""
