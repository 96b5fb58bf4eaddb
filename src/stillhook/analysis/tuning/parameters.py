"""Which settings of a controller may be tuned, between which ends, and how they get into a crane and back into a
file."""

from __future__ import annotations

import math
import operator
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from pydantic.fields import FieldInfo

from stillhook.analysis.controllers import Controller
from stillhook.analysis.loop_stability.governing import by_engine, governing
from stillhook.analysis.loop_stability.stability import gain_limit
from stillhook.base.choice import nearest
from stillhook.control.interface import Setting as ControllerSetting
from stillhook.control.registry import CONTROLLERS, ControlLaw
from stillhook.engine.pack.settings import with_value
from stillhook.engine.pack.winch import gains, wire_speed_max
from stillhook.errors import StillhookError
from stillhook.spec.control import own_settings, own_table
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, mode_of
from stillhook.tables.plausible import marks
from stillhook.units import KINDS, Quantity, show
from stillhook.variables import BY_NAME
from stillhook.winches.registry import WINCH_TYPES

FEEDFORWARD = ("K_1", "K_2", "K_p", "t_lead")
"""Settings of the pumps, which all controllers share."""
ON_REQUEST = ("t_lead_ff",)
"""Those that are tuned where they are named alone: the lead of the feedforward follows t_lead unless a crane file gives
it."""
K_1_RANGE = (0.95, 1.10)
"""Search range of K_1 over the ideal one [-]: leakage takes 1 to 4 % of the speed, print has 0.82."""
K_2_LEAD = 0.15
"""Longest lead K_2 / K_1 that is searched [s]: two and a half times the lag of the published pumps."""
K_P_RANGE = (0.005, 0.5)
"""Search range of K_p over its limit of marginal stability at full displacement [-]; the margins end it before its
upper end, and for a slow loaded winch at small displacement near its lower one."""
LEAD_BEYOND = 0.1
"""Lead beyond the delay of the motion signal that is searched [s]."""
U_THR_RANGE = (0.1, 0.98)
DIGITS, DIGITS_AT_A_LIMIT = 5, 9
"""Digits of a tuned setting in a file; more where five would break a limit that the setting itself keeps."""
ALPHA_MOST = 0.98
"""Largest least displacement of SSC: at 1 it would be a fixed motor."""


class Setting(NamedTuple):
    """One setting that may be tuned: name, and the ends of its search [SI]."""

    name: str
    low: float
    high: float


def tunable(mode: Mode | str, crane: Crane | None = None) -> tuple[str, ...]:
    """Names of the settings of a controller that are tuned unless some are named, and of the drive of the crane's winch
    type. Errors: StillhookError for a mode without settings, or an unknown one."""
    chosen = mode_of(mode)
    if not chosen.compensates:
        others = ", ".join(m.value for m in Mode if m.compensates)
        raise StillhookError(f'"{chosen}" has no settings to tune. Choose {others}.')
    of_drive = () if crane is None else tuple(crane.plant.type.tuned)
    return (*FEEDFORWARD, *chosen.law.uses, *searched(chosen.law), *of_drive)


def nameable(mode: Mode | str, crane: Crane | None = None) -> tuple[str, ...]:
    """Names of all that may be tuned, with those ON_REQUEST. Errors: as `tunable`."""
    return (*tunable(mode, crane), *ON_REQUEST)


def searched(law: ControlLaw) -> dict[str, ControllerSetting]:
    """A controller's own settings that may be tuned, by table and name: "my_law.T_i"."""
    return {f"{law.field}.{name}": setting for name, setting in law.settings.items() if setting.search is not None}


def described(name: str) -> tuple[str, str, str]:
    """Kind, SI unit and meaning of a setting."""
    if name in BY_NAME:
        return BY_NAME[name].kind, BY_NAME[name].unit, BY_NAME[name].meaning
    if (drive := _drive_field(name)) is not None:
        kind = next((mark.kind for mark in marks(drive.annotation) if isinstance(mark, Quantity)), "")
        kind = next((mark.kind for mark in drive.metadata if isinstance(mark, Quantity)), kind)
        return kind, KINDS[kind].si if kind else "1", str(drive.description)
    setting = next(settings[name] for law in CONTROLLERS.values() if name in (settings := searched(law)))
    return setting.kind, KINDS[setting.kind].si if setting.kind else "1", setting.meaning


def _drive_field(path: str) -> FieldInfo | None:
    """The field of a winch type's tables at a path that its TUNED names; None for any other name."""
    for winch in WINCH_TYPES.values():
        if path in winch.tuned:
            table, *fields = path.split(".")
            model = winch.tables[table]
            for name in fields[:-1]:
                model = model.model_fields[name].annotation
            field: FieldInfo = model.model_fields[fields[-1]]
            return field
    return None


