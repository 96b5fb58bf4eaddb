"""Lift files: one TOML that names crane, vessel, sea, crane tip, payload, rigging, wire and winch programme of a lowering."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, NamedTuple

from stillhook.crane import Crane
from stillhook.errors import LiftError, SeaError
from stillhook.io.case_file import read_tip
from stillhook.io.fields import Fields, described
from stillhook.io.vessel_file import read_vessel
from stillhook.library import load_crane
from stillhook.library.files import nearest
from stillhook.library.payloads import read_payload
from stillhook.library.vessels import vessel_file, vessels
from stillhook.lift.lowering import DeepWire, Lowering, Rigging
from stillhook.lift.payload import Payload
from stillhook.lift.programme import Stage, WinchSettings
from stillhook.scenario import Sensors
from stillhook.sea.boom import Boom
from stillhook.sea.kinematics import WaveField
from stillhook.sea.motion import Motion, Still
from stillhook.sea.rao import Rao
from stillhook.sea.realisation import realise, tip_motion
from stillhook.sea.sea_text import parse_sea
from stillhook.sea.spectrum import Sea
from stillhook.sea.tip import TipPoint, parse_point
from stillhook.sea.wave_field import wave_field
from stillhook.units import came, parse, show

TOP = (
    "name", "crane", "vessel", "controller", "start", "duration", "ramp", "friction", "step", "every",
    "sea", "tip", "boom", "water", "payload", "rigging", "wire", "winch", "sensors", "stage",
)  # fmt: skip
SEA = ("wave", "heading", "spread", "seed", "amplitudes")
TIP = ("at", "height", "motion")
BOOM = ("pedestal", "slew", "main", "knuckle", "offset")
WATER = ("depth", "rho")
ROOM = 60.0
"""Time that a run is given beyond its programme as planned [s]: entry conditions, ramps, and a while to see the end."""
LATE = 1.1
"""Factor on the planned time for the same reason."""


class LiftFile(NamedTuple):
    """A crane and a lowering, how finely it is run and stored (None: default), and where it happens, in words; vessel, place of the crane
    tip and sea as the file gives them (None: not there)."""

    crane: Crane
    lift: Lowering
    step: str | None
    every: str | None
    place: str
    vessel: Rao | None = None
    at: TipPoint | None = None
    sea: Sea | None = None


class Place(NamedTuple):
    """Motion of the crane tip, the water below it, height of the tip above still water [m]; in words; what they follow from."""

    tip: Motion
    waves: WaveField | None
    h_tip: float
    words: str
    vessel: Rao | None = None
    at: TipPoint | None = None
    sea: Sea | None = None


def load_lift(path: str | Path, *, seed: int | None = None, duration: str | None = None, moving: bool = True) -> LiftFile:
    """Read a lift file::

        crane = "deep-250t"                  # or the path of a crane file, seen from this file
        vessel = "construction-vessel-130m"  # or the path of a vessel file
        payload = "suction-anchor-85t"       # or the path of a payload file, or a table [payload] with name, mass, shape
        start = "5 m"                        # underside of the payload above still water; negative below

        [sea]
        wave = "jonswap Hs=2 m Tp=9 s"
        heading = "150 deg"
        seed = 1

        [tip]
        at = "x=-25 m, y=-22 m, z=30 m"      # or a table [boom]; or motion = "sine 1 m 9 s" in place of vessel and sea

        [water]
        depth = "3000 m"

        [[stage]]
        mode = "splash"
        lower = "12 m/min"
        depth = "25 m"

    A library name ("anchor-to-3000m") may stand in place of a path. seed and duration go before those of the file. Unless `moving` vessel
    and sea are read and nothing is made to move: for what looks at spectra; the sea may then be missing.
    Errors: StillhookError, one line that names file, field, what came and what is allowed.
    """
    if str(path) in lifts():
        with as_file(files("stillhook.library") / "lifts" / f"{path}.toml") as file:
            return described(file, lambda table, at: _lift(table, at, seed, duration, moving))
    if "." not in str(path) and not Path(path).exists():
        have = f"{', '.join(lifts())}{nearest(str(path), lifts())}"
        raise LiftError(f"No lift {came(str(path))}: the library has {have} A file's name ends in .toml.")
    return described(path, lambda table, at: _lift(table, at, seed, duration, moving))


def lifts() -> tuple[str, ...]:
    """Names of the library's example lifts."""
    shelf = files("stillhook.library") / "lifts"
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in shelf.iterdir() if entry.name.endswith(".toml")))


