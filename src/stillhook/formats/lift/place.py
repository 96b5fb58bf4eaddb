"""Where a lift happens: crane tip, vessel and sea of a lift file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from os.path import exists
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.gateway.named_files import named_path
from stillhook.errors import LiftError, SeaError
from stillhook.formats.case_file import read_tip
from stillhook.formats.lift.tables import LiftTables, SeaTable, motion_unit_of
from stillhook.formats.vessel.open import read_vessel
from stillhook.formats.waves.wavespectra import read_sea
from stillhook.library.catalogue import vessel_file, vessels
from stillhook.library.toml.file import TomlTable
from stillhook.sea.motion.motion import Motion, Still
from stillhook.sea.spectra.directions import parse_direction
from stillhook.sea.spectra.measured import SpectrumSeries
from stillhook.sea.spectra.spectrum import Sea, Train, check_spread
from stillhook.sea.spectra.text import parse_sea
from stillhook.sea.vessel.boom import TipPoint, parse_point
from stillhook.sea.vessel.heave_filter import moved_by
from stillhook.sea.vessel.rao import Rao, wavenumber
from stillhook.sea.vessel.realisation import WaveField, realise, tip_motion
from stillhook.sea.vessel.relative import DeckMotion, OtherVessel, RelativeMotion
from stillhook.spec.lift.deck import Deck
from stillhook.spec.lift.phase import called
from stillhook.spec.lift.rigging import Carrier
from stillhook.spec.scenario import LONGEST
from stillhook.units import quote, show

SHORTEST_SEA = 60.0
"""Time below which a piece of a random sea holds too few waves to be one [s]."""
DEEP = 3.0
"""Wave number times depth from which water is deep to a wave: tanh is then within half a per cent of 1."""
USUAL_SEA = {"Hs": "2 m", "Tp": "9 s", "headings": "150 deg"}


class Place(NamedTuple):
    """Motion of the crane tip, the water below it, height of the tip above still water [m]; in words; what they follow
    from (None: not there); notes: what a reader should know; against: the tip's motion over the deck of another
    vessel; deck of a run."""

    tip: Motion
    waves: WaveField | None
    h_tip: float
    words: str
    vessel: Rao | None = None
    at: TipPoint | None = None
    sea: Sea | None = None
    notes: tuple[str, ...] = ()
    against: RelativeMotion | None = None
    deck: Deck | None = None


def place_of(file: LiftTables, table: TomlTable, length: float, seed: int | None, deck: Deck | None) -> Place:
    """Crane tip, vessel and sea of a run of `length` [s], and the deck, which moves with the other vessel where the
    file does not say how; seed: before that of the file."""
    place = _place_of(file, table, length, seed, deck)
    if deck is None:
        return place
    place = place if place.deck is not None else place._replace(deck=deck)
    assert place.deck is not None
    return place._replace(words=f"{place.words}; {place.deck.describe()}")


def _place_of(file: LiftTables, table: TomlTable, length: float, seed: int | None, deck: Deck | None) -> Place:
    where, height = tip_of(file)
    if seed is not None and file.sea is None:
        raise LiftError("--seed: belongs to waves, and the file has no [sea]. Leave it out.")
    if file.tip.motion is not None:
        for key in ("vessel", "sea", "motion_unit"):
            if getattr(file, key) is not None:
                problem = "given together with tip.motion, which replaces vessel and sea"
                raise LiftError(f"{key}: {problem}. Leave one of them out.")
        motion = read_tip(file.tip.motion, table.path.parent)
        return Place(motion, None, height, f"tip: {motion.describe()}; still water")
    if file.sea is None:
        if file.vessel is not None:
            do = f"Write [sea] with {sea_example(file)}, or leave vessel out for a calm."
            raise LiftError(f"sea: missing, and a vessel is given. {do}")
        return Place(Still(), None, height, "tip still; still water")
    if file.vessel is None:
        raise table.missing("vessel")
    if where is None:
        do = 'Write [tip] with at = "x=-20 m, y=-18 m, z=30 m", or a table [boom].'
        raise LiftError(f"tip: its place is missing. {do}")
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
    if repeat > LONGEST:
        raise table.wrong(f"waves repeat after {show(LONGEST, 'time')} at most.", "sea", "repeat")
    waves = realise(sea, repeat, seed, amplitudes=file.sea.amplitudes, depth=depth)
    part = "" if file.sea.left == 1.0 else f" ({file.sea.left:.4g} of its motion)"
    words = f"{rao.name}, tip at {where.describe()}{part}, in {sea.describe()}, seed {seed}"
    own: dict[str, Any] = {name: getattr(file.sea, name) for name in ("left", "resolution")}
    unit = motion_unit_of(file)
    motion, water = moved_by(waves, rao, where.x, where.y, water=file.sea.water and deck is None, unit=unit, **own)
    words += "" if unit is None else f", {unit.describe()}"
    if deck is not None and (other := other_vessel_of(file, table)) is not None:
        if "motion" in file.deck:
            raise LiftError("deck.motion: given together with other_vessel, whose deck moves. Leave one of them out.")
        below = tip_motion(waves, DeckMotion(other, depth), where.x, where.y, fine=file.sea.resolution.angle)
        deck = deck.model_copy(update={"motion": below})
    notes = depth_notes(rao, max(train.spectrum.peak_period for train in sea.trains), depth)
    return Place(
        tip=motion, waves=water, h_tip=height, words=words, vessel=rao, at=where, sea=sea, notes=notes, deck=deck
    )


def sea_example(file: LiftTables) -> str:
    """How a [sea] is written, with a cell of the file's [environment] where there is one."""
    seas = file.environment if isinstance(file.environment, Mapping) else {}
    Hs, Tp, heading = (_first(seas.get(key), usual) for key, usual in USUAL_SEA.items())
    wave = seas.get("wave", "jonswap")
    return f'wave = "{wave} Hs={Hs} Tp={Tp}" and heading = "{heading}"'


