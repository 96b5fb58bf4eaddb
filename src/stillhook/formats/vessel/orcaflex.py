"""Motion transfer functions from an OrcaFlex model in text form (YAML): displacement RAOs of its vessel type, in the
conventions it states.

Read are the vessel type's RAOResponseUnits, RAOWaveUnit, WavesReferredToBy, RAOPhaseConvention,
RAOPhaseUnitsConvention, RAOPhaseRelativeToConvention, the six words on what is positive, Symmetry, and of its draught
DisplacementRAOs: RAOOrigin, PhaseOrigin and a table per RAODirection. Directions are where waves go, counter-
clockwise from the bow (0 following, 180 head sea); coordinates are those of OrcaFlex's vessel axes, x forward, y to
port, z up in the model's unit of length, which rotations per length are in as well (UnitsSystem SI, US, or User with
LengthUnits and g). Of several vessel types or draughts the user states one. A table of one quarter (0 to 90 deg) of a
vessel with Symmetry "xz and yz planes" is mirrored ahead and astern about its RAO origin, then to the other side.
Conventions as in OrcaFlex's help on vessel types, not compared with it: check one case against your version. What a
file leaves out is OrcaFlex's default, as it is there, and the vessel's notes say so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.base.choice import nearest
from stillhook.base.gateway.budget import YAML
from stillhook.base.gateway.parse import from_yaml
from stillhook.errors import SeaError, UnreadableError
from stillhook.formats.vessel.supplement import NOTHING, Supplement, description, wrong
from stillhook.physics.scalar import G
from stillhook.sea.vessel.rao import DOFS, Rao
from stillhook.sea.vessel.rao_convention import INSIDE, mirrored_fore_and_aft, to_rao, within_one_side
from stillhook.units import quote

POSITIVE = (
    ("SurgePositive", {"forward": 1.0, "aft": -1.0}),
    ("SwayPositive", {"port": 1.0, "starboard": -1.0}),
    ("HeavePositive", {"up": 1.0, "down": -1.0}),
    ("RollPositiveStarboard", {"down": 1.0, "up": -1.0}),
    ("PitchPositiveBow", {"down": 1.0, "up": -1.0}),
    ("YawPositiveBow", {"port": 1.0, "starboard": -1.0}),
)
WAVES = {"period (s)": -2.0 * np.pi, "frequency (rad/s)": 1.0, "frequency (Hz)": 2.0 * np.pi}
"""What makes omega of a table's first column; negative where it is divided by the column."""
ANGLES = {"degrees": np.pi / 180.0, "radians": 1.0}
PHASES = {"lags": -1, "leads": 1}
AFTER_CREST = {"crest": 0.0, "zero down-crossing": 0.5 * np.pi, "trough": np.pi, "zero up-crossing": 1.5 * np.pi}
"""What phases are relative to: by how much of the wave's cycle it comes after the crest [rad]."""
MIRRORS = {"None": 0, "xz plane": 1, "xz and yz planes": 2}
"""Planes of symmetry."""
LENGTHS = {"m": 1.0, "km": 1000.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "in": 0.0254}
"""Units of length [m]."""
DEFAULTS = {
    "RAOWaveUnit": "amplitude",
    "RAOResponseUnits": "degrees",
    "RAOPhaseUnitsConvention": "degrees",
    "WavesReferredToBy": "period (s)",
    "RAOPhaseConvention": "lags",
    "RAOPhaseRelativeToConvention": "crest",
    "Symmetry": "None",
    **{key: next(iter(words)) for key, words in POSITIVE},
}
"""OrcaFlex's own."""
FIRST, LAST = "RAOPeriodOrFreq", 13  # name of a table begins so; numbers in a row of it
SAVE = "Save the model again as a text data file."
MOST_NAMED = 20  # names that a line lists
LARGEST = 1e12  # of a number in a table
SAME_G = 0.05  # m/s^2: how far g may be from 9.81 m/s^2 on earth
MIRRORED_QUARTER = (
    "fore and aft mirrored about the RAO origin: the table holds one quarter, and surge, pitch and yaw change sign in"
    " waves from the other end"
)


