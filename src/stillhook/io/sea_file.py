"""Opens a file of measured waves by its content."""

from __future__ import annotations

import os

from stillhook.io.ndbc import is_spectra, read_spectra, read_states
from stillhook.io.ndbc_directions import has_companions, read_directional
from stillhook.io.ndbc_text import read_records
from stillhook.sea.measured import SpectrumSeries
from stillhook.sea.states import SeaStates


def read_sea(path: str | os.PathLike[str]) -> SpectrumSeries | SeaStates:
    """Spectra where the file holds them, with directions if its four companions lie beside it; else heights, periods and directions.

    Reads what `stillhook.io.ndbc` and `stillhook.io.ndbc_directions` read. Errors: SeaError of one line.
    """
    if has_companions(path):
        return read_directional(path)
    records = read_records(path)
    return read_spectra(records) if is_spectra(records.header) else read_states(records)
