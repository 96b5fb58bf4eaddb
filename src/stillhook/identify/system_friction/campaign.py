"""A campaign of crane tests as its file describes it: crane, motors, signals of the logs, and one entry a test."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from stillhook import units as u
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import IdentifyError
from stillhook.identify.system_friction.thesis import Variant
from stillhook.library import load_crane
from stillhook.library.parameter_sets import LossSet, load_losses
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind
from stillhook.logs.campaign import MARK, HookDepth, LoggedTest, check_names, check_parts, hook_depth, marked_logs
from stillhook.logs.mapping import mapping_from
from stillhook.logs.types import Signal
from stillhook.physics.load_path.drum import layer_diameter, layers_filled
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.tables.table import Flag, Name, Share, Spec, Text
from stillhook.units import show
from stillhook.winches.circuits.tables import Motor

SignalMap = Mapping[str, Signal]
OWN_FRICTIONS = ("identified", "second-loop")
"""What may be verified that the campaign's own tests were fitted to."""
LARGEST_ACCURACY = 0.2  # of a speed reading: a sensor worse than that measures nothing


class Accuracy(Spec):
    """Standard uncertainties beyond the scatter of a stretch."""

    p: u.Pressure = Field(default=0.0, ge=0, description="of a pressure")
    omega_m: Share = Field(default=0.0, ge=0, lt=LARGEST_ACCURACY, description="of a speed, as part of the reading")


class FitSettings(Spec):
    """The table [fit]: how the friction is identified."""

    like: Text | None = Field(default=None, description="set of a similar winch, for what these tests cannot determine")
    keep_Y_2: Flag | None = Field(default=None, description="keep the constant term (default: where the data ask)")
    loops: Annotated[int, Field(strict=True, ge=0, le=10)] = Field(default=0, description="rounds of the second loop")
    map: Text | None = Field(default=None, description="supplier's map of the motor, to compare with its fitted model")
    variant: Variant = Field(default=Variant.KRUS, description="complex method that checks the fit")
    seed: Annotated[int, Field(strict=True, ge=0)] = Field(default=0, description="seed of everything random")
    proposals: Annotated[int, Field(strict=True, ge=0, le=20)] = Field(
        default=3, description="how many further tests are proposed"
    )


class VerifySettings(Spec):
    """The table [verify]: which friction is compared with the logs in the running twin, and its limits (paper D)."""

    friction: Text = Field(
        default="identified",
        description='"identified" or "second-loop" by this campaign, "crane" (of the crane file), or a friction set',
    )
    pressure: Share = Field(default=0.1, gt=0, lt=1, description="limit of the deviation over the measured pressure")
    torque: Share = Field(
        default=0.01, gt=0, lt=1, description="limit of the deviation over the load torque, of staircases under load"
    )


class TestTable(LoggedTest):
    """A table [[test]]: one staircase."""

    D_m: u.Displacement | None = Field(default=None, description="displacement of one motor")
    D_mt: u.Displacement | None = Field(default=None, description="displacement of all motors together")
    load: u.Mass = Field(ge=0, description="on the hook, without the hook")
    layer: Annotated[int, Field(strict=True)] | None = Field(default=None, description="layer of wire in use")
    hold_out: Flag = Field(default=False, description="kept from every fit")
    ahc: Flag = Field(default=False, description="in heave compensation: for the verification only, never fitted")

    @model_validator(mode="after")
    def _stated_once(self) -> Self:
        if self.D_m is not None and self.D_mt is not None:
            raise ValueError("D_m and D_mt: both given. Give the displacement of one motor, or of all together.")
        if self.layer is not None and self.s_w is not None:
            raise ValueError("layer and s_w: both given. Give one.")
        return self


class CampaignFile(Spec):
    """A campaign of friction tests."""

    title: Name | None = Field(default=None, description="title of the report")
    crane: Text = Field(description="library name or crane file: drum, wire, gears, hook")
    motors: Annotated[int, Field(strict=True)] | None = Field(
        default=None, description="motors in the circuit during the tests; default all of the crane"
    )
    motor: Text | None = Field(default=None, description="loss model: library name or motor file")
    signals: Mapping[str, Any] | None = Field(default=None, description="columns of the logs")
    accuracy: Accuracy = Field(default_factory=Accuracy)
    test: tuple[TestTable, ...] = Field(min_length=1, description="one [[test]] table for each log")
    synthetic: Flag = Field(default=False, description="simulated, measured on no crane")
    fit: FitSettings = Field(default_factory=FitSettings)
    verify: VerifySettings = Field(default_factory=VerifySettings)


