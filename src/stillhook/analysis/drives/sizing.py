"""The drive of a library crane, scaled to another crane's hook, drum, wire and wire speed by one rule.

The reference keeps its safe working load, hook, drum, wire, PLC and system friction at the drum. The gear ratio gives
the reference's wire speed at full command; whole motors give the torque reserve that the library crane has for its own
safe working load; every extensive number of a drive is proportional to the number of motors.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from stillhook.analysis.controllers import lateness, strong_gain, strong_ssc
from stillhook.base.choice import nearest
from stillhook.control.interface import DISPLACEMENT
from stillhook.engine.pack.winch import motor_speed_max, wire_speed_max
from stillhook.errors import SpecError
from stillhook.library import changed, cranes, load_crane
from stillhook.library.toml.tree import nested
from stillhook.library.write import Item, file_value, items
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane, Installation, SourceKind, effective_inertia, holding_torque
from stillhook.spec.scenario import Mode
from stillhook.tables.table import Spec
from stillhook.units import quote, show
from stillhook.winches.interface import PartSpeed
from stillhook.winches.registry import WINCH_TYPES

EXPONENTS: Mapping[str, int] = {
    kind: power
    for power, kinds in (
        # With the number of motors, or of valves, pumps and stores side by side.
        (1, "displacement volume flow leakage leakage_per_speed area mass force force_per_speed stiffness"),
        (1, "stiffness_torsion torque viscous_torque torque_loss_pressure inertia power energy capacitance current"),
        # Against it.
        (-1, "flow_resistance resistance"),
        (-2, "torque_loss_turbulent flow_resistance_squared"),
        # The same for one and for many.
        (0, "length diameter speed time frequency rotation gain_per_time pressure modulus temperature"),
        (0, "temperature_rise voltage torque_constant"),
    )
    for kind in kinds.split()
}
"""Power of the size of a drive with which a number of each kind goes. The turbulent loss is a torque over displacement
cubed."""
ROUNDING = 1e-9
"""Part by which a number of motors may be above a whole number, and a speed above its limit, from rounding [-]."""
OF_REFERENCE = ("drum", "wire")
"""Tables that are those of the reference."""
OF_PLC = ("t_cycle", "compute_share", "tau_F", "t_bumpless")
"""Settings of the PLC itself, those of the reference; the others belong to the drive."""
MOST_GAIN = 10.0
"""Largest position gain that is taken [1/m]: the end of what tables/plausible.toml holds for winches. Gears, couplings
and the structure, which the model takes as stiff, swing before."""
GAIN_DIGITS = 4
"""Decimals that a position gain is rounded down to [1/m], so that the margins are kept."""


class Part(NamedTuple):
    """How a table of a drive was scaled: motors in it now and in the library crane."""

    table: str
    motors: int
    of: int


@dataclass(frozen=True)
class Sized:
    """A drive sized for the reference.

    crane: with its position gain; source: the library crane that it was scaled from; size s: torque at the motor shaft
    over that of the library crane [-]; parts: motors of its tables; mode: its controller; basis: what the gain follows
    from; t_lead: `lateness`, which a drive may do without [s]; v_full: wire speed at full command [m/s]; held_by: part
    that allows no more of it, "" where it is that asked for; beyond: parts that full command turns faster than they
    are made for.
    """

    name: str
    crane: Crane
    source: str
    size: float
    parts: tuple[Part, ...]
    mode: Mode
    basis: str
    t_lead: float
    v_full: float
    held_by: str
    beyond: tuple[str, ...]

    def describe(self) -> str:
        """In words: "electric: that of nov-100t-electric, size 2.58, 16 motors"."""
        motors = f", {sum(part.motors for part in self.parts)} motors" if self.parts else ""
        held = f", {show(self.v_full, 'speed')} at full command, held by {self.held_by}" if self.held_by else ""
        return f"{self.name}: drive of {self.source}, size {self.size:.3g}{motors}{held}"


def drives(names: str) -> list[str]:
    """Names of winch types in one text, with commas between them. Errors: SpecError for none, an unknown one, or one
    named twice."""
    chosen = [name.strip().lower() for name in names.split(",") if name.strip()]
    if not chosen:
        raise SpecError(f"--drives {quote(names)}: name at least one. Choose {', '.join(WINCH_TYPES)}.")
    for name in chosen:
        if name not in WINCH_TYPES:
            raise SpecError(
                f"--drives: unknown drive {quote(name)}. Choose {', '.join(WINCH_TYPES)}{nearest(name, WINCH_TYPES)}"
            )
        if chosen.count(name) > 1:
            raise SpecError(f'--drives: "{name}" is named twice. Name each drive once.')
    return chosen


def library_crane(drive: str, reference: Crane) -> Crane:
    """The crane whose drive is scaled: the reference for its own type, else the first of the library with it, one that
    is built before a paper winch. Errors: SpecError where the library has none."""
    if drive == reference.plant:
        return reference
    of_type = (crane for crane in map(load_crane, cranes()) if crane.plant == drive)
    result = min(of_type, key=lambda crane: crane.paper, default=None)
    if result is None:
        raise SpecError(
            f'--drives: the library has no crane with the drive "{drive}". Leave it out, or compare on a crane that'
            " has it."
        )
    return result


def sized(drive: str, reference: Crane, v_top: float | None = None) -> Sized:
    """A drive of this name sized for the reference, with its position gain; v_top wire speed at full command and full
    displacement on the full drum [m/s], default that of the reference. Errors: SpecError."""
    of = library_crane(drive, reference)
    fit = fitted(of, reference, wire_speed_max(reference) if v_top is None else v_top)
    crane, mode, basis, t_lead = with_gain(fit.crane)
    lines = tuple(
        f"{part.part}: {show(part.speed, part.quantity)} at full command, made for {show(part.highest, part.quantity)}"
        for part in beyond(crane)
    )
    return Sized(drive, crane, of.name, fit.size, fit.parts, mode, basis, t_lead, fit.v_full, fit.held_by, lines)


class Fitted(NamedTuple):
    """A drive sized within what its parts are made for; see `Sized`."""

    crane: Crane
    size: float
    parts: tuple[Part, ...]
    v_full: float
    held_by: str


def fitted(of: Crane, reference: Crane, v: float) -> Fitted:
    """The drive of a library crane sized for the reference and a wire speed at full command [m/s]. One without gears,
    whose parts are the faster the larger its flow, is sized for the speed at which the first of them ends."""
    crane, size, parts = scaled(of, reference, v)
    over = beyond(crane)
    if not over or crane.plant.type.full_wire_speed(crane) is None:
        return Fitted(crane, size, parts, v, "")
    most = max(over, key=lambda part: part.speed / part.highest)
    v *= most.highest / most.speed
    return Fitted(*scaled(of, reference, v), v, f"{most.part} of {show(most.highest, most.quantity)}")


def beyond(crane: Crane) -> list[PartSpeed]:
    """Parts that full command at full displacement moves faster than they are made for: motors on the shaft, those that
    carry SWL and hook at the displacement at which they do, and what a type names."""
    winch = crane.plant.type
    n = motor_speed_max(crane)
    others = {id(o.motor): min(o.alpha, 1.0) for o in winch.other_motors(crane, _weight(crane), crane.drum.d_max)}
    parts = [*winch.part_speeds(crane)]
    for motor in crane.motors:
        highest = motor.speed_limit(others.get(id(motor), 1.0)) if hasattr(motor, "n_max_full") else motor.n_max
        parts.append(PartSpeed("motors", n, highest, "rotation"))
    return [part for part in parts if part.speed > part.highest * (1.0 + ROUNDING)]


def _weight(crane: Crane) -> float:
    return (crane.SWL + crane.hook_mass) * G


def scaled(of: Crane, reference: Crane, v_top: float | None = None) -> tuple[Crane, float, tuple[Part, ...]]:
    """The drive of a library crane on the reference's drum, its size [-] and the motors of its tables; gains are those
    of the library crane."""
    winch, v_ref = of.plant.type, wire_speed_max(reference)
    v = v_ref if v_top is None else v_top
    ratio = _gear(of, reference, v_ref / v)
    loaded = reference.model_copy(update={"i_hD": reference.i_hD * ratio})
    size = holding_torque(loaded) / holding_torque(of)
    declared = getattr(winch.module, "sized", None)
    parts: tuple[Part, ...] = ()
    if declared is None:
        parts = tuple(_part(of, name, size) for name in winch.tables if _grows(of, name))
        factors = {part.table: part.motors / part.of for part in parts}
    else:
        factors = dict(declared(of, reference, v))
    factors = {"hpu": size, "brake": size} | factors
    n = _motors(of)
    n_new = n if not parts else sum(part.motors for part in parts)
    motors = n_new / n if n else 1.0
    changes = nested(
        [
            *_of_reference(reference),
            *_gears(reference, ratio),
            *_of_drive(of, parts, factors),
            *_friction(reference, ratio, _motors(reference) / n_new if n_new and _motors(reference) else 1.0),
            *_settings(of, reference, motors, wire_speed_max(of) / v),
            ("name", f"{reference.name}-{of.plant}"),
            ("title", f"{reference.name} with a drive as {of.name}"),
        ]
    )
    J_gear = reference.inertia.J_gear if not n else of.inertia.J_gear * motors
    loose = of.model_copy(update={"certified": None, "installation": _installation(of, reference, size)})
    return _with_inertia(loose, changes, reference, J_gear, {part.table: part.motors for part in parts}), size, parts


def _installation(of: Crane, reference: Crane, size: float) -> Installation | None:
    """That of the library crane; of one that is scaled, only whether it is built: its size on deck is not known."""
    if of.installation is None or (of.name == reference.name and size == 1.0):
        return of.installation
    return Installation(built=of.installation.built)


def _gear(of: Crane, reference: Crane, slower: float) -> float:
    """Gear ratio over that of the reference, with which full command gives the wanted wire speed; slower: wire speed of
    the reference over that wanted."""
    if of.plant.type.full_wire_speed(of) is not None:
        return 1.0
    own: float = of.plant.type.full_speed(of, 1.0) / reference.plant.type.full_speed(reference, 1.0)
    return own * slower


def _motors(crane: Crane) -> int:
    return sum(each.count for each in crane.motors)


def _grows(of: Crane, name: str) -> bool:
    """A table has numbers that go with its size."""
    below = [item for item in items(of) if _within(item.path, (name,))]
    return any(item.path.endswith(".count") or EXPONENTS.get(item.quantity or "") for item in below)


def _part(of: Crane, name: str, size: float) -> Part:
    """Whole motors of a table for a size. Errors: SpecError for a table without motors, of a type that does not say how
    it is sized."""
    counts = [spec.count for _, spec in _records(of.table(name), name) if "count" in type(spec).model_fields]
    if len(counts) != 1:
        raise SpecError(
            f'"{of.name}": winch type "{of.plant}" has no one number of motors in [{name}] and declares no sized(), so'
            " it cannot be sized. Leave it out."
        )
    return Part(name, math.ceil(size * counts[0] * (1.0 - ROUNDING)), counts[0])


def _records(spec: Spec, path: str) -> Iterator[tuple[str, Any]]:
    """A table and all tables in it, with their paths."""
    yield path, spec
    for name in type(spec).model_fields:
        value = spec.__dict__.get(name)
        if isinstance(value, Spec):
            yield from _records(value, f"{path}.{name}")


def of_one_motor(crane: Crane) -> tuple[str, ...]:
    """Tables whose numbers are those of one motor: those with a number of motors, and what the type names."""
    tables = [crane.table(name) for name in crane.plant.type.tables]
    pairs = zip(crane.plant.type.tables, tables, strict=True)
    counted = [
        path
        for name, table in pairs
        if table is not None
        for path, spec in _records(table, name)
        if "count" in type(spec).model_fields
    ]
    return (*counted, *getattr(crane.plant.type.module, "PER_MOTOR", ()))


def _within(path: str, tables: Any) -> bool:
    return any(path == table or path.startswith(f"{table}.") for table in tables)


Change = tuple[str, Any]


def _leaf(item: Item, value: Any, source: str, *, derived: bool = True) -> Change:
    """A changed number with what it was made from; what was assumed stays assumed."""
    kind = SourceKind.DERIVED if derived and item.source.kind is not SourceKind.ASSUMED else item.source.kind
    return item.path, {"value": file_value(value, item.quantity), "kind": kind.value, "source": source}


def _times(item: Item, factor: float, of: str) -> Change:
    value = tuple(x * factor for x in item.value) if isinstance(item.value, tuple) else item.value * factor
    return _leaf(item, value, f"{factor:.4g} times that of {of}: {item.source.text}")


def _of_drive(of: Crane, parts: tuple[Part, ...], factors: Mapping[str, float]) -> Iterator[Change]:
    """Numbers of the drive's tables that are proportional to their size; the closest table named in factors counts."""
    counts = {part.table: part.motors for part in parts}
    one = of_one_motor(of) if parts else ()
    for item in items(of):
        tables = [table for table in factors if _within(item.path, (table,))]
        if not tables:
            continue
        factor, (table, _, name) = factors[max(tables, key=len)], item.path.rpartition(".")
        if factor == 1.0:
            continue
        if name == "count" and item.path.partition(".")[0] in counts:
            yield _leaf(item, counts[item.path.partition(".")[0]], f"sized as {of.name}: {item.source.text}")
        elif item.quantity is not None and not _within(table, one) and (power := EXPONENTS[item.quantity]):
            yield _times(item, factor**power, of.name)


