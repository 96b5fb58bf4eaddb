"""What a log of a crane holds, in names of its own: which column is perhaps which signal, by its heading and unit, and
which counts the other way, by its run.

Nothing of this is taken when a log is read: it is what `stillhook inspect` proposes, to be checked and given back.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from types import MappingProxyType
from typing import Any

import numpy as np

from stillhook.errors import LogError, StillhookError
from stillhook.formats.table.corrections import corrections_of
from stillhook.formats.table.dialect import table_unit
from stillhook.formats.table.stamps import is_stamp
from stillhook.formats.table.understood import ReadColumn, Understood, ends
from stillhook.logs.formats.open import open_log
from stillhook.logs.formats.source import Source
from stillhook.logs.log import read_samples, unit_of
from stillhook.logs.mapping import (
    mapping_from,
    mapping_from_headings,
    place_of,
    read_mapping,
    resolved,
    split_heading,
)
from stillhook.logs.signs import check_signs
from stillhook.logs.types import Log, Signal
from stillhook.variables import PHYSICAL

WORDS: Mapping[str, str] = MappingProxyType(
    {
        "time": r"t\d?|time ?stamp|time|date ?time|date|zeit|zeitstempel|datum|tid|tidspunkt|utc",
        "p_a": r"(p|druck|pressure|press|trykk)( line| port| side| leitung)? ?(a|heben|hoist(ing)?|h(i|ei)v)( side)?",
        "p_b": r"(p|druck|pressure|press|trykk)( line| port| side| leitung)? ?(b|senken|lower(ing)?|fir)( side)?",
        "p_hp": r"(p|druck|pressure|trykk) ?(hp|acc|accumulator|speicher|akkumulator)",
        "omega_m": r"(m\d? |motor ?)?(drehzahl|speed|rpm|turtall|n)( motor| m\d?)?|omega( m)?",
        "u_p": r"(pump(e|en)?|stell\w*)( ?(soll|command|cmd|set ?point|ref|stellung|signal|p[aå]drag))*",
        "alpha_m": r"(motor )?(displacement|swash|schwenkwinkel|deplasement)( motor)?",
        "F_w": r"(haken ?last|hook ?load|load ?cell|line ?(pull|tension)|(wire )?tension|krok ?last|last|kraft)",
        "s_w": r"(seil|wire|rope|cable|line|ca?ble)( ?(l(ä|ae)nge|length|out|aus|lengde|ute))+|pay(ed)? ?out|utl(å|o)p",
        "v_w": r"(seil|wire|rope|line|hook|winch) ?(speed|geschwindigkeit|velocity|hastighet)",
        "s_tip": r"(tip|heave|hub|hiv)( (position|height|pos))?",
        "v_tip": r"(tip|heave) (speed|velocity|rate)",
        "theta_oil": r"(oil|öl|olje) ?temp\w*",
    }
)
"""What signals are called in headings, in lower case with blanks between words."""
TURNED = ("omega_m", "v_w", "u_p", "s_w", "s_tip", "v_tip")
"""Signals that a log may count the other way, likeliest first."""
MOST_TURNED = 3


def understood_log(path: str | os.PathLike[str], columns: Mapping[str, Any] | None = None) -> Understood:
    """What a log holds: rows that its user gives (`stillhook.formats.table.corrections`), then headings with names of
    Stillhook, then those that are called as signals are. Errors: LogError, UnitError of one line."""
    source = open_log(path)
    named = mapping_from_headings(source.headings, source.name)
    mine = mapping_from(columns, "columns") if columns else {}
    signals = named | {name: resolved(signal, source.headings, source.name) for name, signal in mine.items()}
    guessed = dict(_guessed(source, signals))
    signals |= guessed
    order = ["time", *mine, *named, *WORDS]
    signals = {name: signals[name] for name in sorted(signals, key=order.index)}
    problem = ""
    turned: dict[str, str] = {}
    log: Log | None = None
    if not any(name != "time" for name in signals):
        problem = f'{source.name}: no heading is called as a signal is. Say which is: --column "p_a=HEADING [bar]".'
    try:
        log = read_samples(source, signals)
        turned = _turned(log, [name for name in signals if name not in mine])
        log = _flipped(log, tuple(turned))
        check_signs(log)
    except StillhookError as error:
        problem = problem or str(error)
    read = tuple(_read(source, signal, log, name in guessed, turned.get(name, "")) for name, signal in signals.items())
    used = {place_of(s.column, source.headings, source.name) for s in signals.values() if " + " not in s.column}
    unused = tuple(h for i, h in enumerate(source.headings) if i not in used and h.strip())
    notes = () if log is None else tuple(f"{finding.text} [{finding.action}]" for finding in log.findings)
    head = () if log is None else (f"{log.samples} samples in {log.duration:.6g} s, {log.rate:.4g} per second",)
    return Understood(source.name, "log of a crane", read, unused, (*head, *notes), problem=problem)


def signals_of(
    path: str | os.PathLike[str], mapping: str | os.PathLike[str] | None, columns: Sequence[str] | None = None
) -> dict[str, Signal] | None:
    """The mapping of a log by a mapping file and texts such as "p_a=PT101 [bar]", which win over it or over the log's
    headings; None where neither is given. Errors: LogError, UnitError of one line."""
    rows = None if mapping is None else read_mapping(mapping)
    if not columns:
        return rows
    if rows is None:
        source = open_log(path)
        rows = mapping_from_headings(source.headings, source.name)
    return rows | mapping_from(corrections_of(columns), "--column")


def _guessed(source: Source, signals: Mapping[str, Signal]) -> Iterator[tuple[str, Signal]]:
    """Signals that headings are called as, each once, in units of their kind."""
    taken = {place_of(s.column, source.headings, source.name) for s in signals.values() if " + " not in s.column}
    first = len(source.headings)
    for name, words in reversed(list(WORDS.items())):  # the time last: the column of it before the signals
        if name in signals or (name == "time" and source.time_base) or (name != "time" and name not in PHYSICAL):
            continue
        kind = "time" if name == "time" else PHYSICAL[name].kind
        places = list(range(len(source.headings)))
        if name == "time":
            places = sorted(places, key=lambda place: (place > first, -place if place < first else place))
        for place in places:
            plain, unit = split_heading(source.headings[place])
            unit = unit or source.units[place]
            if place in taken or not re.fullmatch(words, _plain(plain)):
                continue
            if name == "time" and is_stamp(source.sample(place)):
                unit = "UTC"
            elif not unit and name == "time":
                unit = "s"
            elif (table_unit(unit, kind) is None) if kind else unit not in ("%", "1", "-", ""):
                continue
            yield name, Signal(name, source.headings[place].strip(), unit if name == "time" else None, quantity=kind)
            taken.add(place)
            first = min(first, place)
            break


def _plain(heading: str) -> str:
    """A heading in lower case with one blank between its words."""
    apart = re.sub(r"(?<=[a-zäöü])(?=[A-Z])", " ", heading)
    return " ".join(re.sub(r"[^a-zäöüåæø0-9]+", " ", apart.lower()).split())


def _turned(log: Log, names: Sequence[str]) -> dict[str, str]:
    """The fewest signals that must count the other way for the signs to agree; none where they agree, or never do."""
    first = _contradiction(log)
    if not first:
        return {}
    free = [name for name in TURNED if name in log.signals and name in names]
    for size in range(1, min(MOST_TURNED, len(free)) + 1):
        for turned in combinations(free, size):
            if not _contradiction(_flipped(log, turned)):
                return dict.fromkeys(turned, "turned round by the others")
    return {}


def _contradiction(log: Log) -> str:
    try:
        check_signs(log)
    except LogError as error:
        return str(error)
    return ""


def _flipped(log: Log, names: Sequence[str]) -> Log:
    """The log with signals counted the other way."""
    if not names or log.mapping is None:
        return log
    signals = {name: -x if name in names else x for name, x in log.signals.items()}
    mapping = {n: replace(s, sign=-s.sign) if n in names else s for n, s in log.mapping.items()}
    return replace(log, signals=MappingProxyType(signals), mapping=MappingProxyType(mapping))


def _read(source: Source, signal: Signal, log: Log | None, guessed: bool, turned: str) -> ReadColumn:
    """A signal as a row."""
    final = signal if log is None or log.mapping is None else log.mapping.get(signal.name, signal)
    remark = "; ".join(part for part in ("a guess" if guessed else "", turned) if part)
    if signal.name == "time":
        span = "" if log is None else f"{log.duration:.6g} s"
        unit = signal.unit or ("UTC" if " + " in signal.column else _unit(source, signal))
        return ReadColumn("time", signal.column, unit, remark="; ".join(p for p in (span, remark) if p))
    low, high = (np.nan, np.nan) if log is None else ends(log.signals[signal.name])
    return ReadColumn(
        signal.name,
        signal.column,
        _unit(source, signal),
        final.sign,
        signal.quantity,
        low,
        high,
        remark,
        signal.scale,
        signal.offset,
    )


def _unit(source: Source, signal: Signal) -> str:
    try:
        return unit_of(source, signal, place_of(signal.column, source.headings, source.name))
    except StillhookError:
        return signal.unit or ""
