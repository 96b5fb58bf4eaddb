"""A validation campaign as its file describes it: crane, criteria, signals of the logs, and one entry per test."""

from __future__ import annotations

import datetime
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from stillhook.control.registry import MANUAL_MODE
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import StillhookError, ValidateError
from stillhook.formats.toml_fields import Fields, described, no_log_twice, no_name_twice
from stillhook.library import load_crane
from stillhook.library.toml.kinds import FileKind
from stillhook.logs.hook_depth import HookDepth, hook_depth
from stillhook.logs.mapping import mapping_from
from stillhook.logs.types import Signal
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Water
from stillhook.units import quote, show
from stillhook.validate.criteria.criteria import Criteria, load_criteria
from stillhook.validate.data_set.modes import STANDARD_MODES, modes_of, with_modes

TOP = ("title", "date", "crane", "criteria", "delay", "signals", "modes", "test", "synthetic", "remarks")
TEST = ("name", "log", "kind", "load", "payload", "depth", "h_tip", "mode", "s_w", "water", "signals", "start", "end")
MARK = "SYNTHETIC"
TIP_AND_WIRE = ("s_tip", "s_w", "e_c_measured")
LONGEST_DELAY = 10.0  # s, as in a scenario's sensors


class Kind(StrEnum):
    """Purpose of a test: heave compensation (step 5 and others that use it), the winch at its speed limit (step 3),
    or hoisting and lowering without load in quick turns (step 4)."""

    AHC = "ahc"
    LIMITS = "limits"
    DYNAMICS = "dynamics"


