"""Lift files: one TOML that names crane, vessel, sea, crane tip, payload, rigging, wire and phases of a lift."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from os.path import exists
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from stillhook import units as u
from stillhook.control.registry import DEFAULT_MODE
from stillhook.engine.arguments import with_usual_controller
from stillhook.engine.pack.programme import tension_kept
from stillhook.engine.simulate import End
from stillhook.errors import LiftError, ScenarioError, SeaError
from stillhook.formats.case_file import read_tip
from stillhook.formats.lift_forms import today
from stillhook.formats.results import load_run, lowerings_of, stored_sampling, stored_steps
from stillhook.formats.vessel.open import read_vessel
from stillhook.formats.waves.wavespectra import read_sea
from stillhook.library import load_crane
from stillhook.library.catalogue import read_compensator, read_payload, vessel_file, vessels
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import LIBRARY, FileKind, kind_of_toml, unknown_name
from stillhook.library.toml.tree import shelf, toml_text
from stillhook.sea.motion.motion import Motion, Still
from stillhook.sea.spectra.directions import parse_direction
from stillhook.sea.spectra.measured import SpectrumSeries
from stillhook.sea.spectra.spectrum import Sea, Train, check_spread
from stillhook.sea.spectra.text import parse_sea
from stillhook.sea.vessel.boom import DESCRIPTIONS, Boom
from stillhook.sea.vessel.rao import Rao, wavenumber
from stillhook.sea.vessel.realisation import Resolution, WaveField, moved_by, realise
from stillhook.sea.vessel.tip import TipPoint, parse_point
from stillhook.spec.crane import Crane
from stillhook.spec.lift.joining import OneRun, Water, joined, one_run
from stillhook.spec.lift.lowering import DeepWire, InSea, Lowering, Rigging, WinchSettings
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase, PhaseKind, WinchMode, moves
from stillhook.spec.scenario import RHO_SEA, FrictionModel, Mode, Sensors
from stillhook.tables.table import Flag, Number, Part, Spec, Text, with_place
from stillhook.units import parse, quote, show
from stillhook.winches.joints.interface import JointUnit
from stillhook.winches.joints.registry import unit_of

DEEPEST = 12_000.0  # m
LIGHTEST, HEAVIEST = 900.0, 1300.0  # kg/m^3: of fresh water that is warm, and of brine


class WaterTable(Spec):
    """The table [water]."""

    depth: u.Length = Field(gt=0, le=DEEPEST, description="depth of the water")
    rho: u.Density = Field(default=RHO_SEA, ge=LIGHTEST, le=HEAVIEST, description="density of the water")


class TipTable(Spec):
    """The table [tip]."""

    at: Text | None = Field(default=None, description="place from the vessel's reference point, as text")
    height: u.Length | None = Field(default=None, description="height of the crane tip above still water")
    motion: Any = Field(default=None, description="motion in place of vessel and sea")


class BoomTable(Spec):
    """The table [boom]."""

    pedestal: tuple[Any, ...] = Field(description="heel pin forward, to port, and above still water")
    slew: Any = Field(description="direction of the boom, counter-clockwise from the bow")
    main: tuple[Any, ...] = Field(description="length and angle of the main boom")
    knuckle: tuple[Any, ...] | None = Field(default=None, description="length and angle of the knuckle boom")
    offset: Any = Field(default="0 m", description="heel pin ahead of the axis of slewing")

    @field_validator("pedestal", "main", "knuckle", mode="before")
    @classmethod
    def _list(cls, value: Any, info: ValidationInfo) -> Any:
        if not isinstance(value, list):
            raise ValueError(DESCRIPTIONS[str(info.field_name)])
        return value

    @property
    def boom(self) -> Boom:
        """The crane of this table. Errors: SeaError, UnitError."""
        return Boom(pedestal=self.pedestal, slew=self.slew, main=self.main, knuckle=self.knuckle, offset=self.offset)


class SeaTable(Spec):
    """The table [sea]."""

    wave: Text = Field(description="waves as text, or a file of spectra next to this file")
    record: Any = Field(default=None, description="number from 0, or time, of a record of that file")
    heading: Any = Field(default=None, description="direction in which the waves travel, from the bow")
    spread: Number | None = Field(
        default=None, description="exponent n of cos^n, such as 4; left out for long-crested waves"
    )
    seed: Annotated[int, Field(strict=True)] = Field(default=1, ge=0, description="seed of the waves")
    amplitudes: Text = Field(default="fixed", description="how amplitudes are drawn")
    repeat: u.Time | None = Field(
        default=None, gt=0, description="time after which the waves repeat; default the length of the run"
    )
    water: Flag = Field(default=True, description="whether the waves reach the payload")
    left: Number = Field(default=1.0, gt=0, le=1, description="part of the tip's motion that reaches the wire")
    resolution: Resolution = Field(
        default=Resolution.FINE, description="how closely the tip's motion follows its waves"
    )


Tables = TypeVar("Tables", bound="LiftTables")


class LiftTables(Spec):
    """A lift file. What a plan alone reads is kept as it is written."""

    name: Text | None = Field(default=None, description="name; default that of the file")
    crane: Text = Field(description="library name or crane file")
    vessel: Text | None = Field(default=None, description="library name or vessel file")
    payload: Any = Field(description="library name, payload file or a table [payload]")
    tip: TipTable = Field(default_factory=TipTable)
    boom: BoomTable | None = None
    water: WaterTable = Field(description="table [water] with depth")
    rigging: Part[Rigging] = Field(default_factory=Rigging)
    compensator: Any = Field(default=None, description="library name, compensator file or a table [compensator]")
    wire: Part[DeepWire] = Field(default_factory=DeepWire)
    winch: Part[WinchSettings] = Field(default_factory=WinchSettings)
    sensors: Part[Sensors] = Field(default_factory=Sensors)
    controller: Mode = DEFAULT_MODE
    start_depth: u.Length | None = Field(
        default=None, description="depth of the payload's underside as the lift begins; negative above the water"
    )
    duration: u.Time | None = Field(default=None, gt=0, description="length of the run")
    ramp: u.Time = Field(default=10.0, ge=0, description="time in which the motion grows to full size")
    friction: FrictionModel = FrictionModel.LUGRE
    step: Text | None = Field(default=None, description="time step of the run, as text")
    every: Text | None = Field(default=None, description="time between stored values, as text")
    sampling: Text | None = Field(default=None, description="time between values that statistics take, as text")
    end: End = Field(default=End.DURATION, description="whether the run ends with its programme")
    sea: SeaTable | None = None
    rules: Any = None
    alternatives: Any = None
    environment: Any = None
    operation: Any = None
    weather: Any = None
    load_chart: Any = None
    synthetic_certificate: Any = None
    phase: tuple[Part[Phase], ...] = Field(
        min_length=1, description="one [[phase]] table for each, with kind or mode, and what ends it"
    )


def read_lift(table: TomlTable, model: type[Tables]) -> tuple[TomlTable, Tables]:
    """A lift file in the words of today, and as a model. Errors: StillhookError, one line."""
    table = today(table)
    file = table.read(model)
    for i, phase in enumerate(file.phase):
        if phase.start_depth is not None:
            raise table.wrong(
                "each phase starts where the one before it ends, and the lift at the start_depth of the file. Leave it"
                " out.",
                "phase",
                i,
                "start_depth",
            )
    return table, file


def payload_of(file: LiftTables, table: TomlTable) -> Payload:
    """A payload of the library, a file seen from this one, or a table with name, mass and shape."""
    if isinstance(file.payload, Mapping):
        return Payload(**file.payload)
    if not isinstance(file.payload, str) or not file.payload.strip():
        raise table.wrong("give a name of the library, the path of a file, or a table [payload].", "payload")
    return read_payload(table.relative_toml(file.payload))


def compensator_of(file: LiftTables, table: TomlTable) -> JointUnit | None:
    """A passive heave compensator of the library, a file seen from this one, or a table [compensator], whose `unit`
    names one of these for what the table leaves out."""
    given = file.compensator
    if given is None:
        return None
    if isinstance(given, str) and given.strip():
        given = {"unit": given}
    if not isinstance(given, Mapping):
        raise table.wrong("give a name of the library, the path of a file, or a table [compensator].", "compensator")
    own = {key: value for key, value in given.items() if key != "unit"}
    name = given.get("unit")
    if name is not None and (not isinstance(name, str) or not name.strip()):
        raise table.wrong("give a name of the library, or the path of a file.", "compensator", "unit")
    try:
        return unit_of(own) if name is None else read_compensator(table.relative_toml(name), own)
    except ScenarioError as problem:  # of this table; a file that is wrong names itself
        raise LiftError(with_place(str(problem), "compensator")) from None


SHORTEST_SEA = 60.0
"""Time below which a piece of a random sea holds too few waves to be one [s]."""
DEEP = 3.0
"""Wave number times depth from which water is deep to a wave: tanh is then within half a per cent of 1."""


class Place(NamedTuple):
    """Motion of the crane tip, the water below it, height of the tip above still water [m]; in words; what they follow
    from (None: not there); notes: what a reader should know."""

    tip: Motion
    waves: WaveField | None
    h_tip: float
    words: str
    vessel: Rao | None = None
    at: TipPoint | None = None
    sea: Sea | None = None
    notes: tuple[str, ...] = ()


def place_of(file: LiftTables, table: TomlTable, length: float, seed: int | None) -> Place:
    """Crane tip, vessel and sea of a run of `length` [s]; seed: before that of the file."""
    where, height = _point(file)
    if seed is not None and file.sea is None:
        raise LiftError("--seed: belongs to waves, and the file has no [sea]. Leave it out.")
    if file.tip.motion is not None:
        for key, stated in (("vessel", file.vessel), ("sea", file.sea)):
            if stated is not None:
                raise LiftError(
                    f"{key}: given together with tip.motion, which replaces vessel and sea. Leave one of them out."
                )
        motion = read_tip(file.tip.motion, table.path.parent)
        return Place(motion, None, height, f"tip: {motion.describe()}; still water")
    if file.sea is None:
        if file.vessel is not None:
            raise LiftError(
                f"sea: missing, and a vessel is given. Write [sea] with {sea_example(file)}, or leave vessel out for a"
                " calm."
            )
        return Place(Still(), None, height, "tip still; still water")
    if file.vessel is None:
        raise table.missing("vessel")
    if where is None:
        raise LiftError(
            'tip: its place is missing. Write [tip] with at = "x=-20 m, y=-18 m, z=30 m", or a table [boom].'
        )
    sea, rao = _sea(file.sea, table.at("sea")), _vessel(file.vessel, table)
    if sea.moment(0) <= 0.0:
        raise table.wrong("no waves. Leave [sea] and vessel out for a calm.", "sea", "wave")
    if length < SHORTEST_SEA:
        raise LiftError(f"duration = {show(length, 'time')}: too short for waves at random. Give a minute or more.")
    if seed is not None and (isinstance(seed, bool) or not isinstance(seed, int) or seed < 0):
        raise LiftError(f"--seed {quote(seed)}: give a whole number of 0 or more.")
    depth, seed = file.water.depth, file.sea.seed if seed is None else seed
    repeat = length if file.sea.repeat is None else file.sea.repeat
    if repeat < length:
        run = show(length, "time")
        raise table.wrong(f"the run takes {run}, and the waves must last as long. Give {run} or more.", "sea", "repeat")
    waves = realise(sea, repeat, seed, amplitudes=file.sea.amplitudes, depth=depth)
    part = "" if file.sea.left == 1.0 else f" ({file.sea.left:.4g} of its motion)"
    words = f"{rao.name}, tip at {where.describe()}{part}, in {sea.describe()}, seed {seed}"
    own = {name: getattr(file.sea, name) for name in ("water", "left", "resolution")}
    motion, water = moved_by(waves, rao, where.x, where.y, **own)
    notes = depth_notes(rao, max(train.spectrum.peak_period for train in sea.trains), depth)
    return Place(tip=motion, waves=water, h_tip=height, words=words, vessel=rao, at=where, sea=sea, notes=notes)


def sea_example(file: LiftTables) -> str:
    """How a [sea] is written, with a cell of the file's [environment] where there is one."""
    seas = file.environment if isinstance(file.environment, Mapping) else {}
    Hs, Tp, heading = (_first(seas.get(key), usual) for key, usual in USUAL_SEA.items())
    wave = seas.get("wave", "jonswap")
    return f'wave = "{wave} Hs={Hs} Tp={Tp}" and heading = "{heading}"'


