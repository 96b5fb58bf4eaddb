"""A validation campaign as its file describes it: crane, criteria, signals of the logs, and one entry per test.

The PLC's mode in a log: its own numbers or words and their meaning.
"""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator

from stillhook import units as u
from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import ValidateError
from stillhook.library import load_crane
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind
from stillhook.logs.campaign import MARK, HookDepth, LoggedTest, check_names, check_parts, hook_depth, marked_logs
from stillhook.logs.mapping import mapping_from
from stillhook.logs.types import Signal
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Water
from stillhook.tables.table import Flag, Name, Part, Spec, Text
from stillhook.units import number, quote, show
from stillhook.validate.criteria.criteria import Criteria, load_criteria
from stillhook.validate.criteria.results import Note, usual_criteria

STANDARD_MODES: Mapping[float, Mode] = {float(i): mode for i, mode in enumerate(Mode)}
"""The numbers of `stillhook.variables`."""
WORDS_FROM = 1e6
"""Numbers from here on represent words of the log: no PLC uses mode numbers this high."""
LEAST = 0.3
"""A mode of shorter duration is the mean of two codes in one bin, or a logging artefact [s]: the previous mode
continues."""


def with_modes(
    mapping: Mapping[str, Signal] | None, modes: Mapping[str, Mode]
) -> tuple[Mapping[str, Signal] | None, Mapping[float, Mode]]:
    """A mapping whose mode may be written in words, and the meaning of each number."""
    if not modes:
        return mapping, STANDARD_MODES
    numbers = {key: _number(key) for key in modes}
    words = {key: WORDS_FROM + i for i, key in enumerate(k for k, value in numbers.items() if value is None)}
    meaning = {(words[key] if value is None else value): modes[key] for key, value in numbers.items()}
    if mapping is None or "mode" not in mapping:
        return mapping, meaning
    signal = replace(mapping["mode"], words=(*mapping["mode"].words, *words.items()))
    return {**mapping, "mode": signal}, meaning


def _number(key: str) -> float | None:
    try:
        return float(key)
    except ValueError:
        return None


def standard_modes(values: FloatArray, step: float, meaning: Mapping[float, Mode], place: str) -> FloatArray:
    """The modes of a log by the numbers of `stillhook.variables`, NaN where it has none. values (n,) every `step` [s];
    place: prefix of a message. Errors: ValidateError for a number without a meaning."""
    code = np.full(len(values), np.nan)
    for value, mode in meaning.items():
        code[np.abs(values - value) < 1e-6] = float(list(Mode).index(mode))
    edges = np.flatnonzero(~((values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1])))) + 1
    for a, b in zip([0, *edges], [*edges, len(values)], strict=True):
        if np.isnan(values[a]) or (not np.isnan(code[a]) and (b - a) * step >= LEAST):
            continue
        if (b - a) * step >= LEAST:
            codes = ["a word" if value >= WORDS_FROM else number(value, 6) for value in meaning]
            of = {"code": float(values[a]), "seconds": (b - a) * step, "codes": codes}
            raise ValidateError(Note("unknown-mode", place=place, **of))
        code[a:b] = code[a - 1] if a else np.nan
    first = np.flatnonzero(np.isfinite(code))
    if len(first) and first[0] * step < LEAST:
        code[: first[0]] = code[first[0]]
    return code


TIP_AND_WIRE = ("s_tip", "s_w", "e_c_measured")
LONGEST_DELAY = 10.0  # s, as in a scenario's sensors


class Kind(StrEnum):
    """Purpose of a test: heave compensation, the winch at its speed limit, or hoisting and lowering without load in
    quick turns."""

    AHC = "ahc"
    LIMITS = "limits"
    DYNAMICS = "dynamics"


