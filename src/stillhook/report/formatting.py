"""How numbers and running text are written in reports; what has no value is a dash."""

from __future__ import annotations

import math
import re
import shlex
import shutil
import sys
import textwrap
from pathlib import Path
from typing import Any

from stillhook.base.gateway.parse import UNPRINTED
from stillhook.units import KINDS, in_display, number

EMPTY = "-"
HOUR, DAY = 3600.0, 86400.0
SHARES = (
    *("eta_c", "eta_load", "eta_sigma_wire", "eta_sigma_load"),
    *("u_p_max", "alpha_m_min", "alpha_m_top", "alpha_p_top"),
    *("slack_chance", "slack_share", "saturation_share"),
)
"""Variables between 0 and 1 that are written as per cent."""
MOTIONS = (
    *("e_c_pp", "e_c_max", "e_c_mean", "s_tip_pp", "load_pp"),
    *("sigma_u", "u_mpm", "sigma_load", "load_mpm", "sigma_z", "z_mpm"),
)
"""Lengths that are written in millimetres below a metre."""
TIMES = ("saturation_time", "relief_time", "oscillation_time")
"""Durations that are written with two decimals."""
SMALLEST_SHARE = 1e-6
"""Shares below it are written as 0."""


def fmt(value: float | None, kind: str = "", digits: int = 4) -> str:
    """An SI value in the display unit of its kind, one of `stillhook.units.KINDS`; a pure number without a kind."""
    if value is None or math.isnan(value):
        return EMPTY
    return f"{number(in_display(value, kind), digits)} {KINDS[kind].display}" if kind else number(value, digits)


def variable(name: str, value: float | None, digits: int = 4) -> str:
    """A value [SI] of one of `stillhook.variables` in its display unit."""
    return fmt(value, kind_of(name), digits)


def display_number(name: str, value: Any, digits: int = 6) -> str:
    """A variable [SI] in its display unit, without the unit; text as it is."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return str(value)
    kind = kind_of(name)
    return number(in_display(float(value), kind) if kind else float(value), digits)


def display_unit(name: str) -> str:
    """Unit of `display_number`; empty for a pure number."""
    kind = kind_of(name)
    return KINDS[kind].display if kind else ""


def kind_of(name: str) -> str:
    """Kind of a variable; empty for a pure number and for an unknown name."""
    from stillhook.variables import BY_NAME

    return BY_NAME[name].kind if name in BY_NAME else ""


def cell(name: str, value: Any) -> str:
    """A variable in a table of results: shares as per cent, motions below a metre in millimetres; text as it is."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return EMPTY if value is None else str(value)
    if math.isnan(value):
        return EMPTY
    if name in SHARES:
        return percent(value)
    if name in MOTIONS and abs(value) < 1.0:
        return f"{value * 1e3:.1f} mm"
    return f"{value:.2f} s" if name in TIMES else variable(name, value)


def fixed(value: float | None, decimals: int) -> str:
    """A pure number with so many decimals, never a negative zero."""
    return EMPTY if value is None or math.isnan(value) else f"{round(value, decimals) + 0.0:.{decimals}f}"


def percent(part: float | None, digits: int = 3) -> str:
    """A part as per cent with so many significant digits."""
    if part is None or math.isnan(part):
        return EMPTY
    return f"{number(100.0 * part, digits) if abs(part) >= SMALLEST_SHARE else '0'} %"


def percent_fixed(part: float | None, decimals: int = 2) -> str:
    """A part as per cent with so many decimals."""
    return EMPTY if part is None or math.isnan(part) else f"{fixed(100.0 * part, decimals)} %"


def change(part: float | None, decimals: int = 1) -> str:
    """A relative change as per cent, with its sign."""
    return EMPTY if part is None or math.isnan(part) else f"{100.0 * part:+.{decimals}f} %"


def hours(seconds: float | None) -> str:
    """A time in hours."""
    return EMPTY if seconds is None or not math.isfinite(seconds) else f"{number(seconds / HOUR, 3)} h"


def days(seconds: float | None) -> str:
    """A time in days; in hours below one and a half."""
    if seconds is None or not math.isfinite(seconds):
        return EMPTY
    return f"{number(seconds / DAY, 3)} d" if seconds >= 1.5 * DAY else hours(seconds)


def direction(beta: float) -> str:
    """A direction [rad] in whole degrees."""
    return f"{in_display(float(beta), 'angle'):.0f}°"


def typeset(text: str) -> str:
    """A text with plus or minus in one sign."""
    return text.replace("+-", "±")


def counted(n: int, noun: str) -> str:
    """A number of things."""
    return f"{n} {noun}{'' if n == 1 else 's'}"


def groups(digest: object, length: int | None = None) -> str:
    """A hash in groups of four; its first characters only where a length is stated."""
    text = str(digest)[:length]
    return " ".join(text[i : i + 4] for i in range(0, len(text), 4))


NARROW, WIDE = 60, 120
"""Columns of running text: not fewer, not more."""
GLUE = "\u00a0"
"""Represents a space at which no line is folded."""


def plain(text: str) -> str:
    """A text as one line for a terminal, also one out of a foreign file: ends of lines as blanks, signs that command a
    terminal as their codes."""
    return UNPRINTED.sub(lambda sign: sign[0].encode("unicode_escape").decode(), re.sub(r"\s*\n\s*", " ", text))


def argument(name: str | Path) -> str:
    """A name or a path as a word of a command that may be copied into a shell: in quotes where it has blanks or signs
    of one."""
    text = str(name)
    return text if re.fullmatch(r"[\w@%+=:,./\\~-]+", text) else shlex.quote(text)


def wrapped(text: str, indent: str = "") -> None:
    """Running text, folded to the terminal, no unit parted from its number; in a file or a pipe every line stays
    one."""
    text = plain(text)
    if sys.stdout.isatty():
        width = min(max(shutil.get_terminal_size().columns - 1, NARROW), WIDE)
        result = re.sub(r"(?<=[0-9]) (?=[^0-9\s]{1,3}(?:[^\w]|$)|[LNkm][ /a-z])", GLUE, text)
        result = textwrap.fill(result, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
        text = result.replace(GLUE, " ")
    print(text)