def _of_reference(reference: Crane) -> Iterator[Change]:
    for item in items(reference):
        if item.path in ("SWL", "hook_mass") or _within(item.path, OF_REFERENCE):
            yield _leaf(item, item.value, item.source.text, derived=False)


def _gears(reference: Crane, ratio: float) -> Iterator[Change]:
    """The reference's gears, their first stage changed."""
    for item in items(reference):
        if item.path == "i_hD":
            yield _leaf(item, item.value * ratio, f"for the wire speed of {reference.name} at full command")
        elif item.path == "gear_ratios":
            first, *rest = item.value
            yield _leaf(item, (first * ratio, *rest), f"for the wire speed of {reference.name} at full command")


def _friction(reference: Crane, ratio: float, fewer: float) -> Iterator[Change]:
    r"""The reference's friction, the same at the drum: Y is that of one motor shaft, of which there are others at
    another gear.

    .. math:: Y_i' = Y_i \frac{n i}{n' i'},\quad Y_4' = Y_4 \frac{i'}{i},\quad Y_5' = Y_5 \frac{n i^2}{n' i'^2}

    ratio: i'/i; fewer: n/n' motors of the reference over those of the drive. The bristle is one for the whole shaft.
    """
    torque = dict.fromkeys(("Y_1", "Y_2", "Y_3", "Y_6"), fewer / ratio)
    factors = {f"friction.system.{name}": factor for name, factor in torque.items()}
    factors |= {"friction.system.Y_4": ratio, "friction.system.Y_5": fewer / ratio**2}
    factors |= {"friction.sigma_0": 1.0 / ratio**2, "friction.omega_fade": ratio, "friction.omega_reg": ratio}
    for item in items(reference):
        if _within(item.path, ("friction",)):
            factor = factors.get(item.path, 1.0)
            same = _leaf(item, item.value, item.source.text, derived=False)
            yield same if factor == 1.0 else _times(item, factor, reference.name)