USUAL_SEA = {"Hs": "2 m", "Tp": "9 s", "headings": "150 deg"}


def _first(values: Any, usual: str) -> str:
    """The first value of a range or a list."""
    first = values[0] if isinstance(values, list) and values else values
    return " ".join(first.partition(" to ")[0].split()) if isinstance(first, str) and first.strip() else usual


def depth_notes(rao: Rao, longest: float, depth: float) -> tuple[str, ...]:
    """What to know of motions of a vessel that hold in deep water, over water [m] that is not deep to the longest waves
    [s]."""
    kd = float(wavenumber(np.array([2.0 * math.pi / longest]), depth)[0]) * depth
    if kd >= DEEP or math.isclose(rao.depth, depth, rel_tol=0.2):
        return ()
    of = "deep water" if math.isinf(rao.depth) else f"water of {show(rao.depth, 'length')}"
    return (
        (
            f"the motions of {rao.name} are for {of}; {show(depth, 'length')} are shallow to waves of {longest:.3g} s "
            f"(wave number times depth {kd:.2g}), and the tip moves otherwise"
        ),
    )


def still_place(file: LiftTables, table: TomlTable) -> Place:
    """Vessel, tip and sea without motion."""
    where, height = _point(file)
    rao = None if file.vessel is None else _vessel(file.vessel, table)
    words = "" if rao is None or where is None else f"{rao.name}, tip at {where.describe()}"
    sea = None if file.sea is None else _sea(file.sea, table.at("sea"))
    return Place(tip=Still(), waves=None, h_tip=height, words=words, vessel=rao, at=where, sea=sea)