def space(crane: Crane, mode: Mode, free: Sequence[str] = (), *, delay: float = 0.0) -> tuple[Setting, ...]:
    """The settings to tune with the ends of their search; all those of the motor law unless `free` names some.

    alpha_min, the absolute minimum that protects winch components whose limits no crane file holds, may be raised,
    never lowered.
    Errors: StillhookError for a setting that this law does not know, or one named twice.
    """
    names = nameable(mode, crane)
    for name in free:
        if name not in names:
            raise StillhookError(
                f'free: "{name}" is not a setting of {mode.value}, which has {", ".join(names)}{nearest(name, names)}'
            )
        if list(free).count(name) > 1:
            raise StillhookError(f'free: "{name}" is named twice. Name each setting once.')
    K_1, K_p_ms = 1.0 / wire_speed_max(crane), _marginal_gain(crane, mode)
    ends = {
        "K_1": (K_1_RANGE[0] * K_1, K_1_RANGE[1] * K_1),
        "K_2": (0.0, K_2_LEAD * K_1),
        "K_p": (K_P_RANGE[0] * K_p_ms, K_P_RANGE[1] * K_p_ms),
        "t_lead": (0.0, delay + LEAD_BEYOND),
        "t_lead_ff": (0.0, delay + LEAD_BEYOND),
        **_of_motors(crane),
        **{name: setting.search for name, setting in searched(mode.law).items() if setting.search is not None},
        **crane.plant.type.tuned,
    }
    start = present(crane)
    wanted = free or tunable(mode, crane)
    return tuple(
        Setting(n, min(ends[n][0], start[n]), max(ends[n][1], start[n])) for n in wanted if ends[n][1] > ends[n][0]
    )


def _marginal_gain(crane: Crane, mode: Mode) -> float:
    """Position gain of marginal stability that the search is measured by [1/m]: of the published loop, or of the
    running engine. Errors: StillhookError where it oscillates without feedback at every speed."""
    if not by_engine(crane):
        return gain_limit(crane).K_p_ms
    found = governing(crane, mode)
    if found.limit is None:
        raise StillhookError(f'"{crane.name}" in {mode.value}: {found.describe()}. There is no gain to tune.')
    return found.limit.gains.high


def _of_motors(crane: Crane) -> dict[str, tuple[float, float]]:
    """Ends of the search of what a closed circuit's motors have; none without one."""
    if not crane.circuits:
        return {}
    least, c = crane.active.motor.alpha_min, crane.control
    return {
        "u_thr": U_THR_RANGE,
        "alpha_min": (least, max(ALPHA_MOST, least)),
        "alpha_swl": (least, 1.0),
        "alpha_ns": (c.alpha_hs, 1.0),
        "alpha_hs": (least, c.alpha_ns),
    }


def present(crane: Crane) -> dict[str, float]:
    """Every tunable setting as the PLC runs with it, derived ones worked out [SI]."""
    g, c = gains(crane), crane.control
    alpha_swl = c.alpha_ns if c.alpha_swl is None else c.alpha_swl
    return {
        "K_1": g.K_1,
        "K_2": g.K_2,
        "K_p": g.K_p,
        "t_lead": c.t_lead or 0.0,
        "t_lead_ff": c.feedforward_lead,
        "u_thr": c.u_thr,
        "alpha_min": crane.plant.type.least_displacement(crane),
        "alpha_swl": alpha_swl,
        "alpha_ns": c.alpha_ns,
        "alpha_hs": c.alpha_hs,
        **_controller_settings(crane),
        **{path: float(operator.attrgetter(path)(crane)) for path in crane.plant.type.tuned},
    }


def _controller_settings(crane: Crane) -> dict[str, float]:
    laws = [law for law in CONTROLLERS.values() if law.settings]
    return {
        f"{law.field}.{name}": value
        for law in laws
        for name, value in own_settings(crane.control, law)._asdict().items()
    }