@dataclass(frozen=True)
class CraneTest:
    """One staircase: hook load and displacement constant, hoisting and lowering in turn; or, with ``ahc``, a run in
    heave compensation.

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
    ahc: bool = False


@dataclass(frozen=True)
class Campaign:
    """Tests of one crane. ``count`` motors in the circuit during the tests; ``losses`` their type with its loss model,
    its sources and how well it is known."""

    title: str
    source: str
    crane: Crane
    count: int
    losses: LossSet
    accuracy: Accuracy
    tests: tuple[CraneTest, ...]
    synthetic: bool
    fit: FitSettings
    verify: VerifySettings = field(default_factory=VerifySettings)

    @property
    def motor(self) -> Motor:
        return self.losses.motor

    @property
    def prefix(self) -> str:
        """What a title of synthetic data begins with."""
        return f"{MARK} " if self.synthetic else ""

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
        depth = "0 m"                 # of the hook below the water line: the wire's weight is added (default: not)
        h_tip = "30 m"                # crane tip above the water line: with depth, or instead of it, where s_w states
                                      # the other
        ahc = true                    # a run in heave compensation: verified in the twin, never fitted (default: false)

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    Campaign
        The crane and its tests.

    Raises
    ------
    StillhookError
        One line that names file, field, what came and what is allowed.
    """
    return read_toml(path, FileKind.FRICTION_CAMPAIGN, IdentifyError, _campaign)


def _campaign(table: TomlTable) -> Campaign:
    file = table.read(CampaignFile)
    crane = load_crane(table.relative_toml(file.crane))
    losses, count = _losses(file, table, crane), _count(file, table, crane)
    mapping = None if file.signals is None else mapping_from(file.signals, table.path.name)
    tests = tuple(
        _test(row, i, table.at("test", i), crane, losses.motor, count, mapping) for i, row in enumerate(file.test)
    )
    check_parts(tests, IdentifyError)
    check_names(tests, IdentifyError)
    title = file.title or table.path.stem
    synthetic = file.synthetic or MARK in title or bool(marked_logs(tests))
    like = None if file.fit.like is None else table.relative_toml(file.fit.like)
    supplier = None if file.fit.map is None else str(table.relative_file(file.fit.map, "fit", "map"))
    fit = file.fit.model_copy(update={"like": like, "map": supplier})
    verify = file.verify.model_copy(update={"friction": table.relative_toml(file.verify.friction)})
    return Campaign(title, table.path.name, crane, count, losses, file.accuracy, tests, synthetic, fit, verify)


def _count(file: CampaignFile, table: TomlTable, crane: Crane) -> int:
    active, passive = crane.active.motor.count, sum(c.motor.count for c in crane.circuits.values())
    passive -= active
    count = active + passive if file.motors is None else file.motors
    if not 1 <= count <= active + passive:
        raise table.wrong(f'"{crane.name}" has 1 to {active + passive}. Give how many were in the circuit.', "motors")
    if file.motors is None and passive > 0:
        raise IdentifyError(
            f'motors: missing. "{crane.name}" has {active} active and {passive} passive motors: say how many were in'
            f" the circuit that the pressures were measured in (in the thesis all {active + passive} were)."
        )
    return count


def _losses(file: CampaignFile, table: TomlTable, crane: Crane) -> LossSet:
    own, name = crane.active.motor, file.motor
    if name is None:
        place = "active.motor."
        named = {path.removeprefix(place): source for path, source in crane.sources.items() if path.startswith(place)}
        sources = {path: source for path, source in named.items() if path.split(".")[0] in Motor.model_fields}
        return LossSet(own.type, own.type, own, sources)
    losses = load_losses(table.relative_toml(name))
    if not math.isclose(losses.motor.D_max, own.D_max, rel_tol=1e-3):
        size, needed = (show(D_max, "displacement") for D_max in (losses.motor.D_max, own.D_max))
        raise table.wrong(f'{size}, where "{crane.name}" has motors of {needed}. Name a motor of that size.', "motor")
    return replace(losses, name=Path(name).stem if name.endswith(".toml") else name)


def _test(
    row: TestTable, i: int, table: TomlTable, crane: Crane, motor: Motor, count: int, mapping: SignalMap | None
) -> CraneTest:
    if row.load > 1.5 * crane.SWL:
        raise table.wrong(f'"{crane.name}" is made for 0 t to {show(crane.SWL, "mass")}. Check the load.', "load")
    if row.layer is not None and not 1 <= row.layer <= crane.drum.layers:
        raise table.wrong(f'"{crane.name}" has layers 1 to {crane.drum.layers}, counted from the bare drum.', "layer")
    L_full = drum_record(crane).L_full
    if row.s_w is not None and row.s_w > L_full:
        raise table.wrong(f'"{crane.name}" has 0 m to {show(L_full, "length")} of wire.', "s_w")
    D_m = row.D_m if row.D_mt is None else row.D_mt / count
    if D_m is not None and not 0.0 < D_m <= motor.D_max * 1.005:
        raise table.wrong(
            f"displacement of one motor {show(D_m, 'displacement')}: allowed is above 0 up to "
            f"{show(motor.D_max, 'displacement')}. D_m is that of one motor, D_mt that of all together."
        )
    if row.signals is not None:
        mapping = mapping_from(row.signals, f"{table.path.name}: {table.place()}")
    hook = hook_depth(row, table)
    if hook is not None and mapping is not None and "s_w" not in mapping:  # what is stated must give the wire out
        hook.wire_out() if row.s_w is None else hook.tip_height(row.s_w)
    return CraneTest(
        name=row.name or str(i + 1),
        log=table.relative_file(row.log, "log"),
        load=row.load,
        D_m=D_m,
        layer=row.layer,
        s_w=row.s_w,
        hold_out=row.hold_out,
        mapping=mapping,
        start=row.start,
        end=row.end,
        hook=hook,
        ahc=row.ahc,
    )