def _settings(of: Crane, reference: Crane, motors: float, slower: float) -> Iterator[Change]:
    """Settings of the PLC of the reference, and of the drive: feedforward by its wire speed, slower: that of the
    library crane over the new one; friction of the linear analysis by its motors."""
    for item in items(reference):
        table, _, name = item.path.partition(".")
        if table == "control" and name in OF_PLC:
            yield _leaf(item, item.value, item.source.text, derived=False)
    for item in items(of):
        factors = {"control.K_1": slower, "control.K_2": slower, "control.B_v": motors}
        if (factor := factors.get(item.path, 1.0)) != 1.0:
            yield _times(item, factor, of.name)


def _with_inertia(
    of: Crane, changes: dict[str, Any], reference: Crane, J_gear: float, counts: Mapping[str, int]
) -> Crane:
    """The crane, its effective inertia worked out again from its parts; counts: motors by table."""
    i, J_drum = changes["i_hD"]["value"], reference.inertia.J_drum
    tables = [(name, table) for name in of.plant.type.tables if (table := of.table(name)) is not None]
    motors = 0.0
    for each in of.motors:
        name = next(name for name, table in tables if any(spec is each for _, spec in _records(table, name)))
        motors += counts.get(name, each.count) * each.J
    loose = reference.model_copy(update={"i_hD": i, "inertia": reference.inertia.model_copy(update={"J_gear": J_gear})})
    wheels = effective_inertia(loose) - sum(m.count * m.J for m in reference.motors)
    own = of.plant == reference.plant and motors == sum(m.count * m.J for m in reference.motors)
    J = reference.inertia.J_m_eff if own and i == reference.i_hD else motors + wheels
    text = f"motors as {of.name}, drum and wire of {reference.name}"
    values = {"J_gear": J_gear, "J_drum": J_drum, "J_m_eff": J}
    changes["inertia"] = {
        name: {"value": file_value(x, "inertia"), "kind": SourceKind.DERIVED.value, "source": text}
        for name, x in values.items()
    }
    return changed(of, changes)


