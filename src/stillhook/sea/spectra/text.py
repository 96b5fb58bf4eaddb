"""Waves as text that a person writes ("jonswap Hs=1 m Tp=8 s gamma=3.3 + pm Hs=0.5 m Tp=14 s") and as plain numbers
that a file stores."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from stillhook.errors import SeaError, UnitError
from stillhook.sea.spectra.directions import parse_direction
from stillhook.sea.spectra.measured import Measured
from stillhook.sea.spectra.parametric import (
    Hump,
    Jonswap,
    Mixed,
    OchiHubble,
    Peaks,
    Torsethaugen,
    peak_period_of,
    pierson_moskowitz,
)
from stillhook.sea.spectra.spectrum import Sea, Train, WaveSpectrum, check_spread
from stillhook.units import exact, parse, quote

FIELDS: Mapping[str, tuple[str, ...]] = {
    "jonswap": ("Hs", "Tp", "Tz", "gamma", "norm"),
    "pm": ("Hs", "Tp", "Tz"),
    "torsethaugen": ("Hs", "Tp", "norm"),
    "ochi-hubble": ("Hs1", "Tp1", "lambda1", "Hs2", "Tp2", "lambda2"),
}
"""Spectra that a text can name, and what each takes; gamma and norm may be left out."""
PLACED = ("heading", "spread")
"""What a wave train of a sea may have besides."""
ALLOWED = (
    'Write "jonswap Hs=2 m Tp=8 s gamma=3.3", "pm Hs=2 m Tp=8 s", "torsethaugen Hs=2 m Tp=8 s" or ochi-hubble; sums'
    ' with " + "'
)
_OPTIONAL = ("Tz", "gamma", "norm", *PLACED)
_KEY = re.compile(r"(?:^|\s)([A-Za-z_]+[0-9]?)\s*=\s*")
_GLUED = re.compile(r"\+\s*[A-Za-z]")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


def parse_wave(text: str, where: str = "") -> Peaks:
    """The wave spectrum that a text names; sums with spaces round the plus sign.

    - `jonswap Hs=1 m Tp=8 s gamma=3.3` (gamma by the rule of T_p/sqrt(H_s) if left out; norm=printed for 1 - 0.287
    ln(gamma))
    - `pm Hs=1 m Tp=8 s`; both also take T_m02 in place of the peak period: `pm Hs=1 m Tz=5.7 s`
    - `torsethaugen Hs=2 m Tp=8 s`
    - `ochi-hubble Hs1=2 m Tp1=14 s lambda1=3 Hs2=1 m Tp2=7 s lambda2=1`

    where is put first in every error (the file and field). Errors: SeaError for a text of another form or for values
    that no sea has, UnitError for a number with a wrong unit; both in one line.
    """
    terms = []
    for place, name, values in _terms(text, where):
        for key in PLACED:
            if key in values:
                do = "Leave it out here; waves next to a ship have one."
                raise SeaError(f"{place}: {key} does not belong to a spectrum. {do}")
        terms.append(_spectrum(place, name, values))
    return terms[0] if len(terms) == 1 else Mixed(tuple(terms))


def parse_sea(text: str, *, heading: str | None = None, spread: float | None = None, where: str = "") -> Sea:
    """A sea from text.

    Parameters
    ----------
    text : str
        Spectra as in `parse_wave`, such as "jonswap Hs=2 m Tp=9 s gamma=3.3"; each wave train may have its own
        `heading=150 deg` and `spread=4`, else those given here.
    heading : str, optional
        Direction in which waves travel, counter-clockwise from the bow, such as "180 deg" ("0 deg" following, "90 deg"
        coming from starboard, "180 deg" head sea).
    spread : float, optional
        Exponent of cos^n [-]; None for long-crested waves.
    where : str, default ""
        File and field, put first in every error.

    Returns
    -------
    Sea
        The sea with its trains.

    Raises
    ------
    SeaError
        As `parse_wave`; for a heading outside 0 to 360 deg, or a train that has none.
    UnitError
        For a number or a heading without its unit.

    Examples
    --------
    >>> import stillhook
    >>> sea = stillhook.parse_sea("jonswap Hs=2 m Tp=9 s gamma=3.3", heading="180 deg", spread=4)
    >>> sea.trains[0].spectrum.H_s, sea.trains[0].spread
    (2.0, 4)
    """
    heading_angle = None if heading is None else parse_direction(heading, f"{where}: heading" if where else "heading")
    trains = []
    for place, name, values in _terms(text, where):
        towards, n = heading_angle, spread
        if "heading" in values:
            towards = parse_direction(values["heading"], f"{place}: heading")
        if "spread" in values:
            n = check_spread(_number(values["spread"], f"{place}: spread"), f"{place}: spread")
        if towards is None:
            do = 'Add "heading=180 deg" (0 following, 90 coming from starboard, 180 head sea).'
            raise SeaError(f"{place}: no heading. {do}")
        trains.append(Train(_spectrum(place, name, values), towards, n))
    return Sea(tuple(trains))


def sea_text(sea: Sea) -> str:
    """A sea as text that `parse_sea` reads as the same sea, to the last digit. Errors: SeaError for spectra other than
    JONSWAP, Pierson-Moskowitz and Torsethaugen."""
    return " + ".join(_train_text(train) for train in sea.trains)


def _train_text(train: Train) -> str:
    spectrum = train.spectrum
    if not isinstance(spectrum, Jonswap | Torsethaugen):
        raise SeaError(f"{spectrum.describe()}: has no text. Write JONSWAP, Pierson-Moskowitz and Torsethaugen.")
    values = {"Hs": exact(spectrum.H_s, "length"), "Tp": exact(spectrum.T_p, "time")}
    values |= {"gamma": repr(spectrum.gamma)} if isinstance(spectrum, Jonswap) else {}
    values |= {} if spectrum.norm == "exact" else {"norm": spectrum.norm}
    values["heading"] = exact(train.beta, "angle")
    values |= {} if train.spread is None else {"spread": repr(float(train.spread))}
    return " ".join([spectrum.kind, *(f"{key}={value}" for key, value in values.items())])


def _terms(text: str, where: str) -> list[tuple[str, str, dict[str, str]]]:
    """Place, name and texts of the values of each term."""
    place = f"{where}: " if where else ""
    if not isinstance(text, str):
        raise SeaError(f"{place}{quote(text)} is not a wave spectrum. {ALLOWED}.")
    if not text.strip():
        raise SeaError(f"{place}no waves are given. {ALLOWED}.")
    terms = [term.strip() for term in re.split(r"(?:^|\s)\+(?=\s|$)", text.strip())]
    if not all(terms):
        raise SeaError(f'{place}{quote(text)}: a "+" has a spectrum on one side only. Give the other.')
    if any(_GLUED.search(term) for term in terms):
        raise SeaError(f'{place}{quote(text)}: a "+" without spaces round it. Write " + " between spectra.')
    return [_term(term, f"{place}{quote(text)}", place) for term in terms]


def _term(term: str, full_text: str, place: str) -> tuple[str, str, dict[str, str]]:
    head, *parts = _KEY.split(term)
    name = head.strip().lower()
    if name not in FIELDS:
        raise SeaError(f"{place}{quote(term)}: {quote(head.strip())} is not one of {', '.join(FIELDS)}. {ALLOWED}.")
    values: dict[str, str] = {}
    fields = {key.lower(): key for key in (*FIELDS[name], *PLACED)}
    for key, value in zip(parts[::2], parts[1::2], strict=True):
        if key.lower() not in fields:
            raise SeaError(f"{full_text}: {quote(key)} is not one of {', '.join(FIELDS[name])} of {name}.")
        if fields[key.lower()] in values:
            raise SeaError(f"{full_text}: {key} is given twice. Give it once.")
        values[fields[key.lower()]] = value.strip()
    if "Tz" in values and "Tp" in values:
        raise SeaError(f"{full_text}: Tp and Tz are both given. Give one of them.")
    for key in FIELDS[name]:
        if key not in values and key not in _OPTIONAL and not (key == "Tp" and "Tz" in values):
            needed = ", ".join(k for k in FIELDS[name] if k not in _OPTIONAL)
            raise SeaError(f"{full_text}: {name} has no {key}. Give {needed}.")
    return full_text, name, values


def _spectrum(where: str, name: str, values: Mapping[str, str]) -> Peaks:
    kinds = {"Hs": "length", "Tp": "time", "Tz": "time"}
    x = {
        key: parse(text, kinds[key[:2]], f"{where}: {key}") if key[:2] in kinds else _number(text, f"{where}: {key}")
        for key, text in values.items()
        if key not in ("norm", *PLACED)
    }
    norm = values.get("norm", "exact")
    if "Tz" in x:
        x["Tp"] = peak_period_of(x["Tz"], x["Hs"], 1.0 if name == "pm" else x.get("gamma"))
    match name:
        case "jonswap":
            return Jonswap(x["Hs"], x["Tp"], x.get("gamma"), norm, where=where)
        case "pm":
            return pierson_moskowitz(x["Hs"], x["Tp"], where=where)
        case "torsethaugen":
            return Torsethaugen(x["Hs"], x["Tp"], norm, where=where)
        case _:
            first, second = (Hump(x[f"Hs{i}"], x[f"Tp{i}"], x[f"lambda{i}"], where) for i in (1, 2))
            return OchiHubble((first, second))


def _number(text: str, where: str) -> float:
    if not _NUMBER.fullmatch(text) or not math.isfinite(float(text)):
        raise UnitError(f"{where} = {quote(text)}: not a plain number. Write one such as 3.3, without a unit.")
    return float(text)


def spectrum_from_dict(data: Mapping[str, Any]) -> WaveSpectrum:
    """The spectrum whose `to_dict` gave this. Errors: SeaError for what no spectrum stored."""
    place = "stored waves"
    try:
        match data["type"]:
            case "jonswap":
                return Jonswap(data["H_s"], data["T_p"], data["gamma"], data["norm"], where=place)
            case "torsethaugen":
                return Torsethaugen(data["H_s"], data["T_p"], data["norm"], where=place)
            case "ochi-hubble":
                first, second = (Hump(h["H_s"], h["T_p"], h["lambda"], place) for h in data["humps"])
                return OchiHubble((first, second))
            case "mixed":
                terms = [spectrum_from_dict(term) for term in data["terms"]]
                if not all(isinstance(term, Peaks) for term in terms):
                    raise ValueError("terms")
                return Mixed(tuple(term for term in terms if isinstance(term, Peaks)))
            case "measured":
                return Measured(data["omega"], data["width"], data["S"], data["source"])
    except (KeyError, TypeError, ValueError, OverflowError) as problem:
        raise SeaError(f"{place}: {quote(str(problem))} is missing or misstated. Generate them again.") from None
    types = "jonswap, torsethaugen, ochi-hubble, mixed, measured"
    raise SeaError(f"{place}: type {quote(data['type'])} is not one of {types}.")