def _point(file: LiftTables) -> tuple[TipPoint | None, float]:
    """Place of the crane tip from the vessel's reference point, and its height above still water [m]."""
    at, height = file.tip.at, file.tip.height
    if file.boom is not None and (at is not None or height is not None):
        raise LiftError("tip: its place is given together with [boom]. Leave one of them out.")
    if file.boom is not None:
        point: TipPoint | None = TipPoint(*file.boom.boom.tip)
    else:
        point = None if at is None else parse_point(at, "tip.at")
    if height is not None and point is not None and point.z is not None:
        raise LiftError("tip.height: given together with z in tip.at. Leave one of them out.")
    height = height if height is not None else point.z if point is not None else None
    if height is None:
        raise LiftError('tip: its height above the water is missing. Give z in tip.at, or height = "30 m".')
    if height <= 0.0:
        raise LiftError(
            f"tip: its height {show(height, 'length')} is not above the water. Count it up from still water."
        )
    return point, height


def _sea(sea: SeaTable, table: TomlTable) -> Sea:
    """Waves of a text, or one record of a file next to the lift file."""
    beta = None if sea.heading is None else parse_direction(sea.heading, "sea.heading")
    if "=" not in sea.wave and "." in sea.wave:
        return _measured_sea(sea, table, beta)
    if sea.record is not None:
        raise table.wrong("belongs to a file of measured waves, and sea.wave is a text. Leave it out.", "record")
    return parse_sea(sea.wave, heading=sea.heading, spread=sea.spread, where="sea.wave")


