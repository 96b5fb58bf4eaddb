"""MAT of version 5: `time` and a vector for each name, `units` beside, of several cases a struct for each."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.formats.out.table import Content, Table

SUFFIX, TITLE = ".mat", "MATLAB"
LONGEST = 63
"""Letters in a name."""


def write(content: Content, file: Path) -> None:
    """Write a file."""
    from scipy.io import savemat

    tables = content.tables
    data: dict[str, Any] = {}
    if len(tables) == 1:
        data |= _vectors(tables[0])
    else:
        data |= {_name(t.name, i): _vectors(t) for i, t in enumerate(tables)}
        data["cases"] = np.array([t.name for t in tables], dtype=object)
    data["units"] = {_name(c.name, k): c.unit for k, c in enumerate(tables[0].columns)}
    data["facts"] = {_name(n, 0): text for n, text in content.facts.items()}
    data |= {_name(n, 0): np.array(values, dtype=object) for n, values in content.texts.items()}
    with file.open("wb") as stream:
        savemat(stream, data, long_field_names=True, oned_as="column")


def _vectors(table: Table) -> dict[str, Any]:
    return {_name(c.name, k): c.values for k, c in enumerate(table.columns)}


def _name(text: str, i: int) -> str:
    """A name of MATLAB's."""
    name = re.sub(r"\W", "_", text)[:LONGEST]
    return name if re.match(r"[A-Za-z]", name) else f"case_{i}_{name}"[:LONGEST]