@dataclass(frozen=True)
class CraneTest:
    """One test. load: winch load without the hook [kg], payload and wire out, because the twin's wire has no
    weight; None: from the load cell; s_w: wire out at the start [m], None: from the log; mode: of the PLC, None: from
    the log; start, end: the part of the log that counts [s]; water: a submerged payload; modes: what the numbers of the
    log's mode mean, by number; payload: mass suspended from the hook [kg] where the file states it with the hook's
    depth instead of a load: the record computes the load from both, part by part.
    """

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
        criteria = "paper-f"           # library name or criteria file (default: paper-f)
        delay = "40 ms"                # by which the tip motion is known to reach the PLC late (default: 0 s)
        [signals]                      # as for `stillhook identify friction`
        time = { column = "Time", unit = "s" }
        s_tip = { column = "Tip pos", unit = "m" }
        mode = { column = "AHC state" }
        ...
        [modes]                        # what the PLC's own numbers or words for the mode mean (default: the numbers of
        Stillhook) 0 = "manual"
        "AHC on" = "ssc"
        [[test]]
        name = "1"
        log = "logs/1.csv"             # seen from this file
        kind = "ahc"                   # ahc, limits or dynamics
        load = "82 t"                  # what the winch carries without the hook: payload, and weight of the wire out
        (winch load) payload = "62 t"               # or: what hangs on the hook, with depth or h_tip: the weight of the
        wire out is computed depth = "467 m"                # of the hook below the water line at the start of the test
        h_tip = "20 m"                 # crane tip above the water line: instead of depth (or beside it, where nothing
        tells s_w) s_w = "487 m"                  # wire out at the start, where the log has no s_w
        mode = "ssc"                   # where the log has no mode
        start = "0 s"                  # the part of the log that counts
        end = "200 s"
        water = { volume = "10 m^3", added_mass = "20 t", C_D = 1.2, area = "12 m^2" }   # a submerged payload

    Errors: StillhookError, one line that names file, field, value and what is allowed.
    """
    return described(path, FileKind.CAMPAIGN, _campaign)


def _campaign(data: Mapping[str, Any], file: Path) -> Campaign:
    top = Fields(data, "", ValidateError)
    top.refuse_unknown(TOP)
    top.need("date", "crane")
    if "test" not in top:
        raise ValidateError("test: missing. Write one [[test]] table for each log.")
    crane_name = top.path_or_name("crane", file.parent)
    crane = load_crane(crane_name)
    mapping = mapping_from(data["signals"], "signals") if "signals" in data else None
    modes = modes_of(top)
    rows = data["test"]
    if not isinstance(rows, list) or not rows:
        raise ValidateError("test: write one [[test]] table for each log.")
    tests = tuple(_test(row, i, file.parent, crane, mapping, modes) for i, row in enumerate(rows))
    no_name_twice([t.name for t in tests], ValidateError)
    for kind in Kind:
        no_log_twice([t for t in tests if t.kind is kind], ValidateError)
    title = top.text("title", file.stem)
    return Campaign(
        title=title,
        date=_date(top),
        file=file,
        crane=crane,
        crane_name=top.text("crane"),
        criteria=_criteria(top, file.parent),
        delay=_delay(top),
        tests=tests,
        synthetic=top.flag("synthetic") or MARK in title,
        remarks=_remarks(top),
    )


def _date(top: Fields) -> datetime.date:
    value = top.table["date"]
    if isinstance(value, datetime.datetime) or not isinstance(value, datetime.date):
        raise top.wrong("date", "state the date of the certificate without quotes, such as 2026-11-21.")
    return value


def _criteria(top: Fields, folder: Path) -> Criteria:
    return load_criteria(top.path_or_name("criteria", folder) if "criteria" in top else "paper-f")


def _delay(top: Fields) -> float:
    delay = top.quantity("delay", "time", 0.0)
    assert delay is not None
    if not 0.0 <= delay <= LONGEST_DELAY:
        raise top.wrong("delay", f"allowed is 0 s to {LONGEST_DELAY:g} s.")
    return delay


def _remarks(top: Fields) -> tuple[str, ...]:
    value = top.table.get("remarks", [])
    if not isinstance(value, list) or not all(isinstance(x, str) for x in value):
        raise top.wrong("remarks", "write a list of texts.")
    return tuple(value)


def _test(
    row: Any, i: int, folder: Path, crane: Crane, mapping: Mapping[str, Signal] | None, modes: Mapping[str, Mode]
) -> CraneTest:
    name = Fields(row, f"test {i + 1}: ", ValidateError).text("name", str(i + 1))
    test = Fields(row, f'test "{name}": ', ValidateError)
    test.refuse_unknown(TEST)
    test.need("log", "kind")
    kind = test.text("kind")
    if kind not in list(Kind):
        raise test.wrong("kind", f"not one of {', '.join(Kind)}.")
    load, payload = (_mass(test, key, crane) for key in ("load", "payload"))
    hook = _hook(test)
    L_full, s_w = drum_record(crane).L_full, test.quantity("s_w", "length")
    if s_w is not None and not 0.0 <= s_w <= L_full:
        raise test.wrong("s_w", f'"{crane.name}" has 0 m to {show(L_full, "length")} of wire.')
    start, end = test.quantity("start", "time", -math.inf), test.quantity("end", "time", math.inf)
    assert start is not None
    assert end is not None
    if not start < end:
        raise test.wrong("end", f"must come after start {start:g} s.")
    log_mapping = mapping_from(row["signals"], f'test "{name}": signals') if "signals" in row else mapping
    _two_columns(log_mapping, f'test "{name}": ')
    log_mapping, meaning = with_modes(log_mapping, modes)
    return CraneTest(
        name=name,
        log=test.file("log", folder),
        kind=Kind(kind),
        load=load,
        mode=_mode(test, Kind(kind)),
        s_w=s_w,
        water=_water(test, payload if load is None else load, crane),
        mapping=log_mapping,
        start=start,
        end=end,
        modes=meaning,
        payload=payload,
        hook=hook,
    )


def _mass(test: Fields, key: str, crane: Crane) -> float | None:
    mass = test.quantity(key, "mass")
    if mass is not None and not 0.0 <= mass <= crane.SWL:
        raise test.wrong(key, f'"{crane.name}" is rated for 0 t to {show(crane.SWL, "mass")}. Check the {key}.')
    return mass


def _hook(test: Fields) -> HookDepth | None:
    """Depth of the hook, with a payload and never with a load. Errors: ValidateError."""
    hook, key = hook_depth(test), "depth" if "depth" in test else "h_tip"
    if "payload" in test and "load" in test:
        raise ValidateError(
            f"{test.place}load and payload: both stated. load includes the weight of the wire out, payload does not."
            " State"
            " one of them."
        )
    if "payload" in test and hook is None:
        raise ValidateError(
            f"{test.place}payload: needs depth or h_tip for the weight of the wire out. State one of them, or"
            " load including the wire."
        )
    if hook is not None and "load" in test:
        raise ValidateError(
            f"{test.place}load with {key}: load already includes the weight of the wire out. "
            "State payload (mass suspended from the hook), or leave depth and h_tip out."
        )
    if hook is not None and "payload" not in test:
        raise ValidateError(f"{test.place}{key}: stated without payload. State payload (mass suspended from the hook).")
    return hook


def _two_columns(mapping: Mapping[str, Signal] | None, place: str) -> None:
    """Refuse wire out or the PLC's error mapped as the tip: the winch would compensate without any error."""
    rows = [mapping[name] for name in TIP_AND_WIRE if name in mapping] if mapping is not None else []
    for i, b in enumerate(rows):
        for a in rows[:i]:
            if a.column == b.column:
                both = f"{place}signals: {a.name} and {b.name} both refer to column {quote(a.column)}."
                raise ValidateError(f"{both} Map each to its own column, or leave one out.")


def _mode(test: Fields, kind: Kind) -> Mode | None:
    if "mode" not in test:
        return None
    text = test.text("mode")
    if text not in list(Mode):
        raise test.wrong("mode", f"not one of {', '.join(Mode)}.")
    if kind is Kind.AHC and Mode(text) is MANUAL_MODE:
        raise test.wrong("mode", 'a test of kind "ahc" needs a compensating mode. State that mode, or another kind.')
    return Mode(text)


def _water(test: Fields, load: float | None, crane: Crane) -> Water | None:
    if "water" not in test:
        return None
    inside = Fields(test.table["water"], f"{test.place}water: ", ValidateError)
    inside.refuse_unknown(tuple(Water.model_fields))
    try:
        water = Water(**inside.table)
    except StillhookError as e:
        raise ValidateError(f"{test.place}{e}") from None
    if load is not None and water.rho * water.volume > load + crane.hook_mass:
        raise inside.wrong("volume", f"a payload of {show(load, 'mass')} floats. Check load and volume.")
    return water
