"""Lift files: one TOML that names crane, vessel, sea, crane tip, payload, rigging, wire and phases of a lift."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple, TypeVar

from stillhook.base.gateway.guard import reader
from stillhook.engine.arguments import with_usual_controller
from stillhook.engine.pack.programme import tension_kept
from stillhook.engine.simulate import End
from stillhook.errors import LiftError
from stillhook.formats.lift.flow import current_of
from stillhook.formats.lift.forms import in_written_words
from stillhook.formats.lift.place import Place, other_vessel_of, place_of, still_place, tip_of
from stillhook.formats.lift.tables import (
    LiftTables,
    compensator_of,
    crane_of,
    deck_of,
    motion_unit_of,
    payload_of,
    read_lift,
)
from stillhook.formats.results import load_run, lowerings_of, stored_sampling, stored_steps
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import LIBRARY, FileKind, kind_of_toml, unknown_name
from stillhook.library.toml.tree import shelf, toml_text
from stillhook.sea.spectra.spectrum import Sea
from stillhook.sea.vessel.boom import TipPoint, parse_point
from stillhook.sea.vessel.motion_unit import MotionUnit
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.relative import OtherVessel
from stillhook.spec.crane import Crane
from stillhook.spec.lift.deck import Deck
from stillhook.spec.lift.joining import OneRun, Water, joined, one_run
from stillhook.spec.lift.lowering import InSea, Lowering, check_length
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase, PhaseKind, WinchMode, moves
from stillhook.units import parse, show

Result = TypeVar("Result")

ROOM = 60.0
"""Time that a run is given beyond its programme as planned [s]: entry conditions, ramps, and a while to see the end."""
LATE = 1.1
"""Factor on the planned time for the same reason."""


class LiftFile(NamedTuple):
    """A crane and a lowering, how finely it is run and stored (None: default), and where it happens, in words; vessel,
    place of the crane tip and sea as the file gives them (None: not there); notes on what a reader should know;
    sampling of its statistics (None: default), and where the run ends; unit: motion unit with a heave filter."""

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
    unit: MotionUnit | None = None


def stored_lift(path: str | Path) -> LiftFile:
    """The lowering that a stored run holds, to be run again with the same steps. Errors: StillhookError."""
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


@reader(LiftError)
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

    Phases with kinds are those of a plan (`stillhook.load_plan`): of them those are run that one run can follow.

    Parameters
    ----------
    path : str or Path
        Path of the file, or a name of the library ("anchor-to-3000m").
    seed : int, optional
        Seed of the waves, before that of the file.
    duration : str, optional
        Length of the run, such as "600 s", before that of the file.
    moving : bool, default True
        False: vessel and sea are read and nothing is made to move, for what looks at spectra; the sea may then be
        missing.

    Returns
    -------
    LiftFile
        Crane, lift, vessel and sea of the file.

    Raises
    ------
    StillhookError
        One line that names file, field, what came and what is allowed.

    Examples
    --------
    >>> import stillhook
    >>> file = stillhook.load_lift("anchor-to-3000m")
    >>> file.crane.name, file.lift.depth
    ('deep-250t', 3000.0)
    """
    return _read(path, lambda table: _lift(table, seed, duration, moving))


def payload_in(path: str | Path) -> tuple[Payload, float]:
    """The payload that a lift file names, and the density of its water [kg/m^3]. Errors: StillhookError, one line."""

    def read(table: TomlTable) -> tuple[Payload, float]:
        table, file = read_lift(table, LiftTables)
        return payload_of(file, table), file.water.rho

    return _read(path, read)


def place_in(path: str | Path) -> Place:
    """Crane tip, vessels and sea that a lift file names, nothing made to move. Errors: StillhookError, one line."""

    def read(table: TomlTable) -> Place:
        table, file = read_lift(table, LiftTables)
        return still_place(file, table)

    return _read(path, read)


def _not_run(other: OtherVessel | None, deck: Deck | None) -> tuple[str, ...]:
    """That another vessel counts in plans and in `stillhook tip` alone where there is no deck."""
    return (
        ()
        if other is None or deck is not None
        else (f"{other.rao.name}: a plan and stillhook tip have its motion, a run has not",)
    )


def _read(path: str | Path, read: Callable[[TomlTable], Result]) -> Result:
    """The result of `read` for a lift file, or a lift of the library."""
    if str(path) in lifts():
        path = LIBRARY / "lifts" / f"{path}.toml"
    if "." not in str(path) and not Path(path).exists():
        raise LiftError(unknown_name("lift", str(path), lifts(), FileKind.LIFT))
    start = f"A lift file names crane, payload, start_depth, [water] and phases; copy one of {', '.join(lifts())}."
    return read_toml(path, FileKind.LIFT, LiftError, in_written_words(read), start=start)


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
    crane, payload = crane_of(file, table), payload_of(file, table)
    deck = deck_of(file, table)
    if file.start_depth is None and deck is not None and deck.slack is not None:
        file = file.model_copy(update={"start_depth": -deck.height})
    run = _run(file, crane, payload)
    length = file.duration if duration is None else parse(duration, "time", "--duration")
    length = planned(run.programme, run.start_depth, file.water.depth) if length is None else length
    check_length(length)
    place = place_of(file, table, length, seed, deck) if moving else still_place(file, table)
    current = None if deck is not None else current_of(table)
    chosen = {"controller": file.controller} if "controller" in file.model_fields_set else {}
    lift = Lowering(
        name=file.name or table.path.stem,
        payload=payload,
        rigging=file.rigging.spring,
        compensator=compensator_of(file, table),
        wire=file.wire,
        deck=place.deck,
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
        current=current,
        sensors=file.sensors,
        friction=file.friction,
        **chosen,
    )
    lift, unit = with_usual_controller(crane, lift), motion_unit_of(file)
    return LiftFile(
        crane=crane,
        lift=lift,
        step=file.step,
        every=file.every,
        place=place.words if current is None else f"{place.words}; {current.describe()}",
        vessel=place.vessel,
        at=place.at,
        sea=place.sea,
        notes=(
            *place.notes,
            *(() if unit is None else (unit.note,)),
            *run.notes,
            *_not_run(other_vessel_of(file, table), place.deck),
        ),
        sampling=file.sampling,
        end=file.end,
        unit=unit,
    )


def _run(file: LiftTables, crane: Crane, payload: Payload) -> OneRun:
    """What is run: the phases as they are, or those of a plan that one run can follow."""
    if all(phase.kind is None for phase in file.phase):
        if file.start_depth is None:
            meaning = "the depth of the payload's underside as the lift begins (negative above the water)"
            raise LiftError(f'start_depth: missing, {meaning}. Give it, such as "-5 m".')
        return OneRun(file.start_depth, file.phase, ())
    rho, bottom = file.water.rho, file.water.depth
    phases = joined(file.phase, file.start_depth, Water(bottom, payload.reach(rho)))
    at = tip_of(file)[0]

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
            reason = f"only the run can determine when phase {i} ends by {phase.ends[0]}"
            raise LiftError(f'duration: missing, and {reason}. Give duration = "600 s".')
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
