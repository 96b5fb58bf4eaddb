"""Lift files: one TOML that names crane, vessel, sea, crane tip, payload, rigging, wire and winch programme of a
lowering."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, NamedTuple

from stillhook.base.nearest import nearest
from stillhook.errors import LiftError, ScenarioError
from stillhook.formats.lift.place import place_of, still_place
from stillhook.formats.toml_fields import Fields, described
from stillhook.library import load_crane
from stillhook.library.payloads import read_payload
from stillhook.library.toml.kinds import FileKind, other_kind
from stillhook.library.toml.tree import toml_text
from stillhook.sea.spectra.spectrum import Sea
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.tip import TipPoint
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import DeepWire, Lowering, Rigging
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.programme import Stage, WinchSettings
from stillhook.spec.scenario import RHO_SEA, Record, Sensors
from stillhook.units import parse, quote, show

TOP = (
    "name",
    "crane",
    "vessel",
    "controller",
    "start",
    "duration",
    "ramp",
    "friction",
    "step",
    "every",
    "sea",
    "tip",
    "boom",
    "water",
    "payload",
    "rigging",
    "wire",
    "winch",
    "sensors",
    "stage",
)
WATER = ("depth", "rho")
DEEPEST = 12_000.0  # m
LIGHTEST, HEAVIEST = 900.0, 1300.0  # kg/m^3: of fresh water that is warm, and of brine
ROOM = 60.0
"""Time that a run is given beyond its programme as planned [s]: entry conditions, ramps, and a while to see the end."""
LATE = 1.1
"""Factor on the planned time for the same reason."""


class LiftFile(NamedTuple):
    """A crane and a lowering, how finely it is run and stored (None: default), and where it happens, in words; vessel,
    place of the crane tip and sea as the file gives them (None: not there); notes on what it asks for."""

    crane: Crane
    lift: Lowering
    step: str | None
    every: str | None
    place: str
    vessel: Rao | None = None
    at: TipPoint | None = None
    sea: Sea | None = None
    notes: tuple[str, ...] = ()


def load_lift(
    path: str | Path, *, seed: int | None = None, duration: str | None = None, moving: bool = True
) -> LiftFile:
    """Read a lift file::

        crane = "deep-250t"                  # or the path of a crane file, seen from this file
        vessel = "construction-vessel-130m"  # or the path of a vessel file
        payload = "suction-anchor-85t"       # or the path of a payload file, or a table [payload] with name, mass,
        shape start = "5 m"                        # underside of the payload above still water; negative below

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

    A library name ("anchor-to-3000m") may stand in place of a path. seed and duration go before those of the file.
    Unless `moving` vessel and sea are read and nothing is made to move: for what looks at spectra; the sea may then be
    missing.
    Errors: StillhookError, one line that names file, field, what came and what is allowed.
    """
    if str(path) in lifts():
        with as_file(files("stillhook.library") / "data" / "lifts" / f"{path}.toml") as file:
            return described(file, FileKind.LIFT, lambda table, at: _lift(table, at, seed, duration, moving))
    if "." not in str(path) and not Path(path).exists():
        have = f"{', '.join(lifts())}{nearest(str(path), lifts())}"
        other = other_kind(str(path), FileKind.LIFT)
        raise LiftError(f"No lift {quote(str(path))}: the library has {have} A file's name ends in .toml.{other}")
    if not toml_text(Path(path)).strip():
        have = ", ".join(lifts())
        raise LiftError(
            f"{Path(path).name}: empty. A lift file names crane, payload, start, [water] and stages; copy one of"
            f" {have}."
        )
    return described(path, FileKind.LIFT, lambda table, at: _lift(table, at, seed, duration, moving))


def lifts() -> tuple[str, ...]:
    """Names of the library's example lifts."""
    shelf = files("stillhook.library") / "data" / "lifts"
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in shelf.iterdir() if entry.name.endswith(".toml")))


def _lift(table: Mapping[str, Any], file: Path, seed: int | None, duration: str | None, moving: bool) -> LiftFile:
    top = Fields(table, "", LiftError)
    top.refuse_unknown(TOP)
    top.need("crane", "payload", "water", "start", "stage")
    crane = load_crane(top.path_or_name("crane", file.parent))
    depth, _ = water_of(top)
    programme = _programme(table["stage"])
    z_0 = top.quantity("start", "length")
    assert z_0 is not None
    length = top.quantity("duration", "time") if duration is None else parse(duration, "time", "--duration")
    length = planned(programme, z_0, depth) if length is None else length
    place = place_of(top, file.parent, depth, length, seed) if moving else still_place(top, file.parent)
    fields: dict[str, Any] = {
        "name": top.text("name", file.stem),
        "payload": payload_of(top, file.parent),
        "tip": place.tip,
        "waves": place.waves,
        "h_tip": f"{place.h_tip!r} m",
        "depth": table["water"]["depth"],
        "z_0": table["start"],
        "programme": programme,
        "duration": f"{length!r} s",
    }
    fields |= parts_of(table)
    fields |= {key: table[key] for key in ("controller", "ramp", "friction") if key in table}
    if "rho" in table["water"]:
        fields["rho"] = table["water"]["rho"]
    step, every = _steps(top, "step"), _steps(top, "every")
    return LiftFile(crane, Lowering(**fields), step, every, place.words, place.vessel, place.at, place.sea, place.notes)