def _measured_sea(sea: SeaTable, table: TomlTable, heading: float | None) -> Sea:
    path = table.path.parent / sea.wave
    if not path.is_file():
        raise table.wrong("no such file next to the lift file. Check the path, or write waves as a text.", "wave")
    if heading is None:
        raise LiftError(
            'sea.heading: missing. Give the direction in which the waves travel, from the bow, such as "180 deg".'
        )
    series = read_sea(path)
    if not isinstance(series, SpectrumSeries):
        raise table.wrong("holds heights and periods, no spectra. Give a file of spectra, or waves as a text.", "wave")
    if sea.record is None:
        raise LiftError(
            f"sea.record: missing, and {path.name} holds {len(series)}. Give its number from 0, or its time,"
            ' "1996-01-05T12:00".'
        )
    exponent = None if sea.spread is None else check_spread(sea.spread, "sea.spread")
    return Sea((Train(series.spectrum(series.index(str(sea.record))), heading, exponent),))


def _vessel(name: str, table: TomlTable) -> Rao:
    """A vessel of the library, or the file of this path, seen from the lift file."""
    if name in vessels():
        return read_vessel(vessel_file(name))
    path = table.path.parent / name
    if not exists(path):
        raise SeaError(
            f"vessel = {quote(name)}: neither a file next to the lift file nor one of {', '.join(vessels())}."
        )
    return read_vessel(path)