def _first(values: Any, usual: str) -> str:
    """The first value of a range or a list."""
    first = values[0] if isinstance(values, list) and values else values
    return " ".join(first.partition(" to ")[0].split()) if isinstance(first, str) and first.strip() else usual


def depth_notes(rao: Rao, longest: float, depth: float) -> tuple[str, ...]:
    """Notes on motions for deep water over water [m] that is not deep to the longest waves [s]."""
    kd = float(wavenumber(np.array([2.0 * math.pi / longest]), depth)[0]) * depth
    if kd >= DEEP or math.isclose(rao.depth, depth, rel_tol=0.2):
        return ()
    of = "deep water" if math.isinf(rao.depth) else f"water of {show(rao.depth, 'length')}"
    shallow = f"shallow to waves of {longest:.3g} s (wave number times depth {kd:.2g}), and the tip moves otherwise"
    return (f"the motions of {rao.name} are for {of}; {show(depth, 'length')} are {shallow}",)


def still_place(file: LiftTables, table: TomlTable) -> Place:
    """Vessel, tip and sea without motion."""
    where, height = tip_of(file)
    rao = None if file.vessel is None else _vessel(file.vessel, table)
    words = "" if rao is None or where is None else f"{rao.name}, tip at {where.describe()}"
    sea = None if file.sea is None else _sea(file.sea, table.at("sea"))
    other = other_vessel_of(file, table)
    against = None if rao is None or other is None else RelativeMotion(rao, other, file.water.depth)
    return Place(tip=Still(), waves=None, h_tip=height, words=words, vessel=rao, at=where, sea=sea, against=against)


def other_vessel_of(file: LiftTables, table: TomlTable) -> OtherVessel | None:
    """The vessel that the payload is lifted from or set down on; None where the file has none."""
    of, at = file.other_vessel, [phase for phase in file.phase if phase.on_other_vessel]
    off = [phase for phase in at if phase.deck is None]
    if of is None and at:
        do = 'Write [other_vessel] with vessel and at; the table of EN 13852-1 alone is of kind = "lift-off".'
        raise LiftError(f"other_vessel: missing, and {called(at[0])} is at its deck. {do}")
    if of is None:
        return None
    if file.vessel is None:
        raise LiftError("other_vessel: moves against the crane vessel, and vessel is missing. Give vessel as well.")
    if file.rigging.carrier is not Carrier.VESSEL and (off or not at):
        problem = f"the payload is on another vessel, and rigging.carrier is {quote(file.rigging.carrier.value)}"
        raise LiftError(f'other_vessel: {problem}. Write [rigging] carrier = "{Carrier.VESSEL.value}".')
    position = None if of.position is None else parse_point(of.position, "other_vessel.position")
    if position is not None and position.z is not None:
        raise LiftError("other_vessel.position: has z, and both reference points are at the waterline. Leave z out.")
    return OtherVessel(
        _vessel(of.vessel, table, "other_vessel.vessel"),
        parse_point(of.at, "other_vessel.at"),
        parse_direction(of.heading, "other_vessel.heading"),
        None if position is None else (position.x, position.y),
    )


def tip_of(file: LiftTables) -> tuple[TipPoint | None, float]:
    """Place of the crane tip from the vessel's reference point, and its height above still water [m]."""
    at, height = file.tip.at, file.tip.height
    if file.boom is not None and (at is not None or height is not None):
        raise LiftError("tip: its place is given together with [boom]. Leave one of them out.")
    point = None if at is None else parse_point(at, "tip.at")
    point = point if file.boom is None else TipPoint(*file.boom.boom.tip)
    z = None if point is None else point.z
    if height is not None and z is not None:
        raise LiftError("tip.height: given together with z in tip.at. Leave one of them out.")
    height = z if height is None else height
    if height is None:
        raise LiftError('tip: its height above the water is missing. Give z in tip.at, or height = "30 m".')
    if height <= 0.0:
        above = f"its height {show(height, 'length')} is not above the water"
        raise LiftError(f"tip: {above}. Count it up from still water.")
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
    path = table.named_path(sea.wave, "wave")
    if not path.is_file():
        raise table.wrong("no such file next to the lift file. Check the path, or write waves as a text.", "wave")
    if heading is None:
        do = 'Give the direction in which the waves travel, from the bow, such as "180 deg".'
        raise LiftError(f"sea.heading: missing. {do}")
    series = read_sea(path)
    if not isinstance(series, SpectrumSeries):
        raise table.wrong("holds heights and periods, no spectra. Give a file of spectra, or waves as a text.", "wave")
    if sea.record is None:
        do = 'Give its number from 0, or its time, "1996-01-05T12:00".'
        raise LiftError(f"sea.record: missing, and {path.name} holds {len(series)}. {do}")
    exponent = None if sea.spread is None else check_spread(sea.spread, "sea.spread")
    return Sea((Train(series.spectrum(series.index(str(sea.record))), heading, exponent),))


def _vessel(name: str, table: TomlTable, where: str = "vessel") -> Rao:
    """A vessel of the library, or the file of this path, seen from the lift file."""
    if name in vessels():
        return read_vessel(vessel_file(name))
    path = named_path(table.path.parent, name, lambda why: SeaError(f"{where} = {quote(name)}: {why}"))
    if not exists(path):
        known = f"neither a file next to the lift file nor one of {', '.join(vessels())}"
        raise SeaError(f"{where} = {quote(name)}: {known}.")
    return read_vessel(path)