def read_orcaflex(path: Path, text: str, stated: Supplement = NOTHING) -> Rao:
    """The vessel in an OrcaFlex text file; stated: vessel type and draught where there are several."""
    model = _model(path.name, text)
    length, unit = _length(path.name, model)
    kind = _chosen(path.name, path.name, model, "VesselTypes", "vessel_type", stated.vessel_type)
    place = f"{path.name}: {quote(kind.get('Name', 'vessel type'))[1:-1]}"
    draught = _chosen(path.name, place, kind, "Draughts", "draught", stated.draught)
    raos = draught.get("DisplacementRAOs")
    if not isinstance(raos, Mapping) or not isinstance(raos.get("RAOs"), list) or not raos["RAOs"]:
        raise wrong(place, "has no DisplacementRAOs", "Give the draught a table of them.")
    _choice(place, kind, "RAOWaveUnit", {"amplitude": 1})
    rotation, phase = (_choice(place, kind, f"RAO{key}", ANGLES) for key in ("ResponseUnits", "PhaseUnitsConvention"))
    factor, sign = _choice(place, kind, "WavesReferredToBy", WAVES), _choice(place, kind, "RAOPhaseConvention", PHASES)
    after = _choice(place, kind, "RAOPhaseRelativeToConvention", AFTER_CREST)
    signs = np.array([_choice(place, kind, key, words) for key, words in POSITIVE])
    degrees, columns, H = _tables(place, raos["RAOs"], phase)
    scale = signs * np.array([1.0] * 3 + [rotation / length] * 3)
    H = scale[:, None, None] * H * np.exp(1j * after * (1 if sign < 0 else -1))
    omega = factor * columns if factor > 0.0 else -factor / columns
    planes = _choice(place, kind, "Symmetry", MIRRORS)
    origin = _point(place, raos, "RAOOrigin", None, length)
    crest = _point(place, raos, "PhaseOrigin", origin, length)
    quarter = planes == 2 and float(np.ptp(degrees)) <= 90.0
    if quarter and crest[0] != origin[0]:
        problem = "Symmetry xz and yz planes, and PhaseOrigin is not at the x of RAOOrigin: no plane mirrors both"
        raise wrong(place, problem, "Give directions from 0 to 180 deg, or one x.")
    heading = np.radians(degrees)
    if quarter:
        heading, H = mirrored_fore_and_aft(heading, H, path.name)
    mirror = planes > 0 and within_one_side(heading)
    convention = replace(INSIDE, time=1 if sign > 0 else -1, mirror=mirror)
    assumed = [f"{key} {value}" for key, value in DEFAULTS.items() if key not in kind]
    return to_rao(
        convention,
        name=_shown(kind.get("Name", path.stem)),
        omega=omega,
        heading=heading,
        H=H,
        source=f"{path.name} (OrcaFlex, draught {_shown(draught.get('Name', '1'))})",
        origin=f"x = {origin[0]:g} m, y = {origin[1]:g} m, z = {origin[2]:g} m of OrcaFlex's vessel axes (RAO origin)",
        notes=(
            *((f"not in the file, OrcaFlex's defaults: {', '.join(assumed)}",) if assumed else ()),
            *((MIRRORED_QUARTER,) if quarter else ()),
            *((f"lengths in {unit}, rotations per {unit} of wave amplitude",) if unit != "m" else ()),
            f"read as OrcaFlex: phases {'lag' if sign < 0 else 'lead'}; {replace(convention, time=1).describe()}",
        ),
        crest=(crest[0] - origin[0], crest[1] - origin[1]),
    )


def _shown(value: object) -> str:
    """A name or number of the file, short and on one line."""
    return quote(value).strip('"')


def _model(file: str, text: str) -> Mapping[str, Any]:
    """The document of a file that holds vessel types."""
    if len(text) > YAML.size:
        raise wrong(file, f"holds more than {YAML.size / 1e6:g} MB", "Save a model with fewer vessel types.")
    try:
        documents = from_yaml(text)
    except ImportError:
        raise SeaError(f"{file}: reading OrcaFlex text files needs PyYAML. Install stillhook[orcaflex].") from None
    except UnreadableError as problem:
        raise wrong(file, f"is not YAML ({problem})", SAVE) from None
    model = next((d for d in documents if isinstance(d, Mapping) and "VesselTypes" in d), None)
    if model is None:
        raise wrong(file, "has no VesselTypes", "Save a model with a vessel type as a text data file.")
    return model


def _length(file: str, model: Mapping[str, Any]) -> tuple[float, str]:
    """The model's unit of length [m] and its name."""
    general = model.get("General")
    general = general if isinstance(general, Mapping) else {}
    system = str(general.get("UnitsSystem", "SI"))
    if system.lower() not in ("si", "us", "user"):
        raise wrong(file, f"UnitsSystem {quote(system)} is not read", "Allowed: SI, US, User.")
    if system.lower() != "user":
        return (1.0, "m") if system.lower() == "si" else (LENGTHS["ft"], "ft")
    time = str(general.get("TimeUnits", "s"))
    if time != "s":
        raise wrong(file, f"TimeUnits {quote(time)}, s is read", "Change it in OrcaFlex.")
    unit = str(general.get("LengthUnits", ""))
    if unit not in LENGTHS:
        came = f"LengthUnits {quote(unit)} is not read" if unit else "UnitsSystem User without LengthUnits"
        raise wrong(file, came, f"Allowed: {', '.join(LENGTHS)}. Change it in OrcaFlex.")
    g = general.get("g", G / LENGTHS[unit])
    if isinstance(g, bool) or not isinstance(g, int | float) or not abs(g * LENGTHS[unit] - G) < SAME_G:
        of_earth = f"that of the earth in {unit}/s^2, {G / LENGTHS[unit]:.6g}"
        raise wrong(file, f"g {quote(g)} is not {of_earth}", "Correct LengthUnits or g.")
    return LENGTHS[unit], unit