def water_of(top: Fields) -> tuple[float, float]:
    """Depth [m] and density [kg/m^3] of the water, from [water]. Errors: LiftError, UnitError."""
    water = Fields(top.table["water"], "water.", LiftError)
    water.refuse_unknown(WATER)
    depth = water.quantity("depth", "length")
    if depth is None:
        raise LiftError('water.depth: missing. Give the depth of the water, such as "300 m".')
    if not 0.0 < depth <= DEEPEST:
        raise water.wrong("depth", f"give a depth above 0 m and up to {DEEPEST:g} m, deeper than any sea.")
    rho = water.quantity("rho", "density", RHO_SEA)
    if rho is None or not LIGHTEST <= rho <= HEAVIEST:
        raise water.wrong("rho", f"give the density of water, {LIGHTEST:g} to {HEAVIEST:g} kg/m^3.")
    return depth, rho


def parts_of(table: Mapping[str, Any]) -> dict[str, Any]:
    """Rigging, wire, settings of the winch and sensors, of those tables that are there."""
    kinds = (("rigging", Rigging), ("wire", DeepWire), ("winch", WinchSettings), ("sensors", Sensors))
    return {key: _part(kind, table, key) for key, kind in kinds if key in table}


def _part(kind: type[Record], table: Mapping[str, Any], key: str) -> Record:
    """A table as it is named in the file, in errors too."""
    try:
        return kind(**_table(table, key))
    except ScenarioError as e:
        text = str(e)
        raise ScenarioError(
            key + text.removeprefix(kind.__name__) if text.startswith(f"{kind.__name__}.") else text
        ) from None


def _table(table: Mapping[str, Any], key: str) -> dict[str, Any]:
    if not isinstance(table[key], Mapping):
        raise LiftError(f"{key} = {quote(table[key])}: is not a table. Write [{key}] with its fields below.")
    return dict(table[key])


def _steps(top: Fields, key: str) -> str | None:
    return top.text(key) if key in top else None


def _programme(rows: Any) -> tuple[Stage, ...]:
    if not isinstance(rows, list) or not rows or not all(isinstance(row, Mapping) for row in rows):
        raise LiftError("stage: no stages. Write each as a table [[stage]] with mode, lower and what ends it.")
    return tuple(Stage(**row) for row in rows)


def payload_of(top: Fields, folder: Path) -> Payload:
    """A payload of the library, a file seen from the lift file, or a table with name, mass and shape."""
    if isinstance(top.table["payload"], Mapping):
        return Payload(**top.table["payload"])
    return read_payload(top.path_or_name("payload", folder))


def planned(programme: Sequence[Stage], z_0: float, depth: float) -> float:
    """Length of a run that leaves room for a programme that goes as planned [s]: each stage's way over its speed, or
    its time.

    Errors: LiftError where a stage ends by wire or tension, whose time only the run can determine: the file then gives
    duration.
    """
    total, z = 0.0, z_0
    for i, stage in enumerate(programme, 1):
        if stage.time is not None:
            total, z = total + stage.time, z - stage.lower * stage.time
            continue
        goal = -depth if stage.landed else -stage.depth if stage.depth is not None else None
        if goal is None:
            raise LiftError(
                f"duration: missing, and only the run can determine when stage {i} ends by {stage.end}. Give duration ="
                ' "600 s".'
            )
        total, z = total + abs(z - goal) / max(abs(stage.lower), 1e-9), goal
    return round(LATE * total + ROOM, 1)


def describe_stage(stage: Stage) -> str:
    """A stage in words and units."""
    speed = (
        ""
        if stage.lower == 0.0
        else f" {'lowering' if stage.lower > 0 else 'hoisting'} {show(abs(stage.lower), 'speed')}"
    )
    hold = "" if stage.hold is None else f" holding {show(stage.hold, 'force')}"
    kinds = {"time": "time", "depth": "length", "wire": "length", "tension": "force"}
    value = "" if stage.landed else f" {show(getattr(stage, stage.end), kinds[stage.end])}"
    return f"{stage.mode}{speed}{hold}, until {stage.end}{value}"