ROOM = 60.0
"""Time that a run is given beyond its programme as planned [s]: entry conditions, ramps, and a while to see the end."""
LATE = 1.1
"""Factor on the planned time for the same reason."""


class LiftFile(NamedTuple):
    """A crane and a lowering, how finely it is run and stored (None: default), and where it happens, in words; vessel,
    place of the crane tip and sea as the file gives them (None: not there); notes on what a reader should know;
    sampling of its statistics (None: default), and where the run ends."""

    crane: Crane
    lift: Lowering
    step: str | None
    every: str | None
    place: str
    vessel: Rao | None = None
    at: TipPoint | None = None
    sea: Sea | None = None
    notes: tuple[str, ...] = ()
    sampling: str | None = None
    end: End = End.DURATION


def stored_lift(path: str | Path) -> LiftFile:
    """The lowering that a stored run holds, to be run again with the same steps. Errors: StillhookError where the file
    holds none, or several."""
    run = load_run(path)
    if "scenarios" in run.attrs:
        raise LiftError(f"{path}: holds scenarios, no lowerings. Run them again: stillhook run {path}.")
    cranes, cases = lowerings_of(run)
    if len(cases) > 1:
        raise LiftError(f"{path}: holds {len(cases)} lowerings. Run them again in Python: rerun(load_run(path)).")
    case = cases[0].lowering() if isinstance(cases[0], InSea) else cases[0]
    step, every = stored_steps(run)
    sampling, end = stored_sampling(run, cranes[0])
    return LiftFile(cranes[0], case, step, every, f"again from {Path(path).name}", sampling=sampling, end=end)


def load_lift(
    path: str | Path, *, seed: int | None = None, duration: str | None = None, moving: bool = True
) -> LiftFile:
    """Read a lift file::

        crane = "deep-250t"                  # or the path of a crane file, seen from this file
        vessel = "construction-vessel-130m"  # or the path of a vessel file
        payload = "suction-anchor-85t"       # or the path of a payload file, or a table [payload]
        start_depth = "-5 m"                 # underside of the payload below still water; negative above

        [sea]
        wave = "jonswap Hs=2 m Tp=9 s"
        heading = "150 deg"
        seed = 1

        [tip]
        at = "x=-25 m, y=-22 m, z=30 m"      # or a table [boom]; or motion = "sine 1 m 9 s" in place of vessel and sea

        [water]
        depth = "3000 m"

        [[phase]]
        mode = "splash"
        speed = "12 m/min"
        depth = "25 m"

    Phases with kinds are those of a plan (`stillhook.load_plan`): of them those are run that one run can follow. A
    library name ("anchor-to-3000m") may stand in place of a path. seed and duration go before those of the file.
    Unless `moving` vessel and sea are read and nothing is made to move: for what looks at spectra; the sea may then be
    missing.
    Errors: StillhookError, one line that names file, field, what came and what is allowed.

    >>> import stillhook
    >>> file = stillhook.load_lift("anchor-to-3000m")
    >>> file.crane.name, file.lift.depth
    ('deep-250t', 3000.0)
    """
    if str(path) in lifts():
        path = LIBRARY / "lifts" / f"{path}.toml"
    if "." not in str(path) and not Path(path).exists():
        raise LiftError(unknown_name("lift", str(path), lifts(), FileKind.LIFT))
    if not toml_text(Path(path)).strip():
        have = ", ".join(lifts())
        raise LiftError(
            f"{Path(path).name}: empty. A lift file names crane, payload, start_depth, [water] and phases; copy one of"
            f" {have}."
        )
    return read_toml(path, FileKind.LIFT, LiftError, lambda table: _lift(table, seed, duration, moving))


def payload_in(path: str | Path) -> tuple[Payload, float]:
    """The payload that a lift file names, and the density of its water [kg/m^3]. Errors: StillhookError, one line."""

    def read(table: TomlTable) -> tuple[Payload, float]:
        table, file = read_lift(table, LiftTables)
        return payload_of(file, table), file.water.rho

    path = LIBRARY / "lifts" / f"{path}.toml" if str(path) in lifts() else path
    return read_toml(path, FileKind.LIFT, LiftError, read)


def is_lift(name: str) -> bool:
    """Whether a name is that of a lift of the library, or of a lift file."""
    return name in lifts() or (
        name.endswith(".toml") and Path(name).is_file() and kind_of_toml(toml_text(Path(name))) is FileKind.LIFT
    )


