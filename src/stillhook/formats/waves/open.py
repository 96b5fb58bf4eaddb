"""Opens a file of measured waves by its content."""

from __future__ import annotations

import os
from dataclasses import replace

from stillhook.errors import SeaError
from stillhook.formats.waves.ndbc.directions import companions, has_companions, missing_companions, read_directional
from stillhook.formats.waves.ndbc.spectra import is_spectra, read_spectra, read_states
from stillhook.formats.waves.ndbc.text import read_records
from stillhook.formats.waves.wavespectra import read_wavespectra
from stillhook.library.toml.kinds import toml_instead
from stillhook.sea.spectra.measured import SeaStates, SpectrumSeries


def read_sea(
    path: str | os.PathLike[str], form: str | None = None, point: int | None = None
) -> SpectrumSeries | SeaStates:
    """Spectra where the file holds them, with directions if its four companions are next to it; else heights, periods
    and directions.

    Reads what `stillhook.formats.waves.ndbc.spectra` and `stillhook.formats.waves.ndbc.directions` read; with form, one
    of `wave_bridge.FORMATS`, what `stillhook.formats.waves.wavespectra` reads, at one point of it. Errors: SeaError of
    one line.
    """
    if line := toml_instead(path, "a file of measured waves"):
        raise SeaError(line)
    if form is not None:
        return read_wavespectra(path, form, point)
    if point is not None:
        raise SeaError("--point: belongs to --format. Leave it out for files of NDBC, which hold one place.")
    if has_companions(path):
        return read_directional(path)
    records = read_records(path)
    if not is_spectra(records.header):
        return read_states(records)
    series, missing = read_spectra(records), missing_companions(path) or ()
    if 0 < len(missing) < len(companions(path)):
        series = replace(
            series, notes=(*series.notes, f"no directions: {' and '.join(missing)} are missing next to the others")
        )
    return series
