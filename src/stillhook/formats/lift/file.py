"""Lift files: one TOML that names crane, vessel, sea, crane tip, payload, rigging, wire and winch programme of a
lowering."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import as_file, files
from pathlib import Path
from typing import NamedTuple

from stillhook.base.nearest import nearest
from stillhook.errors import LiftError
from stillhook.formats.lift.place import place_of, still_place
from stillhook.formats.lift.tables import LiftTables, payload_of
from stillhook.library import load_crane
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind, other_kind
from stillhook.library.toml.tree import toml_text
from stillhook.sea.spectra.spectrum import Sea
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.tip import TipPoint
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.programme import Stage
from stillhook.units import parse, quote, show

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
        payload = "suction-anchor-85t"       # or the path of a payload file, or a table [payload]
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

    A library name ("anchor-to-3000m") may stand in place of a path. seed and duration go before those of the file.
    Unless `moving` vessel and sea are read and nothing is made to move: for what looks at spectra; the sea may then be
    missing.
    Errors: StillhookError, one line that names file, field, what came and what is allowed.

    >>> import stillhook
    >>> file = stillhook.load_lift("anchor-to-3000m")
    >>> file.crane.name, file.lift.depth
    ('deep-250t', 3000.0)
    """
    if str(path) in lifts():
        with as_file(files("stillhook.library") / "data" / "lifts" / f"{path}.toml") as file:
            return read_toml(file, FileKind.LIFT, LiftError, lambda table: _lift(table, seed, duration, moving))
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
    return read_toml(path, FileKind.LIFT, LiftError, lambda table: _lift(table, seed, duration, moving))


def lifts() -> tuple[str, ...]:
    """Names of the library's example lifts."""
    shelf = files("stillhook.library") / "data" / "lifts"
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in shelf.iterdir() if entry.name.endswith(".toml")))


def _lift(table: TomlTable, seed: int | None, duration: str | None, moving: bool) -> LiftFile:
    file = table.read(LiftTables)
    crane = load_crane(table.relative_toml(file.crane))
    length = file.duration if duration is None else parse(duration, "time", "--duration")
    length = planned(file.stage, file.start, file.water.depth) if length is None else length
    place = place_of(file, table, length, seed) if moving else still_place(file, table)
    lift = Lowering(
        name=file.name or table.path.stem,
        payload=payload_of(file, table),
        rigging=file.rigging,
        wire=file.wire,
        tip=place.tip,
        waves=place.waves,
        h_tip=f"{place.h_tip!r} m",
        depth=f"{file.water.depth!r} m",
        z_0=f"{file.start!r} m",
        programme=file.stage,
        winch=file.winch,
        controller=file.controller,
        duration=f"{length!r} s",
        ramp=f"{file.ramp!r} s",
        rho=f"{file.water.rho!r} kg/m^3",
        sensors=file.sensors,
        friction=file.friction,
    )
    return LiftFile(
        crane=crane,
        lift=lift,
        step=file.step,
        every=file.every,
        place=place.words,
        vessel=place.vessel,
        at=place.at,
        sea=place.sea,
        notes=place.notes,
    )


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
