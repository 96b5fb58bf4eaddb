"""A campaign of crane tests as its file describes it: crane, motors, signals of the logs, and one entry a test."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stillhook.engine.pack.winch import drum_record
from stillhook.errors import IdentifyError
from stillhook.formats.toml_fields import Fields, described, no_log_twice, no_name_twice
from stillhook.library import load_crane
from stillhook.library.parameter_sets.evidence import Evidence
from stillhook.library.toml.kinds import FileKind
from stillhook.logs.hook_depth import HookDepth, hook_depth
from stillhook.logs.mapping import mapping_from
from stillhook.logs.types import Signal
from stillhook.physics.load_path.drum import layer_diameter, layers_filled
from stillhook.physics.scalar import G
from stillhook.spec.circuits import Motor
from stillhook.spec.crane import Crane, Source
from stillhook.units import quote, show

TOP = ("title", "crane", "motors", "motor", "signals", "accuracy", "test", "synthetic")
TEST = ("name", "log", "D_m", "D_mt", "load", "layer", "s_w", "depth", "h_tip", "hold_out", "signals", "start", "end")
ACCURACY = ("p", "omega_m")
MARK = "SYNTHETIC"  # in a title, or synthetic = true: simulated, measured on no crane
SignalMap = Mapping[str, Signal]
MOST_ACCURACY = 0.2  # of a speed reading: a sensor worse than that measures nothing


@dataclass(frozen=True)
class CraneTest:
    """One staircase: hook load and displacement constant, hoisting and lowering in turn.

    ``load`` mass on the hook without the hook, below the water line less its buoyancy [kg]; ``D_m`` displacement of one
    motor [m^3/rad], None where the log has it; ``layer`` of wire in use, ``s_w`` wire out [m]: one of them, or neither
    where the log has s_w; ``hold_out`` kept from every fit; ``start``, ``end`` the part of the log that counts [s];
    ``hook`` where the file says how deep the hook is; ``wire`` mass of the wire out that the winch carries, less its
    buoyancy [kg]: 0 where the file does not say, and until the log is measured.
    """

    name: str
    log: Path
    load: float
    D_m: float | None
    layer: int | None
    s_w: float | None
    hold_out: bool
    mapping: SignalMap | None
    start: float
    end: float
    hook: HookDepth | None = None
    wire: float = 0.0


@dataclass(frozen=True)
class Campaign:
    """Tests of one crane. ``count`` motors in the circuit during the tests; ``motor`` their type with its loss model;
    ``u_p`` standard uncertainty of a pressure [Pa] and ``r_omega`` of a speed (relative) beyond the scatter of a
    stretch."""

    title: str
    source: str
    crane: Crane
    count: int
    motor: Motor
    motor_name: str
    motor_sources: Mapping[str, Source]
    motor_evidence: Evidence | None
    u_p: float
    r_omega: float
    tests: tuple[CraneTest, ...]
    synthetic: bool

    def weight(self, test: CraneTest) -> float:
        """Weight of load, hook and wire out [N]."""
        return (test.load + self.crane.hook_mass + test.wire) * G

    def layer_diameter(self, s_w: float) -> float:
        """Diameter of the wire's centre on the layer in use with s_w of wire out [m]."""
        drum = drum_record(self.crane)
        return float(layer_diameter(layers_filled(drum.L_full - s_w, drum), drum))

    def diameter(self, test: CraneTest) -> float | None:
        """The same as the file states it for a test, None where it states nothing."""
        if test.layer is not None:
            return float(layer_diameter(float(test.layer), drum_record(self.crane)))
        return None if test.s_w is None else self.layer_diameter(test.s_w)


def load_campaign(path: str | Path) -> Campaign:
    """Read a campaign file::

        crane = "nov-150t"            # library name or crane file: drum, wire, gears, hook
        motors = 11                   # motors in the circuit during the tests (default: all of the crane)
        motor = "A6VM215"             # their loss model: library name or motor file (default: the crane's active motor)
        [signals]
        time = { column = "Time", unit = "s" }
        p_a = { column = "PT A", unit = "bar" }
        ...
        [[test]]
        name = "1"
        log = "logs/1.csv"            # seen from this file
        D_m = "215 cm^3/rev"          # of one motor; or D_mt of all together; or a signal D_m or alpha_m
        load = "77 t"                 # on the hook, without the hook
        layer = 6                     # or s_w = "300 m", or a signal s_w
        depth = "0 m"                 # of the hook below the water line: the wire's weight is added (default: it is
        not) h_tip = "30 m"                # crane tip above the water line: with depth, or instead of it, where s_w
        states the other

    Errors: StillhookError, one line that names file, field, what came and what is allowed.
    """
    return described(path, FileKind.FRICTION_CAMPAIGN, _campaign)