def _lift(table: Mapping[str, Any], file: Path, seed: int | None, duration: str | None, moving: bool) -> LiftFile:
    top = Fields(table, "", LiftError)
    top.known(TOP)
    top.need("crane", "payload", "water", "start", "stage")
    crane = load_crane(top.beside("crane", file.parent))
    water = Fields(table["water"], "water.", LiftError)
    water.known(WATER)
    depth = water.quantity("depth", "length")
    if depth is None:
        raise LiftError('water.depth: missing. Give the depth of the water, such as "300 m".')
    programme = _programme(table["stage"])
    z_0 = top.quantity("start", "length")
    assert z_0 is not None
    length = top.quantity("duration", "time") if duration is None else parse(duration, "time", "--duration")
    length = planned(programme, z_0, depth) if length is None else length
    place = _place(top, file.parent, depth, length, seed) if moving else _still(top, file.parent)
    given: dict[str, Any] = {
        "name": top.text("name", file.stem),
        "payload": _payload(top, file.parent),
        "tip": place.tip,
        "waves": place.waves,
        "h_tip": f"{place.h_tip!r} m",
        "depth": table["water"]["depth"],
        "z_0": table["start"],
        "programme": programme,
        "duration": f"{length!r} s",
    }
    for key, kind in (("rigging", Rigging), ("wire", DeepWire), ("winch", WinchSettings), ("sensors", Sensors)):
        if key in table:
            given[key] = kind(**_table(table, key))
    given |= {key: table[key] for key in ("controller", "ramp", "friction") if key in table}
    if "rho" in water:
        given["rho"] = table["water"]["rho"]
    steps = (_steps(top, key) for key in ("step", "every"))
    return LiftFile(crane, Lowering(**given), *steps, place.words, place.vessel, place.at, place.sea)


def _table(table: Mapping[str, Any], key: str) -> dict[str, Any]:
    if not isinstance(table[key], Mapping):
        raise LiftError(f"{key} = {came(table[key])}: is no table. Write [{key}] with its fields below.")
    return dict(table[key])


def _steps(top: Fields, key: str) -> str | None:
    return top.text(key) if key in top else None


def _programme(rows: Any) -> tuple[Stage, ...]:
    if not isinstance(rows, list) or not rows or not all(isinstance(row, Mapping) for row in rows):
        raise LiftError("stage: no stages. Write each as a table [[stage]] with mode, lower and what ends it.")
    return tuple(Stage(**row) for row in rows)


def _payload(top: Fields, folder: Path) -> Payload:
    """A payload of the library, a file seen from the lift file, or a table with name, mass and shape."""
    if isinstance(top.table["payload"], Mapping):
        return Payload(**top.table["payload"])
    return read_payload(top.beside("payload", folder))


def _place(top: Fields, folder: Path, depth: float, length: float, seed: int | None) -> Place:
    """Where the load hangs, and what moves there."""
    where, height = _point(top)
    tip = Fields(top.table.get("tip", {}), "tip.", LiftError)
    if seed is not None and "sea" not in top:
        raise LiftError("--seed: belongs to waves, and the file has no [sea]. Leave it out.")
    if "motion" in tip:
        for key in ("vessel", "sea"):
            if key in top:
                raise LiftError(f"{key}: given beside tip.motion, which stands in place of vessel and sea. Leave one of them out.")
        motion = read_tip(tip.table["motion"], folder)
        return Place(motion, None, height, f"tip: {motion.describe()}; still water")
    if "sea" not in top:
        if "vessel" in top:
            raise LiftError("sea: missing, and a vessel is given. Write [sea] with wave and heading, or leave vessel out for a calm.")
        return Place(Still(), None, height, "tip still; still water")
    top.need("vessel")
    if where is None:
        raise LiftError('tip: its place is missing. Write [tip] with at = "x=-20 m, y=-18 m, z=30 m", or a table [boom].')
    table = _table_of_sea(top)
    sea, rao = _sea(table), _vessel(top, folder)
    waves = realise(sea, length, _seed(table, seed), amplitudes=table.text("amplitudes", "fixed"), depth=depth)
    words = f"{rao.name}, tip at {where.describe()}, in {sea.describe()}, seed {_seed(table, seed)}"
    return Place(tip_motion(waves, rao, where.x, where.y), wave_field(waves, where.x, where.y), height, words, rao, where, sea)


