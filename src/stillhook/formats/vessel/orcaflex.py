"""Motion transfer functions from an OrcaFlex model in text form (YAML): displacement RAOs of its vessel type, in the
conventions it states.

Read are the vessel type's RAOResponseUnits, RAOWaveUnit, WavesReferredToBy, RAOPhaseConvention,
RAOPhaseUnitsConvention, RAOPhaseRelativeToConvention, the six words on what is positive, Symmetry, and of its draught
DisplacementRAOs: RAOOrigin, PhaseOrigin and a table per RAODirection. Directions are where waves go, counter-clockwise
from the bow (0 following, 180 head sea); coordinates are those of OrcaFlex's vessel axes, x forward, y to port, z up
[m]. Conventions recalled from OrcaFlex's help on vessel types: check one case against your version. What a file leaves
out is OrcaFlex's default, as it is there, and the vessel's notes say so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import SeaError
from stillhook.sea.vessel.rao import DOFS, Rao
from stillhook.sea.vessel.rao_convention import INSIDE, to_rao
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
MIRRORS = {"None": False, "xz plane": True}
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


def read_orcaflex(path: Path, text: str) -> Rao:
    """The vessel in an OrcaFlex text file, given its path and text. Errors: SeaError of one line."""
    model = _model(path.name, text)
    kind = _only(path.name, model, "VesselTypes")
    place = f"{path.name}: {quote(kind.get('Name', 'vessel type'))[1:-1]}"
    draught = _only(place, kind, "Draughts")
    raos = draught.get("DisplacementRAOs")
    if not isinstance(raos, Mapping) or not isinstance(raos.get("RAOs"), list) or not raos["RAOs"]:
        raise SeaError(f"{place}: has no DisplacementRAOs. Give the draught a table of them.")
    _choice(place, kind, "RAOWaveUnit", {"amplitude": 1})
    rotation, phase = (
        _choice(place, kind, "RAOResponseUnits", ANGLES),
        _choice(place, kind, "RAOPhaseUnitsConvention", ANGLES),
    )
    factor, sign = _choice(place, kind, "WavesReferredToBy", WAVES), _choice(place, kind, "RAOPhaseConvention", PHASES)
    after = _choice(place, kind, "RAOPhaseRelativeToConvention", AFTER_CREST)
    signs = np.array([_choice(place, kind, key, words) for key, words in POSITIVE])
    degrees, columns, H = _tables(place, raos["RAOs"], phase)
    H = (signs * np.array([1.0] * 3 + [rotation] * 3))[:, None, None] * H * np.exp(1j * after * (1 if sign < 0 else -1))
    omega = factor * columns if factor > 0.0 else -factor / columns
    mirror = bool(_choice(place, kind, "Symmetry", MIRRORS)) and float(np.ptp(degrees)) <= 180.0
    origin = _point(place, raos, "RAOOrigin", None)
    crest = _point(place, raos, "PhaseOrigin", origin)
    convention = replace(INSIDE, time=1 if sign > 0 else -1, mirror=mirror)
    return to_rao(
        convention,
        name=str(kind.get("Name", path.stem)),
        omega=omega,
        heading=np.radians(degrees),
        H=H,
        source=f"{path.name} (OrcaFlex, draught {draught.get('Name', '1')})",
        origin=f"x = {origin[0]:g} m, y = {origin[1]:g} m, z = {origin[2]:g} m of OrcaFlex's vessel axes (RAO origin)",
        notes=(
            *_unused_fields(kind),
            f"read as OrcaFlex: phases {'lag' if sign < 0 else 'lead'}; {replace(convention, time=1).describe()}",
        ),
        crest=(crest[0] - origin[0], crest[1] - origin[1]),
    )


def _model(file: str, text: str) -> Mapping[str, Any]:
    """The document of a file that holds vessel types."""
    try:
        import yaml
    except ImportError:
        raise SeaError(f"{file}: reading OrcaFlex text files needs PyYAML. Install stillhook[orcaflex].") from None
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        documents = list(yaml.load_all(text, Loader=loader))
    except (yaml.YAMLError, ValueError, RecursionError) as e:
        raise SeaError(
            f"{file}: is not YAML ({' '.join(str(e).split())[:120]}). Save the model again as a text data file."
        ) from None
    model = next((d for d in documents if isinstance(d, Mapping) and "VesselTypes" in d), None)
    if model is None:
        raise SeaError(f"{file}: has no VesselTypes. Save a model with a vessel type as a text data file.")
    general = model.get("General", {})
    units = general.get("UnitsSystem", "SI") if isinstance(general, Mapping) else "SI"
    if units != "SI":
        raise SeaError(
            f"{file}: UnitsSystem {quote(units)}, SI is read. Change the units of the model and save it again."
        )
    return model


def _only(place: str, table: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """The one entry of a list of tables."""
    entries = table.get(key)
    if not isinstance(entries, list) or not entries or not all(isinstance(e, Mapping) for e in entries):
        raise SeaError(f"{place}: {key} is not a list of tables. Save the model again.")
    if len(entries) > 1:
        names = ", ".join(str(e.get("Name", "?")) for e in entries)
        raise SeaError(f"{place}: holds {len(entries)} {key} ({names}). Keep one, so that it is clear which is meant.")
    entry: Mapping[str, Any] = entries[0]
    return entry


def _choice(place: str, table: Mapping[str, Any], key: str, choices: Mapping[str, float]) -> float:
    value = table.get(key, DEFAULTS[key])
    value = "None" if value is None else str(value)
    match = next((v for name, v in choices.items() if name.lower() == value.lower()), None)
    if match is None:
        raise SeaError(
            f"{place}: {key} {quote(value)} is not read. Allowed: {', '.join(choices)}. Change it in OrcaFlex."
        )
    return match


def _unused_fields(kind: Mapping[str, Any]) -> tuple[str, ...]:
    """What the file does not state, in one note."""
    assumed = [f"{key} {value}" for key, value in DEFAULTS.items() if key not in kind]
    return (f"not in the file, OrcaFlex's defaults: {', '.join(assumed)}",) if assumed else ()


def _tables(place: str, raos: Sequence[Any], phase: float) -> tuple[FloatArray, FloatArray, ComplexArray]:
    """Directions [deg], first column without 0 and infinity, and amplitude times e^(i phase) as written (6, directions,
    rows)."""
    degrees, grids, first = [], [], None
    for entry in raos:
        key = next((k for k in entry if str(k).startswith(FIRST)), None) if isinstance(entry, Mapping) else None
        if key is None or "RAODirection" not in entry:
            raise SeaError(
                f"{place}: a displacement RAO without RAODirection or without a table {FIRST}... . Save the model"
                " again."
            )
        where = f"{place}: RAODirection {entry['RAODirection']}"
        rows = _rows(where, entry[key])
        if first is None:
            first = rows[:, 0]
        elif not np.array_equal(first, rows[:, 0]):
            raise SeaError(
                f"{where}: has other periods or frequencies than the first direction. Give every direction the same."
            )
        degrees.append(float(entry["RAODirection"]))
        grids.append((rows[:, 1::2] * np.exp(1j * phase * rows[:, 2::2])).T)
    first = np.asarray(first)
    usable = np.isfinite(first) & (first > 0.0)
    return np.array(degrees), first[usable], np.stack(grids, axis=1)[:, :, usable]


def _rows(where: str, table: Any) -> FloatArray:
    if not isinstance(table, list) or not table:
        raise SeaError(f"{where}: has no rows. Save the model again.")
    for number, row in enumerate(table, start=1):
        if not isinstance(row, list) or len(row) != LAST:
            count = len(row) if isinstance(row, list) else 1
            needed = f"period or frequency, then amplitude and phase of {', '.join(DOFS)}"
            raise SeaError(f"{where}: row {number} has {count} numbers, {LAST} are needed: {needed}.")
    try:
        rows = np.array(
            [[float("inf") if str(v) == "Infinity" else float(v) for v in row] for row in table], dtype=np.float64
        )
    except (TypeError, ValueError):
        raise SeaError(f"{where}: holds something that is not a number. Save the model again.") from None
    used = rows[np.isfinite(rows[:, 0]) & (rows[:, 0] > 0.0)]
    if not np.isfinite(used).all():
        raise SeaError(f"{where}: holds a number that is not finite. Correct the table.")
    return rows


def _point(
    place: str, raos: Mapping[str, Any], key: str, otherwise: tuple[float, float, float] | None
) -> tuple[float, float, float]:
    """A point [x, y, z] [m]; `otherwise` where it is [~, ~, ~], OrcaFlex's word for the same as the RAO origin."""
    point = raos.get(key)
    if otherwise is not None and (point is None or (isinstance(point, list) and all(v is None for v in point))):
        return otherwise
    if (
        not isinstance(point, list)
        or len(point) != 3
        or not all(isinstance(v, int | float) and np.isfinite(v) for v in point)
    ):
        raise SeaError(f"{place}: {key} {quote(point)} is not a point. Give it as [x, y, z] in m.")
    x, y, z = (float(v) for v in point)
    return x, y, z