def _campaign(data: Mapping[str, Any], file: Path) -> Campaign:
    top = Fields(data, "", IdentifyError)
    top.refuse_unknown(TOP)
    for name in ("crane", "test"):
        if name not in top:
            raise IdentifyError(f"{name}: missing. A campaign needs crane and at least one [[test]].")
    crane = load_crane(top.path_or_name("crane", file.parent))
    motor, motor_name, motor_sources, evidence = _motor(top, crane, file.parent)
    mapping = mapping_from(data["signals"], "signals") if "signals" in data else None
    title = str(data.get("title", file.stem))
    synthetic = top.flag("synthetic") or MARK in title
    accuracy = _accuracy(top)
    rows = data["test"]
    if not isinstance(rows, list) or not rows or not all(isinstance(r, dict) for r in rows):
        raise IdentifyError("test: give one [[test]] a log.")
    count = _count(top, crane)
    tests = tuple(_test(row, i, file.parent, crane, motor, count, mapping) for i, row in enumerate(rows))
    no_log_twice(tests, IdentifyError)
    no_name_twice([t.name for t in tests], IdentifyError)
    return Campaign(
        title=title,
        source=file.name,
        crane=crane,
        count=count,
        motor=motor,
        motor_name=motor_name,
        motor_sources=motor_sources,
        motor_evidence=evidence,
        u_p=_not_negative(accuracy, "p", "pressure"),
        r_omega=_share(accuracy),
        tests=tests,
        synthetic=synthetic,
    )


def _accuracy(top: Fields) -> Fields:
    table = top.table.get("accuracy", {})
    if not isinstance(table, Mapping):
        raise IdentifyError("accuracy: give a table [accuracy] with p and omega_m.")
    accuracy = Fields(table, "accuracy.", IdentifyError)
    accuracy.refuse_unknown(ACCURACY)
    return accuracy


def _count(top: Fields, crane: Crane) -> int:
    every = sum(circuit.motor.count for circuit in crane.circuits.values())
    count = top.table.get("motors", every)
    if type(count) is not int or not 1 <= count <= every:
        raise top.wrong("motors", f'"{crane.name}" has 1 to {every}. Give how many were in the circuit.')
    if "motors" not in top and len(crane.circuits) > 1:
        raise IdentifyError(
            f'motors: missing. "{crane.name}" has {crane.active.motor.count} active and'
            f" {every - crane.active.motor.count} passive motors: say how many were in the circuit that the pressures"
            f" were measured in (in the thesis all {every} were)."
        )
    return count


def _motor(top: Fields, crane: Crane, folder: Path) -> tuple[Motor, str, Mapping[str, Source], Evidence | None]:
    """The motor named in the file, or the crane's own, with the sources of its numbers and how well its loss is
    known."""
    from stillhook.library.parameter_sets.sets import load_losses

    if "motor" not in top:
        place, motor_fields = "active.motor.", set(Motor.model_fields)
        named = {path.removeprefix(place): source for path, source in crane.sources.items() if path.startswith(place)}
        sources = {path: source for path, source in named.items() if path.split(".")[0] in motor_fields}
        return crane.active.motor, crane.active.motor.type, sources, None
    name = top.text("motor")
    losses = load_losses(top.path_or_name("motor", folder))
    motor = losses.motor
    if not math.isclose(motor.D_max, crane.active.motor.D_max, rel_tol=1e-3):
        raise IdentifyError(
            f'motor = "{name}": {show(motor.D_max, "displacement")}, where "{crane.name}" has motors of '
            f"{show(crane.active.motor.D_max, 'displacement')}. Name a motor of that size."
        )
    return motor, Path(name).stem if name.endswith(".toml") else name, losses.sources, losses.evidence


