"""`stillhook sea`: what a wave spectrum, or a file of measured ones, holds."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import Json, Out, check_out, present, refuse
from stillhook.errors import SeaError
from stillhook.report.formatting import display_number, display_unit, variable
from stillhook.report.terminal import Answer, Cells, Line, columns, print_table, print_values

if TYPE_CHECKING:
    from stillhook.sea.spectra.measured import SeaStates, SpectrumSeries
    from stillhook.sea.spectra.spectrum import WaveSpectrum

OUT_FILES = ("sea.png", "sea.json")
OF_SPECTRUM = ("H_m0", "T_p", "T_m01", "T_m02", "T_e")
OF_STATES = ("H_m0", "T_p", "T_m02", "come_from")
MOMENTS = ("m_0", "m_1", "m_2", "m_3", "m_4")
WAVES_HELP = (
    'Waves such as "jonswap Hs=2 m Tp=8 s gamma=3.3" (also pm, torsethaugen, ochi-hubble, sums with " + "), or a file'
    " of measured or hindcast spectra: NDBC (gz too), NetCDF of ERA5, WW3, SWAN and wavespectra, Spotter."
)
RECORD_HELP = "One record of a file in place of all: its number from 0, or its time such as 1996-01-05T12:00 (UTC)."

FORMAT_HELP = (
    "Format of a file of spectra, where its content does not show it: era5, ww3, swan, ncswan, ndbc (NetCDF), spotter,"
    ' octopus, triaxys (by the library wavespectra, extra "sea") or wavespectra.'
)


def sea(
    waves: Annotated[str, typer.Argument(help=WAVES_HELP, metavar="WAVES|FILE")],
    record: Annotated[str | None, typer.Option("--record", help=RECORD_HELP)] = None,
    form: Annotated[str | None, typer.Option("--format", help=FORMAT_HELP)] = None,
    point: Annotated[int | None, typer.Option("--point", help="Point of a file that holds several, from 0.")] = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Heights, periods, moments and steepness of waves; of a file, per record and in sum, with the records that are
    missing.

    Files: spectra of NDBC (historical and real-time) and its standard meteorology. Missing records are counted and
    never used.

    Example: stillhook sea "jonswap Hs=2 m Tp=8 s gamma=3.3"

    Example: stillhook sea 46042w1996.txt.gz --json
    """
    from stillhook.sea.spectra.spectrum import WaveSpectrum

    check_out(out, OUT_FILES)
    waves_read = _read_waves(waves, record, form, point)
    answer = _of_spectrum(waves_read) if isinstance(waves_read, WaveSpectrum) else _of_file(waves_read)
    brief = partial(_of_waves if isinstance(waves_read, WaveSpectrum) else _of_records, answer)
    picture, numbers = OUT_FILES

    def pictures() -> dict[str, Any]:
        from stillhook.report.plots.sea import series_figure, spectrum_figure

        draw = spectrum_figure(waves_read) if isinstance(waves_read, WaveSpectrum) else series_figure(waves_read)
        return {picture: draw}

    present(answer, out, {numbers: answer}, brief=brief, json=json, pictures=pictures)


def _read_waves(
    waves: str, record: str | None, form: str | None, point: int | None
) -> WaveSpectrum | SpectrumSeries | SeaStates:
    from stillhook.sea.spectra.measured import SpectrumSeries
    from stillhook.sea.spectra.text import FIELDS, parse_wave

    first = (waves.split() or [""])[0].lower()
    if (
        first in FIELDS
        or not waves.strip()
        or not (Path(waves).exists() or ({".", "/", "\\"} & set(waves) and "=" not in waves))
    ):
        refuse(
            {"--record": record, "--format": form, "--point": point},
            "belongs to a file of measured waves. Leave it out.",
        )
        return parse_wave(waves)
    from stillhook.formats.waves.wavespectra import read_sea

    series = read_sea(waves, form, point)
    if record is None:
        return series
    if not isinstance(series, SpectrumSeries):
        raise SeaError(f"{series.source}: holds heights and periods, no spectra. Leave --record out.")
    return series.spectrum(series.index(record))