def _chosen(
    file: str, place: str, table: Mapping[str, Any], key: str, field: str, name: str | None
) -> Mapping[str, Any]:
    """The entry of a list of tables that has a name, or the only one; field: what states it in a vessel description."""
    entries = table.get(key)
    if not isinstance(entries, list) or not entries or not all(isinstance(e, Mapping) for e in entries):
        raise wrong(place, f"{key} is not a list of tables", SAVE)
    names = [_shown(e.get("Name", "?")) for e in entries]
    have = f"{place}: holds {len(names)} {key} ({', '.join(names[:MOST_NAMED])}{', ...' * (len(names) > MOST_NAMED)})"
    if name is None and len(names) > 1:
        raise SeaError(f"{have}. {description(file, f'{field} = {quote(names[0])}')}")
    if name is not None and names.count(name) != 1:
        problem = "several have this name" if name in names else f"none is this{nearest(name, names)}"
        raise SeaError(f"{have}, and {field} = {quote(name)}: {problem.rstrip('.')}. Name one of them.")
    entry: Mapping[str, Any] = entries[0 if name is None else names.index(name)]
    return entry


def _choice(place: str, table: Mapping[str, Any], key: str, choices: Mapping[str, float]) -> float:
    value = table.get(key, DEFAULTS[key])
    value = "None" if value is None else str(value)
    match = next((v for name, v in choices.items() if name.lower() == value.lower()), None)
    if match is None:
        do = f"Allowed: {', '.join(choices)}. Change it in OrcaFlex."
        raise wrong(place, f"{key} {quote(value)} is not read", do)
    return match


def _tables(place: str, raos: Sequence[Any], phase: float) -> tuple[FloatArray, FloatArray, ComplexArray]:
    """Directions [deg], first column without 0 and infinity, and amplitude times e^(i phase) as written (6, directions,
    rows)."""
    degrees, grids, first = [], [], None
    for entry in raos:
        key = next((k for k in entry if str(k).startswith(FIRST)), None) if isinstance(entry, Mapping) else None
        if key is None or "RAODirection" not in entry:
            raise wrong(place, f"a displacement RAO without RAODirection or without a table {FIRST}...", SAVE)
        where = f"{place}: RAODirection {_shown(entry['RAODirection'])}"
        rows = _rows(where, entry[key])
        if first is None:
            first = rows[:, 0]
        elif not np.array_equal(first, rows[:, 0]):
            problem = "has other periods or frequencies than the first direction"
            raise wrong(where, problem, "Give every direction the same.")
        degree = entry["RAODirection"]
        if isinstance(degree, bool) or not isinstance(degree, int | float) or not np.isfinite(degree):
            raise wrong(where, "is not a number of degrees", "Correct it.")
        degrees.append(float(degree))
        grids.append((rows[:, 1::2] * np.exp(1j * phase * rows[:, 2::2])).T)
    first = np.asarray(first)
    usable = np.isfinite(first) & (first > 0.0)
    return np.array(degrees), first[usable], np.stack(grids, axis=1)[:, :, usable]


def _rows(where: str, table: Any) -> FloatArray:
    if not isinstance(table, list) or not table:
        raise wrong(where, "has no rows", SAVE)
    for number, row in enumerate(table, start=1):
        if not isinstance(row, list) or len(row) != LAST:
            count = len(row) if isinstance(row, list) else 1
            do = f"Give period or frequency, then amplitude and phase of {', '.join(DOFS)}."
            raise wrong(where, f"row {number} has {count} numbers, {LAST} are needed", do)
    try:
        rows = np.array([[float(v) for v in row] for row in table])  # float reads Infinity as well
    except (TypeError, ValueError):
        raise wrong(where, "holds something that is not a number", SAVE) from None
    used = rows[np.isfinite(rows[:, 0]) & (rows[:, 0] > 0.0)]
    if not (np.isfinite(used) & (np.abs(used) < LARGEST)).all() or used[:, 0].min(initial=1.0) < 1.0 / LARGEST:
        raise wrong(where, "holds a number that no vessel has, or that is not finite", "Correct the table.")
    return rows


def _point(
    place: str, raos: Mapping[str, Any], key: str, otherwise: tuple[float, float, float] | None, length: float
) -> tuple[float, float, float]:
    """A point [x, y, z] [m], of one in units of a length [m]; `otherwise` where it is [~, ~, ~], OrcaFlex's word for
    the same as the RAO origin."""
    point = raos.get(key)
    if otherwise is not None and (point is None or (isinstance(point, list) and all(v is None for v in point))):
        return otherwise
    if (
        not isinstance(point, list)
        or len(point) != 3
        or not all(isinstance(v, int | float) and abs(v) < LARGEST for v in point)
    ):
        raise wrong(place, f"{key} {quote(point)} is not a point", "Give it as [x, y, z].")
    x, y, z = (length * float(v) for v in point)
    return x, y, z