def with_settings(crane: Crane, values: Mapping[str, float]) -> Crane:
    """The crane with these settings, as numbers in SI: a hundred times faster than by a crane file.

    A raised alpha_min takes the fixed displacements of NS and HS with it where they would lie below; SSC does not use
    them.
    Errors: StillhookError for a number that no crane file could hold.
    """
    for name, value in values.items():
        if not (
            math.isfinite(value)
            and (("." in name) or (0.0 <= value and (value <= 1.0 or name in (*FEEDFORWARD, *ON_REQUEST))))
        ):
            raise StillhookError(f"{name} = {value!r}: outside the range of a crane file.")
    for path in crane.plant.type.tuned.keys() & values.keys():
        crane = with_value(crane, path, values[path])
    control: dict[str, Any] = {name: value for name, value in values.items() if "." not in name}
    for law in CONTROLLERS.values():
        of_law = {n.partition(".")[2]: value for n, value in values.items() if n.startswith(f"{law.field}.")}
        if of_law:
            control[law.field] = own_table(crane.control, law).model_copy(update=of_law)
    alpha_min = control.pop("alpha_min", None)
    if alpha_min is None:
        return crane.model_copy(update={"control": crane.control.model_copy(update=control)})
    control |= _raised(crane, alpha_min, control)
    motor = crane.active.motor.model_copy(update={"alpha_min": alpha_min})
    active = crane.active.model_copy(update={"motor": motor})
    return crane.model_copy(update={"control": crane.control.model_copy(update=control), "active": active})


def _raised(crane: Crane, alpha_min: float, control: Mapping[str, float]) -> dict[str, float]:
    """Fixed displacements that a raised alpha_min takes with it; alpha_swl stays what it was where it followed
    alpha_ns."""
    c, out = crane.control, {}
    if alpha_min > c.alpha_hs:
        out["alpha_hs"] = alpha_min
    if alpha_min > c.alpha_ns:
        out["alpha_ns"] = alpha_min
        if c.alpha_swl is None and "alpha_swl" not in control:
            out["alpha_swl"] = c.alpha_ns
    return out


def tuned_controller(
    crane: Crane, start: Controller, values: Mapping[str, float], name: str, digits: int = DIGITS
) -> Controller:
    """A controller with these settings on top of those of `start`, in the form of a file: what differs, with so many
    digits and units.

    K_p is rounded down, alpha_min up, so that margins that were kept stay kept.
    """
    plain = start.on(crane)
    old_values = present(plain)
    follows = [n for n in ON_REQUEST if getattr(plain.control, n) is None]  # written down, else it would go with t_lead
    numbers = {
        n: rounded(n, v, digits)
        for n, v in values.items()
        if n in follows or not math.isclose(v, old_values[n], rel_tol=10.0**-digits)
    }
    if "alpha_min" in numbers:
        numbers |= _raised(plain, numbers["alpha_min"], numbers)
    old = start.changes_on(crane)
    control, motor = dict(old.get("control", {})), dict(old.get("active", {}).get("motor", {}))
    drive: dict[str, Any] = {name: table for name, table in old.items() if name not in ("control", "active")}
    for n, v in numbers.items():
        table, _, leaf = n.rpartition(".")
        if n in crane.plant.type.tuned:
            drive = _with_leaf(drive, n, text_of(n, v, digits))
        elif table:
            control[table] = {**control.get(table, {}), leaf: text_of(n, v, digits)}
        else:
            (motor if n == "alpha_min" else control)[n] = text_of(n, v, digits)
    changes: dict[str, Any] = {"control": control} | ({"active": {"motor": motor}} if motor else {}) | drive
    return Controller(name, start.mode, changes)


def _with_leaf(tables: Mapping[str, Any], path: str, value: Any) -> dict[str, Any]:
    """Nested tables with one value more, by its dotted path."""
    name, _, inner = path.partition(".")
    return {**tables, name: _with_leaf(tables.get(name, {}), inner, value) if inner else value}


def rounded(name: str, value: float, digits: int = DIGITS) -> float:
    """A setting with so many significant digits, on the safe side where the margins depend on it."""
    if value == 0.0:
        return 0.0
    scale = 10.0 ** (digits - 1 - math.floor(math.log10(abs(value))))
    shift = {"K_p": math.floor, "alpha_min": math.ceil}.get(name, round)
    return float(f"{shift(value * scale) / scale:.{digits}g}")


def text_of(name: str, value: float, digits: int = DIGITS) -> str | float:
    kind = described(name)[0]
    return show(value, kind, digits + 1) if kind else value


def of_vector(settings: Sequence[Setting], x: Sequence[float]) -> dict[str, float]:
    """Settings from a point of the unit cube; its ends stay ends."""
    return {
        s.name: min(max(s.low + float(u) * (s.high - s.low), s.low), s.high) for s, u in zip(settings, x, strict=True)
    }


def to_vector(settings: Sequence[Setting], values: Mapping[str, float]) -> list[float]:
    """The point of the unit cube that settings lie at."""
    return [(values[s.name] - s.low) / (s.high - s.low) for s in settings]
