"""MDF 4 (asammdf): a channel group for each case, with time master, units and meanings; origin in the header's
comment."""

from __future__ import annotations

import json
from pathlib import Path

from stillhook.base.extras import need
from stillhook.errors import ConvertError
from stillhook.formats.out.table import Content, check_series

SUFFIX, TITLE = ".mf4", "MDF 4"


def write(content: Content, file: Path) -> None:
    """Write a file. Errors: ConvertError without asammdf, and for numbers without a time."""
    check_series(content, TITLE)
    need("asammdf", TITLE, ConvertError)
    from asammdf import MDF, Signal

    made = MDF(version="4.10")
    try:
        for table in content.tables:
            time, *columns = table.columns
            signals = [Signal(c.values, time.values, name=c.name, unit=c.unit, comment=c.meaning) for c in columns]
            made.append(signals, acq_name=table.name or "run", comment=table.name, common_timebase=True)
        made.header.comment = json.dumps({**content.facts, **{k: list(v) for k, v in content.texts.items()}})
        made.save(file, overwrite=True)
    finally:
        made.close()
