"""`stillhook envelope`: highest wire speed at each load, and the governing limit."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import Controllers, CraneArgument, Json, Out, check_out, present, write_out
from stillhook.report.formatting import argument, cell, change, display_number, wrapped
from stillhook.report.terminal import Answer, Line, columns, print_table, progress_bar, twin_lines

if TYPE_CHECKING:
    import xarray

    from stillhook.analysis.controllers import Controller
    from stillhook.spec.crane import Crane

OUT_FILES = ("range.png", "settings.png", "layers.png", "envelope.nc", "settings.nc", "envelope.json")
SHARES = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
"""Loads that are reported without --loads, over the SWL."""
LAYERS_SHARES = (0.6, 1.0)
"""Loads of the picture by layer, over the SWL."""


def envelope(
    name: CraneArgument,
    layer: Annotated[
        int | None, typer.Option(help="Layer in use, counted from the bare drum; the outermost if left out.")
    ] = None,
    load: Annotated[
        list[str] | None,
        typer.Option(
            "--loads", help='Payloads, "90 t, 120 t" or "0 t to 100 t by 20 t". Without them 0 to the SWL by 20 %.'
        ),
    ] = None,
    controllers: Controllers = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Highest steady wire speed of each mode by load, and the limit that stops it. Exit code 1 if no mode may be used
    at a load.

    Pump flow, relief pressure, torque in reserve and motor speeds of the complete plant, while compensating (paper C
    figure 4).

    Example: stillhook envelope nov-150t --loads "90 t, 120 t" --controllers ns,hs,ssc,ssc-cubic --out envelope
    """
    from stillhook.analysis.axes import quantities
    from stillhook.analysis.controllers import controllers as named_controllers
    from stillhook.analysis.controllers import usual_controllers
    from stillhook.analysis.steady.envelope import envelope_at
    from stillhook.library import load_crane

    crane = load_crane(name)
    chosen = named_controllers(controllers or usual_controllers(crane))
    named = [x for text in load or () for x in quantities(text, "mass", "--loads", percent_of=crane.SWL)]
    loads = list(dict.fromkeys(named)) or [f * crane.SWL for f in SHARES]
    check_out(out, OUT_FILES)
    layers = None if layer is None else [layer]
    with progress_bar(crane.name) as bar:
        data = envelope_at(crane, loads, modes=chosen, layers=layers, progress=bar)
    table = rows(data)
    answer = _answer(crane, data, table)
    present(answer, brief=lambda: _answer_lines(crane, data, table), json=json)
    if out is not None:
        _write(out, crane, chosen, layer, answer, quiet=json)
    if any(all(math.isnan(r["v_w_top"]) for r in table if r["load"] == x and r["mode"] != "physical") for x in loads):
        raise typer.Exit(1)


def rows(data: xarray.Dataset) -> list[dict[str, Any]]:
    """One dictionary a load, layer and mode, of the slower direction, in SI."""
    table = []
    for k, load in enumerate(data["load"].values):
        for j, layer in enumerate(data["layer"].values):
            for i, mode in enumerate(data["mode"].values):
                n = _slower(data["v_w_top"].values[i, j, k])
                names = [v for v in ("v_w_top", "binds", *list(_SHOWN)[1:]) if v in data]
                numbers = {v: (str if v == "binds" else float)(data[v].values[i, j, k, n]) for v in names}
                place = {
                    "load": float(load),
                    "layer": int(layer),
                    "mode": str(mode),
                    "direction": str(data["direction"].values[n]),
                }
                table.append(place | numbers | _gains(data, float(load), int(layer), str(mode)))
    return table


def _slower(both: Any) -> int:
    """Which direction is the slower one; one in which the mode may not be used counts first."""
    return min(range(len(both)), key=lambda n: -1.0 if math.isnan(both[n]) else both[n])


def _gains(data: xarray.Dataset, load: float, layer: int, mode: str) -> dict[str, float]:
    """By how much a mode is faster than the requested classic ones, in the slower direction each."""
    from stillhook.control.registry import CLASSIC

    available = [str(m) for m in data["mode"].values]
    if mode in CLASSIC:
        return {}
    v = data["v_w_top"].sel(load=load, layer=layer).min("direction", skipna=False)
    return {f"gain_over_{c}": float(v.sel(mode=mode) / v.sel(mode=c) - 1.0) for c in CLASSIC if c in available}


