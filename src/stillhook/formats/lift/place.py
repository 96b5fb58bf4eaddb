"""Where a lift happens, as its file states it: vessel, crane tip, waves, and what moves there."""

from __future__ import annotations

import math
from os.path import exists
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.errors import LiftError, SeaError
from stillhook.formats.case_file import read_tip
from stillhook.formats.toml_fields import Fields
from stillhook.formats.vessel.open import read_vessel
from stillhook.formats.waves.open import read_sea
from stillhook.library.vessels import vessel_file, vessels
from stillhook.sea.motion.kinematics import WaveField
from stillhook.sea.motion.motion import Motion, Still
from stillhook.sea.spectra.directions import parse_direction
from stillhook.sea.spectra.measured import SpectrumSeries
from stillhook.sea.spectra.spectrum import Sea, Train, check_spread
from stillhook.sea.spectra.text import parse_sea
from stillhook.sea.vessel.boom import DESCRIPTIONS, Boom
from stillhook.sea.vessel.long_wave import wavenumber
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.realisation import realise, tip_motion
from stillhook.sea.vessel.tip import TipPoint, parse_point
from stillhook.sea.vessel.wave_field import wave_field
from stillhook.units import quote, show

SEA = ("wave", "record", "heading", "spread", "seed", "amplitudes")
TIP = ("at", "height", "motion")
BOOM = ("pedestal", "slew", "main", "knuckle", "offset")
SHORTEST_SEA = 60.0
"""Time below which a piece of a random sea holds too few waves to be one [s]."""
DEEP = 3.0
"""Wave number times depth from which water is deep to a wave: tanh is then within half a per cent of 1."""


class Place(NamedTuple):
    """Motion of the crane tip, the water below it, height of the tip above still water [m]; in words; what they follow
    from; notes: what a reader should know."""

    tip: Motion
    waves: WaveField | None
    h_tip: float
    words: str
    vessel: Rao | None = None
    at: TipPoint | None = None
    sea: Sea | None = None
    notes: tuple[str, ...] = ()


def place_of(top: Fields, folder: Path, depth: float, length: float, seed: int | None) -> Place:
    """Where the load hangs, and what moves there."""
    where, height = _point(top)
    tip = Fields(top.table.get("tip", {}), "tip.", LiftError)
    if seed is not None and "sea" not in top:
        raise LiftError("--seed: belongs to waves, and the file has no [sea]. Leave it out.")
    if "motion" in tip:
        for key in ("vessel", "sea"):
            if key in top:
                raise LiftError(
                    f"{key}: given together with tip.motion, which replaces vessel and sea. Leave one of them out."
                )
        motion = read_tip(tip.table["motion"], folder)
        return Place(motion, None, height, f"tip: {motion.describe()}; still water")
    if "sea" not in top:
        if "vessel" in top:
            raise LiftError(
                "sea: missing, and a vessel is given. Write [sea] with wave and heading, or leave vessel out for a"
                " calm."
            )
        return Place(Still(), None, height, "tip still; still water")
    top.need("vessel")
    if where is None:
        raise LiftError(
            'tip: its place is missing. Write [tip] with at = "x=-20 m, y=-18 m, z=30 m", or a table [boom].'
        )
    table = _table_of_sea(top)
    sea, rao = _sea(table, folder), _vessel(top, folder)
    if sea.moment(0) <= 0.0:
        raise table.wrong("wave", "no waves. Leave [sea] and vessel out for a calm.")
    if length < SHORTEST_SEA:
        raise LiftError(f"duration = {show(length, 'time')}: too short for waves at random. Give a minute or more.")
    waves = realise(sea, length, _seed(table, seed), amplitudes=table.text("amplitudes", "fixed"), depth=depth)
    words = f"{rao.name}, tip at {where.describe()}, in {sea.describe()}, seed {_seed(table, seed)}"
    motion, water = tip_motion(waves, rao, where.x, where.y), wave_field(waves, where.x, where.y)
    return Place(motion, water, height, words, rao, where, sea, _notes(rao, sea, depth))


def _notes(rao: Rao, sea: Sea, depth: float) -> tuple[str, ...]:
    return depth_notes(rao, max(train.spectrum.peak_period for train in sea.trains), depth)


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


def still_place(top: Fields, folder: Path) -> Place:
    """Vessel, tip and sea without motion."""
    where, height = _point(top)
    rao = _vessel(top, folder) if "vessel" in top else None
    words = "" if rao is None or where is None else f"{rao.name}, tip at {where.describe()}"
    return Place(Still(), None, height, words, rao, where, _sea(_table_of_sea(top), folder) if "sea" in top else None)


