"""Paper E's maps of classic control and SSC over load and speed (E6 to E11)."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.analysis.maps.figures import value_figure
from stillhook.analysis.maps.operability import cells_of, map_of
from stillhook.analysis.maps.result import BEST_CLASSIC, Map
from stillhook.analysis.maps.settling import operator_of, settling_of
from stillhook.base.arrays import FloatArray
from stillhook.engine.simulate import simulate
from stillhook.spec.scenario import Scenario
from stillhook.thesis.gallery import Axis, Curve, Drawing, Panel, Printed, Table, over_time
from stillhook.thesis.quay import CRANE
from stillhook.units import in_display
from stillhook.variables import BY_NAME

SWITCH = 81.0
"""Speed that parts slow from fast: "velocities above 80 m/min" [m/min]."""
LOW, AROUND_80 = (0.0, 51.0), (69.0, 81.0)
"""Speeds that are called low, and around 80 m/min."""
FAST = {"up to 80": (0.0, SWITCH), "above": (SWITCH, 999.0)}
CHANGES = {
    "e_c_pp": ("error", "lower and consistent", FAST),
    "p_max": ("peak pressure", "small differences, most above 80 m/min", FAST),
    "settling_time": (
        "settling time",
        "significantly shorter at low speed, better around 80",
        {"up to 50": LOW, "around 80": AROUND_80},
    ),
}
"""Numbers of a map whose change is printed: in words, what is printed, and ranges of speed [m/min]."""
COARSE = "20 % to 100 % by 20 %"
"""Loads at which settling times are drawn in seconds."""


@cache
def waves() -> Map:
    """Control error, pressure and displacement over load and speed, a sine of 12 s."""
    return map_of(CRANE)


@cache
def steps(loads: str = COARSE) -> Map:
    """Settling time and displacement after a step of the speed."""
    return settling_of(CRANE, loads=loads)


def _table(of: Map, name: str) -> Table:
    head = ("controller", "load [kg]", "speed [m/s]", name, "applicable")
    a = of.axes
    rows = [
        (label, load, v, float(of.values[name][k, i, j, 0, 0]), bool(of.applicable[k, i, j, 0, 0]))
        for k, label in enumerate(of.labels)
        for i, load in enumerate(a.loads)
        for j, v in enumerate(a.speeds)
    ]
    return Table(head, rows)


def speeds(of: Map) -> FloatArray:
    """Speeds of a map [m/min]."""
    return 60.0 * np.array(of.axes.speeds)


def cells(of: Map, label: str, a: NDArray[Any]) -> NDArray[Any]:
    """One controller's cells, load by speed."""
    return np.asarray(a[of.labels.index(label)][:, :, 0, 0])


def change(of: Map, name: str, low: float, high: float) -> FloatArray:
    """Changes of SSC against the best classic controller at these speeds [m/min], where both apply [-]."""
    v, part = speeds(of), cells(of, "ssc", of.changes()[name])
    inside = part[:, (v > low) & (v < high)]
    return np.asarray(inside[np.isfinite(inside)])


def value_map(name: str, found: Map | None = None) -> Drawing:
    """A number of the classic controllers, the better of both, and of SSC over load and speed."""
    of_step = name in ("settling_time", "alpha_m_end")
    of = found or (steps() if of_step else waves())
    compared = []
    if name in CHANGES:
        quantity, printed, ends = CHANGES[name]
        medians = [f"{100.0 * float(np.median(change(of, name, *e))):+.0f} % {w} m/min" for w, e in ends.items()]
        words = f"{quantity}, SSC against the better classic mode"
        compared = [Printed(words, printed, f"median {' and '.join(medians)}")]
    coarse = f" Loads {COARSE} of the SWL; finer: stillhook map." if of_step else ""
    return Drawing(
        f"nov-250t: {BY_NAME[name].meaning if name in BY_NAME else name}",
        draw=lambda: value_figure(of, name, labels=(BEST_CLASSIC, "ssc")),
        tables={"data": _table(of, name)},
        printed=compared,
        note=f"Ours: a sine of 12 s, as the profile of figure E6 is not printed.{coarse}",
    )


def profile() -> Drawing:
    """The tip's velocity of a cell of the map (E6)."""
    cells = cells_of(CRANE, ("ssc",))
    t = np.arange(0.0, 30.0, 0.05)
    curve = Curve("highest speed of the map", t, cells.cases[-1].tip.sample(t)[1])
    note = "Ours: a sine of 12 s; the profile itself is not printed."
    return Drawing("Tip velocity", [Panel(Axis("time", "time"), Axis("tip velocity", "speed"), [curve])], note=note)


def settling_test() -> Drawing:
    """A step of the wire speed by 5 m/min and the band in which it has settled (E9)."""
    v, dv = 40.0 / 60.0, 5.0 / 60.0
    case = Scenario(load="150 t", s_w="149 m", mode="ssc", duration="60 s", operator=operator_of(v, dv, False))
    run = simulate(CRANE, case, every="0.02 s")
    moved = np.flatnonzero(np.abs(np.diff(run["v_op"].values)) > 1e-9)
    start = float(run["time"][moved[-1]]) - 3.0
    panel = over_time({"SSC": run}, ("v_w",), start, start + 10.0)
    t, end = panel.curves[0].x, v + dv
    band = [Curve("2 % of the step", t, np.full_like(t, end + k * 0.02 * dv), "--") for k in (1.0, -1.0)]
    wanted = Curve("commanded", t, run.sel(time=slice(start, start + 10.0))["v_op"].values, ":")
    return Drawing(
        f"Step of {in_display(dv, 'speed'):.0f} m/min at {in_display(v, 'speed'):.0f} m/min, 150 t",
        [Panel(panel.x, panel.y, [*panel.curves, wanted, *band])],
        printed=[Printed("tolerance", "2 % of the step, 0.1 m/min", f"{in_display(0.02 * dv, 'speed'):.2g} m/min")],
    )