def _answer(crane: Crane, data: xarray.Dataset, table: list[dict[str, Any]]) -> dict[str, Any]:
    """What --json prints and envelope.json holds."""
    places = [
        {"load": float(load), "layer": int(layer)}
        | {v: float(data[v].sel(load=load, layer=layer)) for v in _BY_LOAD if v in data}
        for load in data["load"].values
        for layer in data["layer"].values
    ]
    most = {str(m): float(x) for m, x in zip(data["mode"].values, data["load_most"].values, strict=True)}
    from stillhook.engine.certificate import twin_line

    return {
        "twin": twin_line(crane),
        **({"reserve": data.attrs["reserve"]} if "reserve" in data.attrs else {}),
        "load_most": most,
        "loads": places,
        "notes": _type_notes(data),
        "rows": table,
    }


_BY_LOAD = ("alpha_least", "alpha_reserve", "alpha_pm_hold", "v_w_power", "v_w_power_rule")


def _answer_lines(crane: Crane, data: xarray.Dataset, table: list[dict[str, Any]]) -> Answer:
    """Highest wire speed of each load and controller, and what binds."""
    gains = [g for g in ("gain_over_ns", "gain_over_hs") if any(g in r for r in table)]
    shown = {name: title for name, title in _SHOWN.items() if name in data}
    head = ["load", "mode", "governing", *shown.values(), *(f"over {g[-2:].upper()}" for g in gains)]
    rows, before = [], None
    for r in table:
        load = f"{display_number('load', r['load'], 4)} t" if r["load"] != before else ""
        before = r["load"]
        label = "machine limit" if r["mode"] == "physical" else r["mode"]
        numbers = [*(cell(n, r[n]) for n in shown), *(change(r.get(g, math.nan)) for g in gains)]
        rows.append([load, label, r["binds"], *numbers])
    short = [[load, label, speed, binds] for load, label, binds, speed, *_ in rows]
    basis = "Compensating, the slower of hoisting and lowering; losses of the winch included. -: the mode may not be"
    lines: list[Line] = [
        *_type_notes(data),
        *columns(["load", "controller", "speed", "governing"], short, left=(0, 1, 3)),
        partial(print_table, head, rows, left=3),
        partial(wrapped, f"{basis} used at this load."),
        *twin_lines(crane),
    ]
    title = f"{crane.name}: highest steady wire speed in compensation, layer {int(data['layer'].values[0])}"
    more = f"motors, pumps, pressure, gains over NS and HS in {len(table)} rows"
    step = f"stillhook map {argument(crane.name)}, for the control error over load and speed"
    return Answer(f"{title} of {crane.drum.layers}", lines, step, more)


def _type_notes(data: xarray.Dataset) -> list[str]:
    """Notes of the winch type for these loads."""
    return [note for note in str(data.attrs["notes"]).split("; ") if note]


_SHOWN = {
    "v_w_top": "speed",
    "alpha_m_top": "motors",
    "alpha_p_top": "pumps",
    "dp_m_top": "pressure drop",
    "omega_m_top": "motor speed",
}
"""Numbers of the table, where the winch type has them, with the head of each column."""


def _write(
    out: Path, crane: Crane, chosen: list[Controller], layer: int | None, answer: dict[str, Any], *, quiet: bool
) -> None:
    from stillhook.analysis.steady import figures
    from stillhook.analysis.steady.envelope import LOADS, envelope_at, setting_curves

    with progress_bar("pictures") as bar:
        fine = envelope_at(
            crane, [f * crane.SWL for f in LOADS], modes=chosen, layers=None if layer is None else [layer], progress=bar
        )
        loads, every = [f * crane.SWL for f in LAYERS_SHARES], range(1, crane.drum.layers + 1)
        by_layer = envelope_at(crane, loads, modes=chosen, layers=every, progress=bar)
    closed = crane.plant.type.steady_operation
    curves = setting_curves(crane, modes=chosen, layer=layer) if closed else None

    def pictures() -> dict[str, Any]:
        setting = None if curves is None else figures.setting_figure(curves)
        made = (figures.load_speed_figure(fine), setting, figures.layer_figure(by_layer))
        return {name: figure for name, figure in zip(OUT_FILES, made, strict=False) if figure is not None}

    files = dict(zip(OUT_FILES[3:], (fine, curves, answer), strict=True))
    written = {name: file for name, file in files.items() if file is not None}
    write_out(out, written, pictures=pictures, quiet=quiet, cranes=[crane])