class TestTable(LoggedTest):
    """A table [[test]]."""

    kind: Kind = Field(description="heave compensation, speed limit, or hoisting and lowering in quick turns")
    load: u.Mass | None = Field(default=None, description="winch load without the hook: payload and weight of the wire")
    payload: u.Mass | None = Field(default=None, description="mass suspended from the hook, with depth or h_tip")
    mode: Mode | None = Field(default=None, description="of the PLC, where the log has none")
    water: Part[Water] | None = Field(default=None, description="a submerged payload")

    @field_validator("mode")
    @classmethod
    def _compensates(cls, mode: Mode | None, info: ValidationInfo) -> Mode | None:
        if mode is not None and not mode.compensates and info.data.get("kind") is Kind.AHC:
            raise ValueError('a test of kind "ahc" needs a compensating mode. State that mode, or another kind.')
        return mode

    @model_validator(mode="after")
    def _one_load(self) -> Self:
        """A payload with the depth of the hook, or a load without it."""
        hook = next((key for key in ("depth", "h_tip") if getattr(self, key) is not None), None)
        wrong = {
            "load-and-payload": self.payload is not None and self.load is not None,
            "payload-alone": self.payload is not None and hook is None,
            "load-with-depth": self.load is not None and hook is not None,
            "depth-alone": hook is not None and self.payload is None,
        }
        for code, applies in wrong.items():
            if applies:
                raise ValueError(Note(code, hook=hook))
        return self


class CampaignFile(Spec):
    """A validation campaign."""

    title: Name | None = Field(default=None, description="title of the certificate")
    date: Annotated[datetime.date, Field(strict=True)] = Field(description="date of the certificate")
    crane: Text = Field(description="library name or crane file: the twin under test")
    criteria: Text | None = Field(default=None, description="library name or criteria file")
    delay: u.Time = Field(
        default=0.0, ge=0, le=LONGEST_DELAY, description="by which the tip motion is known to reach the PLC late"
    )
    signals: Mapping[str, Any] | None = Field(default=None, description="columns of the logs")
    modes: Mapping[str, Mode] = Field(default_factory=dict, description="meaning of the PLC's numbers or words")
    test: tuple[TestTable, ...] = Field(min_length=1, description="one [[test]] table for each log")
    synthetic: Flag = Field(default=False, description="simulated, measured on no crane")
    remarks: tuple[Text, ...] = Field(default=(), description="remarks for the certificate")


@dataclass(frozen=True)
class CraneTest:
    """One test. load: winch load without the hook [kg], payload and wire out, because the twin's wire has no weight;
    None: from the load cell; s_w at the start [m] and mode, None: from the log; start, end: the part that counts [s];
    modes: meaning of the log's numbers; payload: mass suspended from the hook [kg] where the file states it with the
    hook's depth instead of a load: the record computes the load, part by part."""

    name: str
    log: Path
    kind: Kind
    load: float | None
    mode: Mode | None
    s_w: float | None
    water: Water | None
    mapping: Mapping[str, Signal] | None
    start: float
    end: float
    modes: Mapping[float, Mode] = field(default_factory=lambda: STANDARD_MODES)
    payload: float | None = None
    hook: HookDepth | None = None


@dataclass(frozen=True)
class Campaign:
    """Tests of one crane. crane: the twin under test; delay: known delay of the crane's tip motion at the PLC [s];
    date: date of the certificate; file: the campaign file."""

    title: str
    date: datetime.date
    file: Path
    crane: Crane
    crane_name: str
    """As the file names it: a library name, or a path."""
    criteria: Criteria
    delay: float
    tests: tuple[CraneTest, ...]
    synthetic: bool
    remarks: tuple[str, ...]

    def of(self, kind: Kind) -> tuple[CraneTest, ...]:
        """The tests of a kind."""
        return tuple(t for t in self.tests if t.kind is kind)