def _still(top: Fields, folder: Path) -> Place:
    """Vessel, tip and sea without motion."""
    where, height = _point(top)
    rao = _vessel(top, folder) if "vessel" in top else None
    words = "" if rao is None or where is None else f"{rao.name}, tip at {where.describe()}"
    return Place(Still(), None, height, words, rao, where, _sea(_table_of_sea(top)) if "sea" in top else None)


def _table_of_sea(top: Fields) -> Fields:
    table = Fields(top.table["sea"], "sea.", LiftError)
    table.known(SEA)
    return table


def _point(top: Fields) -> tuple[TipPoint | None, float]:
    """Place of the crane tip from the vessel's reference point, and its height above still water [m]."""
    tip = Fields(top.table.get("tip", {}), "tip.", LiftError)
    tip.known(TIP)
    height = tip.quantity("height", "length")
    if "boom" in top:
        if "at" in tip or height is not None:
            raise LiftError("tip: its place is given beside [boom]. Leave one of them out.")
        boom = Fields(top.table["boom"], "boom.", LiftError)
        boom.known(BOOM)
        boom.need("pedestal", "slew", "main")
        texts: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in boom.table.items()}
        x, y, z = Boom(**texts).tip
        return TipPoint(x, y, z), z
    point = parse_point(tip.text("at"), "tip.at") if "at" in tip else None
    if height is not None and point is not None and point.z is not None:
        raise LiftError("tip.height: given beside z in tip.at. Leave one of them out.")
    height = height if height is not None else point.z if point is not None else None
    if height is None:
        raise LiftError('tip: its height above the water is missing. Give z in tip.at, or height = "30 m".')
    return point, height


def _sea(table: Fields) -> Sea:
    heading = table.quantity("heading", "angle")
    spread = table.table.get("spread")
    if spread is not None and (isinstance(spread, bool) or not isinstance(spread, int | float)):
        raise table.wrong("spread", "give the exponent n of cos^n, such as 4, or leave it out for long-crested waves.")
    return parse_sea(table.text("wave"), heading=heading, spread=spread, where="sea.wave")


def _seed(table: Fields, seed: int | None) -> int:
    value = table.table.get("seed", 1) if seed is None else seed
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise LiftError(f"sea.seed = {came(value)}: give a whole number of 0 or more.")
    return value


def _vessel(top: Fields, folder: Path) -> Rao:
    """A vessel of the library, or the file of this path, seen from the lift file."""
    name = top.text("vessel")
    if name in vessels():
        return read_vessel(vessel_file(name))
    if not (folder / name).exists():
        raise SeaError(f"vessel = {came(name)}: neither a file beside the lift file nor one of {', '.join(vessels())}.")
    return read_vessel(folder / name)


def planned(programme: Sequence[Stage], z_0: float, depth: float) -> float:
    """Length of a run that leaves room for a programme that goes as planned [s]: each stage's way over its speed, or its time.

    Errors: LiftError where a stage ends by wire or tension, whose time only the run can tell: the file then gives duration.
    """
    total, z = 0.0, z_0
    for i, stage in enumerate(programme, 1):
        if stage.time is not None:
            total, z = total + stage.time, z - stage.lower * stage.time
            continue
        goal = -depth if stage.landed else -stage.depth if stage.depth is not None else None
        if goal is None:
            raise LiftError(f'duration: missing, and only the run can tell when stage {i} ends by {stage.end}. Give duration = "600 s".')
        total, z = total + abs(z - goal) / max(abs(stage.lower), 1e-9), goal
    return round(LATE * total + ROOM, 1)


def describe_stage(stage: Stage) -> str:
    """A stage in words and units."""
    speed = "" if stage.lower == 0.0 else f" {'lowering' if stage.lower > 0 else 'hoisting'} {show(abs(stage.lower), 'speed')}"
    hold = "" if stage.hold is None else f" holding {show(stage.hold, 'force')}"
    kinds = {"time": "time", "depth": "length", "wire": "length", "tension": "force"}
    value = "" if stage.landed else f" {show(getattr(stage, stage.end), kinds[stage.end])}"
    return f"{stage.mode}{speed}{hold}, until {stage.end}{value}"