def with_gain(crane: Crane) -> tuple[Crane, Mode, str, float]:
    """The crane with the largest position gain of gain margin 2, phase margin 45 degrees and sensitivity peak 2, and
    its reference aligned in time; the controller, what the gain follows from, and the lead [s]. Strong SSC on a closed
    circuit, position control on drives that take a speed command, whose loop is that of the running engine."""
    winch = crane.plant.type
    mode, lead = winch.default_mode, lateness(crane)
    if winch.control == DISPLACEMENT and winch.steady_operation:
        return strong_ssc(crane).on(crane), mode, "strong SSC", lead
    K_p, basis = strong_gain(crane, mode)
    if K_p > MOST_GAIN:
        K_p, basis = MOST_GAIN, f"{MOST_GAIN:g} 1/m, the end of what winches have; {basis} would allow {K_p:.3g} 1/m"
    down = math.floor(K_p * 10**GAIN_DIGITS) / 10**GAIN_DIGITS
    gains = {"K_p": f"{down:.{GAIN_DIGITS}f} 1/m", "t_lead": f"{1e3 * lead:.4g} ms"}
    return changed(crane, {"control": gains}), mode, basis, lead


def with_lead(crane: Crane, lead: float) -> Crane:
    """The crane whose PLC extrapolates the tip's motion by a time [s]."""
    return crane.model_copy(update={"control": crane.control.model_copy(update={"t_lead": lead, "t_lead_ff": None})})


def rule(reference: Crane, v: float) -> tuple[str, ...]:
    """The rule of sizing in a few lines; v wire speed at full command [m/s]."""
    return (
        f"Sizing: hook, drum, wire, system friction at the drum and PLC of {reference.name}; each drive is that of a"
        f" library crane, geared to {show(v, 'speed')} of wire at full command and full displacement, or to what its"
        " parts are made for where that is less.",
        "Size: whole motors that keep the torque reserve which the library crane has for its own SWL on the full drum;"
        " pumps, lines, valves, stores and power scale with the motors; pressures, speeds and times are kept.",
        "Gain: the largest with gain margin 2, phase margin 45 deg and sensitivity peak 2; strong SSC on closed"
        " circuits, position control on the others; the tip is extrapolated by what PLC and oil are late where that"
        " leaves less error.",
    )