def load_campaign(path: str | Path) -> Campaign:
    """Read a validation campaign::

        title = "Quay and sea trials of crane 7"
        date = 2026-11-21              # of the certificate
        crane = "nov-250t"             # library name or crane file: the twin under test
        criteria = "paper-f"           # library name or criteria file (default: that of its kind of winch)
        delay = "40 ms"                # by which the tip motion is known to reach the PLC late (default: 0 s)
        [signals]                      # as for `stillhook identify friction`
        time = { column = "Time", unit = "s" }
        s_tip = { column = "Tip pos", unit = "m" }
        mode = { column = "AHC state" }
        ...
        [modes]                        # meaning of the PLC's numbers or words (default: the numbers of Stillhook)
        0 = "manual"
        "AHC on" = "ssc"
        [[test]]
        name = "1"
        log = "logs/1.csv"             # relative to this file
        kind = "ahc"                   # ahc, limits or dynamics
        load = "82 t"                  # winch load without the hook: payload, and weight of the wire out
        payload = "62 t"               # instead: mass suspended from the hook, with depth or h_tip, from which the
                                       # weight of the wire out is calculated
        depth = "467 m"                # of the hook below the water line at the start of the test
        h_tip = "20 m"                 # crane tip above the water line: instead of depth, or next to it without s_w
        s_w = "487 m"                  # wire out at the start, where the log has no s_w
        mode = "ssc"                   # where the log has no mode
        start = "0 s"                  # the part of the log that counts
        end = "200 s"
        water = { volume = "10 m^3", added_mass = "20 t", C_D = 1.2, area = "12 m^2" }   # a submerged payload

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    Campaign
        The crane, its criteria and its tests.

    Raises
    ------
    StillhookError
        One line that names file, field, value and what is allowed.
    """
    return read_toml(path, FileKind.CAMPAIGN, ValidateError, _campaign)


def _campaign(table: TomlTable) -> Campaign:
    file = table.read(CampaignFile)
    crane = load_crane(table.relative_toml(file.crane))
    mapping = None if file.signals is None else mapping_from(file.signals, table.path.name)
    modes = {key.strip(): mode for key, mode in file.modes.items()}
    tests = tuple(_test(row, i, table.at("test", i), crane, mapping, modes) for i, row in enumerate(file.test))
    check_names(tests, ValidateError)
    for kind in Kind:
        check_parts([t for t in tests if t.kind is kind], ValidateError)
    title = file.title or table.path.stem
    marked = [] if file.synthetic or MARK in title else marked_logs(tests)
    return Campaign(
        title=title,
        date=file.date,
        file=table.path,
        crane=crane,
        crane_name=file.crane,
        criteria=load_criteria(table.relative_toml(file.criteria or usual_criteria(crane))),
        delay=file.delay,
        tests=tests,
        synthetic=file.synthetic or MARK in title or bool(marked),
        remarks=(*file.remarks, *([f"{MARK}, as the head of {', '.join(marked)} says."] if marked else [])),
    )


def _test(
    row: TestTable,
    i: int,
    table: TomlTable,
    crane: Crane,
    mapping: Mapping[str, Signal] | None,
    modes: Mapping[str, Mode],
) -> CraneTest:
    for key, mass in (("load", row.load), ("payload", row.payload)):
        if mass is not None and not 0.0 <= mass <= crane.SWL:
            swl = show(crane.SWL, "mass")
            raise table.wrong(f'"{crane.name}" is rated for 0 t to {swl}. Check the {key}.', key)
    L_full = drum_record(crane).L_full
    if row.s_w is not None and row.s_w > L_full:
        raise table.wrong(f'"{crane.name}" has 0 m to {show(L_full, "length")} of wire.', "s_w")
    mass = row.payload if row.load is None else row.load
    if row.water is not None and mass is not None and row.water.rho * row.water.volume > mass + crane.hook_mass:
        raise table.wrong(f"a payload of {show(mass, 'mass')} floats. Check load and volume.", "water", "volume")
    if row.signals is not None:
        mapping = mapping_from(row.signals, f"{table.path.name}: {table.place()}")
    _two_columns(mapping, f"{table.place()}: ")
    mapping, meaning = with_modes(mapping, modes)
    return CraneTest(
        name=row.name or str(i + 1),
        log=table.relative_file(row.log, "log"),
        kind=row.kind,
        load=row.load,
        mode=row.mode,
        s_w=row.s_w,
        water=row.water,
        mapping=mapping,
        start=row.start,
        end=row.end,
        modes=meaning,
        payload=row.payload,
        hook=hook_depth(row, table),
    )


def _two_columns(mapping: Mapping[str, Signal] | None, place: str) -> None:
    """Refuse wire out or the PLC's error mapped as the tip: the winch would compensate without any error."""
    rows = [mapping[name] for name in TIP_AND_WIRE if name in mapping] if mapping is not None else []
    for i, b in enumerate(rows):
        for a in rows[:i]:
            if a.column == b.column:
                raise ValidateError(Note("same-column", place=place, a=a.name, b=b.name, column=quote(a.column)))