def lifts() -> tuple[str, ...]:
    """Names of the library's example lifts."""
    return shelf("lifts")


def _lift(table: TomlTable, seed: int | None, duration: str | None, moving: bool) -> LiftFile:
    table, file = read_lift(table, LiftTables)
    crane, payload = load_crane(table.relative_toml(file.crane)), payload_of(file, table)
    run = _run(file, crane, payload)
    length = file.duration if duration is None else parse(duration, "time", "--duration")
    length = planned(run.programme, run.start_depth, file.water.depth) if length is None else length
    place = place_of(file, table, length, seed) if moving else still_place(file, table)
    chosen = {"controller": file.controller} if "controller" in file.model_fields_set else {}
    lift = Lowering(
        name=file.name or table.path.stem,
        payload=payload,
        rigging=file.rigging,
        compensator=compensator_of(file, table),
        wire=file.wire,
        tip=place.tip,
        waves=place.waves,
        h_tip=f"{place.h_tip!r} m",
        depth=f"{file.water.depth!r} m",
        start_depth=f"{run.start_depth!r} m",
        programme=run.programme,
        winch=file.winch,
        duration=f"{length!r} s",
        ramp=f"{file.ramp!r} s",
        rho=f"{file.water.rho!r} kg/m^3",
        sensors=file.sensors,
        friction=file.friction,
        **chosen,
    )
    lift = with_usual_controller(crane, lift)
    return LiftFile(
        crane=crane,
        lift=lift,
        step=file.step,
        every=file.every,
        place=place.words,
        vessel=place.vessel,
        at=place.at,
        sea=place.sea,
        notes=(*place.notes, *run.notes),
        sampling=file.sampling,
        end=file.end,
    )


def _run(file: LiftTables, crane: Crane, payload: Payload) -> OneRun:
    """What is run: the phases as they are, or those of a plan that one run can follow."""
    if all(phase.kind is None for phase in file.phase):
        if file.start_depth is None:
            raise LiftError(
                "start_depth: missing, the depth of the payload's underside as the lift begins (negative above the"
                ' water). Give it, such as "-5 m".'
            )
        return OneRun(file.start_depth, file.phase, ())
    rho, bottom = file.water.rho, file.water.depth
    phases = joined(file.phase, file.start_depth, Water(bottom, payload.reach(rho)))
    at = _point(file)[0]

    def elsewhere(phase: Phase) -> bool:
        if phase.tip is None:
            return False
        other = parse_point(phase.tip, "tip")
        return at is None or (other.x, other.y) != (at.x, at.y) or other.z not in (None, at.z)

    return one_run(phases, elsewhere, lambda: tension_kept(crane, payload, rho), bottom)


def planned(programme: Sequence[Phase], start_depth: float, bottom: float) -> float:
    """Length of a run that leaves room for a programme that goes as planned [s]: each phase's way over its speed, or
    its time.

    Errors: LiftError where a phase ends by wire or tension, whose time only the run can determine: the file then gives
    duration.
    """
    total = 0.0
    for i, (phase, move) in enumerate(zip(programme, moves(programme, start_depth, bottom), strict=True), 1):
        if phase.time is not None:
            lands = phase.kind is PhaseKind.LANDING and phase.mode is WinchMode.LANDING
            total += phase.time + ((bottom - move.start) / move.v if lands else 0.0)
            continue
        if math.isnan(move.end):
            raise LiftError(
                f"duration: missing, and only the run can determine when phase {i} ends by {phase.ends[0]}. Give"
                ' duration = "600 s".'
            )
        total += abs(move.start - move.end) / max(abs(move.v), 1e-9)
    return round(LATE * total + ROOM, 1)


def describe_phase(phase: Phase, v: float) -> str:
    """A phase of a programme in words and units; v its wire speed, lowering positive [m/s]."""
    speed = "" if v == 0.0 else f" {'lowering' if v > 0 else 'hoisting'} {show(abs(v), 'speed')}"
    hold = "" if phase.tension is None else f" holding {show(phase.tension, 'force')}"
    kinds = {"time": "time", "depth": "length", "wire": "length", "end_tension": "force"}
    end = phase.ends[0]
    value = "" if phase.landed else f" {show(getattr(phase, end), kinds[end])}"
    return f"{phase.mode}{speed}{hold}, until {end.removeprefix('end_')}{value}"