def _of_spectrum(wave: Any) -> dict[str, Any]:
    from stillhook.sea.spectra.spectrum import doubts, steepness

    numbers = {"H_m0": wave.H_m0, "T_p": wave.peak_period, "T_m01": wave.T_m01, "T_m02": wave.T_m02, "T_e": wave.T_e}
    moments = {f"m_{n}": wave.moment(n) for n in range(5)}
    steep = {"S_p": steepness(numbers["H_m0"], numbers["T_p"]), "S_s": steepness(numbers["H_m0"], numbers["T_m02"])}
    notes = [*wave.notes(), *doubts(numbers["H_m0"], numbers["T_p"], numbers["T_m02"])]
    return {"waves": wave.describe()} | numbers | moments | {"omega_cut": wave.omega_cut} | steep | {"notes": notes}


def _of_file(series: Any) -> dict[str, Any]:
    import numpy as np

    names = OF_SPECTRUM if hasattr(series, "omega") else OF_STATES
    if getattr(series, "directional", None) is not None:
        names = (*names, "come_from")
    columns = {name: getattr(series, name) for name in names}
    valid = series.valid
    in_sum = {name: _statistics(x, valid, name) for name, x in columns.items()}
    times = np.datetime_as_string(series.time, unit="s")
    per_record = [
        {"time": f"{times[i]}Z", "valid": bool(valid[i])} | {name: float(x[i]) for name, x in columns.items()}
        for i in range(len(times))
    ]
    start = {
        "file": series.source,
        "n_records": len(series),
        "n_valid": series.n_valid,
        "n_missing": len(series) - series.n_valid,
    }
    span = {"start": f"{times[0]}Z", "end": f"{times[-1]}Z"}
    return start | span | in_sum | {"notes": [*series.notes, *_steep(series)], "records": per_record}


def _statistics(x: Any, valid: Any, name: str) -> dict[str, float]:
    """First, mean, least and largest of the valid records that have the number; of directions the first and the mean
    direction."""
    import numpy as np

    valid_values = x[valid & np.isfinite(x)]
    if len(valid_values) == 0:
        return {"first": math.nan, "mean": math.nan}
    first = {"first": float(valid_values[0])}
    if name == "come_from":
        return first | {"mean": float(np.angle(np.mean(np.exp(1j * valid_values)))) % (2.0 * math.pi)}
    return first | {number: float(getattr(valid_values, number)()) for number in ("mean", "min", "max")}


def _steep(series: Any) -> list[str]:
    """A line on records that are above the steepness limit."""
    from stillhook.sea.spectra.spectrum import doubts

    both = zip(series.H_m0, series.T_p, series.T_m02, strict=True)
    many = sum(bool(doubts(float(H), float(T_p), float(T_z))) for H, T_p, T_z in both if H > 0.0)
    return [f"{many} records are above the steepness limit of DNV-RP-C205"] if many else []


def _of_waves(answer: dict[str, Any]) -> Answer:
    """Height, periods and steepness of a sea."""
    text = ", ".join(f"{n} {variable(n, answer[n])}" for n in (*OF_SPECTRUM, "S_p"))
    names = (*OF_SPECTRUM, "S_p", "S_s", *MOMENTS, "omega_cut")
    table = partial(print_values, {name: _value_or_dash(answer[name]) for name in names})
    more = "meanings, moments, cut-off frequency"
    return Answer(answer["waves"], [Cells(f"{text}."), table], more=more, notes=answer["notes"], shown=3)


def _of_records(answer: dict[str, Any]) -> Answer:
    """Heights and periods of a file: first, mean, least and largest."""
    from stillhook.variables import BY_NAME

    rows = []
    for n in (name for name in (*OF_SPECTRUM, "come_from") if name in answer):
        numbers = (answer[n].get(k, math.nan) for k in ("mean", "min", "max", "first"))
        rows.append(
            [n, display_unit(n), *(display_number(n, _value_or_dash(x), 4) for x in numbers), BY_NAME[n].meaning]
        )
    heads = ["", "unit", "mean", "least", "largest"]
    lines: list[Line] = [
        *columns(heads, [row[:5] for row in rows if row[0] != "come_from"], left=(0, 1)),
        partial(print_table, [*heads, "first", "meaning"], rows, left=2, texts=(6,)),
    ]
    records = f"{answer['n_valid']} of {answer['n_records']} records valid"
    title = f"{answer['file']}: {records}, {answer['start'][:10]} to {answer['end'][:10]}"
    return Answer(title, lines, more="first record, meanings", notes=answer["notes"], shown=2)


def _value_or_dash(value: float) -> float | str:
    return "-" if math.isnan(value) else value