def _test(
    row: Mapping[str, Any], i: int, folder: Path, crane: Crane, motor: Motor, count: int, mapping: SignalMap | None
) -> CraneTest:
    name = row.get("name", str(i + 1))
    if not isinstance(name, str) or not name.strip():
        raise IdentifyError(f'test {i + 1}: name = {quote(name)}: give a text, such as "3".')
    test = Fields(row, f'test "{name}": ', IdentifyError)
    test.refuse_unknown(TEST)
    test.need("log", "load")
    log, load = test.file("log", folder), test.quantity("load", "mass", 0.0)
    assert load is not None
    if not 0.0 <= load <= 1.5 * crane.SWL:
        swl = show(crane.SWL, "mass")
        raise IdentifyError(
            f'{test.place}load {show(load, "mass")}: "{crane.name}" is made for 0 t to {swl}. Check the load.'
        )
    test_mapping = mapping_from(row["signals"], f"{test.place}signals") if "signals" in row else mapping
    hold_out = test.flag("hold_out")
    start, end = test.quantity("start", "time", -math.inf), test.quantity("end", "time", math.inf)
    assert start is not None
    assert end is not None
    return CraneTest(
        name=name,
        log=log,
        load=load,
        D_m=_displacement(test, motor, count),
        layer=_layer(test, crane),
        s_w=_wire_out(test, crane),
        hold_out=hold_out,
        mapping=test_mapping,
        start=start,
        end=end,
        hook=_hook(test, test_mapping),
    )


def _displacement(test: Fields, motor: Motor, count: int) -> float | None:
    if "D_m" in test and "D_mt" in test:
        raise IdentifyError(
            f"{test.place}D_m and D_mt: both given. Give the displacement of one motor, or of all together."
        )
    together = test.quantity("D_mt", "displacement")
    D_m = test.quantity("D_m", "displacement") if together is None else together / count
    if D_m is not None and not 0.0 < D_m <= motor.D_max * 1.005:
        raise IdentifyError(
            f"{test.place}displacement of one motor {show(D_m, 'displacement')}: allowed is above 0 up to "
            f"{show(motor.D_max, 'displacement')}. D_m is that of one motor, D_mt that of all together."
        )
    return D_m


def _wire_out(test: Fields, crane: Crane) -> float | None:
    s_w, L_full = test.quantity("s_w", "length"), drum_record(crane).L_full
    if s_w is not None and not 0.0 <= s_w <= L_full:
        raise test.wrong("s_w", f'"{crane.name}" has 0 m to {show(L_full, "length")} of wire.')
    return s_w


def _hook(test: Fields, mapping: SignalMap | None) -> HookDepth | None:
    """Depth of the hook; where no signal states the wire out, what is stated must. Errors: IdentifyError."""
    hook = hook_depth(test)
    if hook is not None and mapping is not None and "s_w" not in mapping:
        s_w = test.quantity("s_w", "length")
        hook.wire_out() if s_w is None else hook.tip_height(s_w)
    return hook


def _layer(test: Fields, crane: Crane) -> int | None:
    layer = test.table.get("layer")
    if layer is None:
        return None
    if "s_w" in test:
        raise IdentifyError(f"{test.place}layer and s_w: both given. Give one.")
    if type(layer) is not int or not 1 <= layer <= crane.drum.layers:
        raise test.wrong("layer", f'"{crane.name}" has layers 1 to {crane.drum.layers}, counted from the bare drum.')
    return layer


def _not_negative(accuracy: Fields, key: str, kind: str) -> float:
    value = accuracy.quantity(key, kind, 0.0)
    assert value is not None
    if value < 0.0:
        raise accuracy.wrong(key, "give a standard uncertainty, 0 or more.")
    return value


def _share(accuracy: Fields) -> float:
    """Relative uncertainty of a speed: 0.002, or "0.2 %"."""
    value = accuracy.table.get("omega_m", 0.0)
    if isinstance(value, str) and value.rstrip().endswith("%"):
        try:
            value = float(value.rstrip()[:-1]) / 100.0
        except ValueError:
            value = None
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < MOST_ACCURACY:
        raise accuracy.wrong("omega_m", 'give a part of the reading, such as "0.2 %".')
    return float(value)
