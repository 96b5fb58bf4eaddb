"""Operating range of paper C figure 4 on the 150 t crane, and the setting curves of figure 2.17 (paper E figure 4) on
the 250 t crane."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import causes
import xarray
from blocks import Blocks, save

from stillhook import Crane, Scenario, load_crane
from stillhook.analysis.steady.envelope import envelope, setting_curves
from stillhook.analysis.steady.figures import layer_figure
from stillhook.analysis.steady.limits import Direction, Station, Top
from stillhook.analysis.steady.steady_state import speed_limit, steady, wire_out_on
from stillhook.engine.pack.winch import wire_speed_max
from stillhook.spec.scenario import Mode
from stillhook.thesis.control import HS_LOAD, operating_range, settings

SLOW_PAGE = True
C150, E250 = load_crane("nov-150t"), load_crane("nov-250t")
ABOVE = tuple(1e3 * t for t in (90.1, 100, 105, 110, 115, 120, 130))  # kg
LOADS = tuple(1e3 * t for t in (0, 30, 60, 90, 110, 130, 150))  # kg: rows of the table
PRINTED_HS = 90.0  # m/min
ROWS = causes.variants(globals())


def station(crane: Crane, load: float) -> Station:
    """Hoisting on the outermost layer, which is the slower direction by less than 0.1 %."""
    return Station(crane, load, wire_out_on(crane, crane.drum.layers), Direction.HOISTING)


def top(crane: Crane, mode: str, load: float) -> Top:
    """Highest speed on the outermost layer; mode "" the machine."""
    here = station(crane, load)
    return here.top_of_mode(Mode(mode)) if mode else here.top_of_machine()


def gain(crane: Crane, mode: str, load: float) -> float:
    """Speed over that of NS, less 1."""
    return top(crane, mode, load).v_w / top(crane, "ns", load).v_w - 1.0


def whole_gain(crane: Crane, mode: str) -> tuple[float, float]:
    """Largest gain over NS at loads above 90 t, and the largest load at which nine tenths of it are there [kg]."""
    gains = {load: gain(crane, mode, load) for load in ABOVE}
    most = max(gains.values())
    return most, max(load for load, g in gains.items() if g >= 0.9 * most)


def pumps_at(crane: Crane, mode: str, load: float, v: float) -> float:
    """Pump setting of a mode at a wire speed [-]."""
    here = station(crane, load)
    return abs(here.at(v, here.displacement(Mode(mode))(v)).alpha_p)


def mpm(v: float) -> str:
    return f"{60.0 * v:.1f}"


def tenth(part: float) -> str:
    return f"{100.0 * part:+.1f} %".replace("-", "−")


def claims_c() -> dict[str, Any]:
    """Numbers of the claims."""
    ns, hs, any_ = (top(C150, m, HS_LOAD).v_w for m in ("ns", "hs", ""))
    alpha_hs, d = C150.control.alpha_hs, station(C150, HS_LOAD).winch.geometry.d
    ideal_hs, on_wire = wire_speed_max(C150, alpha_hs), wire_speed_max(C150, alpha_hs, d)
    most, until = whole_gain(C150, "ssc-cubic")
    machine, at_swl = gain(C150, "", ABOVE[0]), gain(C150, "ssc-cubic", C150.SWL)
    pumps = pumps_at(C150, "ssc-cubic", HS_LOAD, hs)
    ideal = C150.control.alpha_ns / C150.active.motor.alpha_min - 1.0
    ratio = C150.control.alpha_hs / C150.control.alpha_ns
    return locals()


def claims_e(curves: xarray.Dataset) -> dict[str, Any]:
    cross = float(curves["v_w_cross_ideal"].sel(mode="ssc", classic="ns"))
    plant = float(curves["v_w_cross"].sel(mode="ssc", classic="ns"))
    v_ns, v_hs, v_ssc = (speed_limit(E250, m) for m in (Mode.NS, Mode.HS, Mode.SSC))
    empty = {m: top(E250, m, 0.0).v_w for m in ("ns", "hs", "ssc")}
    left = 1.0 - steady(E250, v_ns, Mode.SSC).u_p
    left_plant = 1.0 - pumps_at(E250, "ssc", 0.0, empty["ns"])
    return locals()


MODES = ("ns", "hs", "ssc", "ssc-cubic")
HEAVY = ABOVE[0]


def load_rows(crane: Crane) -> list[dict[str, Any]]:
    """Highest speed of every mode by load [m/min], what binds the machine, and the least displacement of SSC."""
    return [
        {"load": m, "modes": [top(crane, x, m) for x in MODES], "any_": top(crane, "", m), "here": station(crane, m)}
        for m in LOADS
    ]


def variant(row: causes.Variant) -> dict[str, Any]:
    crane = row.on(C150)
    return {"row": row, "crane": crane, "tops": [top(crane, m, HS_LOAD).v_w for m in MODES]}


def speeds(pairs: Sequence[causes.Pair]) -> list[dict[str, float]]:
    """What each crane does at a steady speed: HS with 90 t [m/min], cubic SSC's gain over NS above 90 t and its pumps
    at that of HS [%]."""
    out = []
    for crane, _ in pairs:
        hs = top(crane, "hs", HS_LOAD).v_w
        pumps = pumps_at(crane, "ssc-cubic", HS_LOAD, hs)
        out.append({"hs": 60.0 * hs, "gain": 100.0 * gain(crane, "ssc-cubic", ABOVE[0]), "pumps": 100.0 * pumps})
    return out


def attribution() -> causes.Attribution:
    """What the printed speeds depend on, one change at a time: a steady speed has no tip, no delay and no servo."""
    runs = {"crane": (C150, Scenario(load="90 t", s_w="100 m", duration="60 s"))}
    tried = [row.alternative() for row in ROWS[1:]]
    return causes.attribute(runs, causes.figures(globals()), tried, pairs=False, evaluate=speeds)


def compute() -> tuple[Blocks, dict[str, Any]]:
    """Blocks of the page, its claims, and what the pictures show."""
    curves = setting_curves(E250, modes=("ns", "hs", "ssc", "ssc-cubic"))
    found = claims_c() | claims_e(curves)
    blocks = {
        "causes": causes.block(attribution()),
        "claims": found,
        "loads": load_rows(C150),
        "sensitivity": [variant(r) for r in ROWS],
    }
    return blocks, {"curves": curves}


def draw(results: Mapping[str, Any]) -> None:
    save(operating_range().figure(), "paper-c-envelope.png")
    save(settings(results["curves"]).figure(), "paper-e-settings.png")
    layers = envelope(C150, layers=range(1, C150.drum.layers + 1), loads=[f"{x!r} kg" for x in (HS_LOAD, C150.SWL)])
    save(layer_figure(layers), "paper-c-envelope-layers.png")
