"""Running text on a terminal: folded to its width, unfolded in a file or a pipe."""

from __future__ import annotations

import re
import shutil
import sys
import textwrap

NARROW, WIDE = 60, 120
"""Columns of running text: not fewer, not more."""
GLUE = "\u00a0"
"""Represents a space at which no line is folded."""


def wrapped(text: str, indent: str = "") -> None:
    """Running text, folded to the terminal, no unit parted from its number; in a file or a pipe every line stays
    one."""
    if sys.stdout.isatty():
        width = min(max(shutil.get_terminal_size().columns - 1, NARROW), WIDE)
        result = re.sub(r"(?<=[0-9]) (?=[^0-9\s]{1,3}(?:[^\w]|$)|[LNkm][ /a-z])", GLUE, text)
        result = textwrap.fill(result, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
        text = result.replace(GLUE, " ")
    print(text)