def _table_of_sea(top: Fields) -> Fields:
    table = Fields(top.table["sea"], "sea.", LiftError)
    table.refuse_unknown(SEA)
    return table


def _point(top: Fields) -> tuple[TipPoint | None, float]:
    """Place of the crane tip from the vessel's reference point, and its height above still water [m]."""
    tip = Fields(top.table.get("tip", {}), "tip.", LiftError)
    tip.refuse_unknown(TIP)
    point, height = _point_and_height(top, tip)
    if height <= 0.0:
        raise LiftError(
            f"tip: its height {show(height, 'length')} is not above the water. Count it up from still water."
        )
    return point, height


def _point_and_height(top: Fields, tip: Fields) -> tuple[TipPoint | None, float]:
    height = tip.quantity("height", "length")
    if "boom" in top:
        if "at" in tip or height is not None:
            raise LiftError("tip: its place is given together with [boom]. Leave one of them out.")
        x, y, z = boom_of(top).tip
        return TipPoint(x, y, z), z
    point = parse_point(tip.text("at"), "tip.at") if "at" in tip else None
    if height is not None and point is not None and point.z is not None:
        raise LiftError("tip.height: given together with z in tip.at. Leave one of them out.")
    height = height if height is not None else point.z if point is not None else None
    if height is None:
        raise LiftError('tip: its height above the water is missing. Give z in tip.at, or height = "30 m".')
    return point, height


def boom_of(top: Fields) -> Boom:
    """The crane of the table [boom]."""
    boom = Fields(top.table["boom"], "boom.", LiftError)
    boom.refuse_unknown(BOOM)
    boom.need("pedestal", "slew", "main")
    for key in ("pedestal", "main", "knuckle"):
        if key in boom and not isinstance(boom.table[key], list):
            raise boom.wrong(key, DESCRIPTIONS[key])
    texts: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in boom.table.items()
    }
    return Boom(**texts)


def _sea(table: Fields, folder: Path) -> Sea:
    """Waves of a text, or one record of a file next to the lift file."""
    heading = table.table.get("heading")
    beta = None if heading is None else parse_direction(heading, "sea.heading")
    spread = table.table.get("spread")
    if spread is not None and (isinstance(spread, bool) or not isinstance(spread, int | float)):
        raise table.wrong("spread", "give the exponent n of cos^n, such as 4, or leave it out for long-crested waves.")
    text = table.text("wave")
    if "=" not in text and "." in text:
        if not (folder / text).is_file():
            raise table.wrong("wave", "no such file next to the lift file. Check the path, or write waves as a text.")
        return _measured_sea(table, folder / text, beta, spread)
    if "record" in table:
        raise table.wrong("record", "belongs to a file of measured waves, and sea.wave is a text. Leave it out.")
    return parse_sea(text, heading=heading, spread=spread, where="sea.wave")


def _measured_sea(table: Fields, path: Path, heading: float | None, spread: float | None) -> Sea:
    if heading is None:
        raise LiftError(
            'sea.heading: missing. Give the direction in which the waves travel, from the bow, such as "180 deg".'
        )
    series = read_sea(path)
    if not isinstance(series, SpectrumSeries):
        raise table.wrong("wave", "holds heights and periods, no spectra. Give a file of spectra, or waves as a text.")
    if "record" not in table:
        raise LiftError(
            f"sea.record: missing, and {path.name} holds {len(series)}. Give its number from 0, or its time,"
            ' "1996-01-05T12:00".'
        )
    exponent = None if spread is None else check_spread(float(spread), "sea.spread")
    return Sea((Train(series.spectrum(series.index(str(table.table["record"]))), heading, exponent),))


def _seed(table: Fields, seed: int | None) -> int:
    value = table.table.get("seed", 1) if seed is None else seed
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise LiftError(f"sea.seed = {quote(value)}: give a whole number of 0 or more.")
    return value


def _vessel(top: Fields, folder: Path) -> Rao:
    """A vessel of the library, or the file of this path, seen from the lift file."""
    name = top.text("vessel")
    if name in vessels():
        return read_vessel(vessel_file(name))
    if not exists(folder / name):
        raise SeaError(
            f"vessel = {quote(name)}: neither a file next to the lift file nor one of {', '.join(vessels())}."
        )
    return read_vessel(folder / name)
