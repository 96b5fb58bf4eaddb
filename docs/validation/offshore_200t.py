"""Thesis section 2.7.2, 200 t offshore in a calm sea: SSC stands at full displacement, the classic controller below
it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import causes
import numpy as np
import xarray
from batch import Numbers, side_by_side
from blocks import Blocks, save

from stillhook import Crane, Scenario, Sine, load_crane
from stillhook.engine.pack.winch import gains
from stillhook.library import changed
from stillhook.report.plots.run import four_panels
from stillhook.thesis.offshore import HEIGHT, PERIOD, TESTS, runs_200t
from stillhook.thesis.offshore import case as case_of

SLOW_PAGE = True
CRANE = load_crane("nov-250t")
PERIODS = (6.0, 8.0, 10.0, 12.0, 14.0)  # s
U_THR, U_THR_100T = 0.6, 0.3
OPEN_LOOP = {"active": {"motor": {"variant": "open-loop-feedback"}}}
STEEL = {
    "volume": "25.5 m^3",
    "added_mass": "26 t",
    "C_D": 1.5,
    "area": "8 m^2",
}  # 7850 kg/m^3; added mass of its own volume
SLIGHTLY = 15.0  # %: what "slightly lower" is taken for here
STILL_FULL = 0.995  # displacement from which motors count as full


class Row(NamedTuple):
    """One variant: what is changed in the crane and in the scenario; period of the sine [s]."""

    label: str
    changes: Mapping[str, Any] = {}
    period: float = PERIOD
    more: Mapping[str, Any] = {}

    def crane(self) -> Crane:
        return changed(CRANE, self.changes) if self.changes else CRANE


K_2 = gains(CRANE).K_2
OVER_PERIODS = tuple(Row(f"{T:g} s", period=T) for T in PERIODS)
BASE = OVER_PERIODS[PERIODS.index(PERIOD)]
OPEN = Row("motors in open loop with feedback, as on this crane", OPEN_LOOP)
ROWS = (
    Row("**as above, 10 s**"),
    OPEN,
    Row("open loop, 6 s", OPEN_LOOP, 6.0),
    Row("NS at 0.70", {"control": {"alpha_ns": 0.7, "alpha_swl": 0.8}}),
    Row("NS at 0.90", {"control": {"alpha_ns": 0.9, "alpha_swl": 0.8}}),
    Row("NS at 0.95", {"control": {"alpha_ns": 0.95, "alpha_swl": 0.8}}),
    Row("HS at 0.60 (not allowed above 60 % of the SWL)", {"control": {"alpha_ns": 0.6, "alpha_swl": 0.8}}),
    Row("`u_thr` 0.3, as in the test with 100 t, 10 s", {"control": {"u_thr": U_THR_100T}}),
    Row("`u_thr` 0.3, 6 s", {"control": {"u_thr": U_THR_100T}}, 6.0),
    Row("friction of crane 1", {"friction": {"library": "crane-1"}}),
    Row("friction of L4593", {"friction": {"library": "L4593"}}),
    Row("`K_2` none", {"control": {"K_2": "0 s^2/m"}}),
    Row("`K_2` doubled", {"control": {"K_2": f"{2.0 * K_2} s^2/m"}}),
    Row("500 m of wire out", more={"s_w": "500 m"}),
    Row("1500 m of wire out", more={"s_w": "1500 m"}),
    Row("steel in water, 500 m of wire out", more={"s_w": "500 m", "water": STEEL}),
)


class Pair(NamedTuple):
    """NS and SSC in the same sea."""

    ns: Numbers
    ssc: Numbers


def case(row: Row, mode: str) -> Scenario:
    return case_of("200 t", Sine.from_si(0.5 * HEIGHT, row.period), mode, row.more)


def pairs(rows: Sequence[Row]) -> list[Pair]:
    runs = side_by_side([(row.crane(), case(row, mode)) for row in rows for mode in ("ns", "ssc")])
    return [Pair(*runs[2 * i : 2 * i + 2]) for i in range(len(rows))]


def above_boost(one: Numbers) -> float:
    return one["p_a_max"] - CRANE.active.boost.p


def pressure(p: Pair) -> float:
    """SSC over NS, above boost."""
    return above_boost(p.ssc) / above_boost(p.ns)


def over_period(row: Row, p: Pair, damped: Pair) -> dict[str, Any]:
    v = np.pi * HEIGHT / row.period
    return locals()


def variant(row: Row, p: Pair) -> dict[str, Any]:
    return locals()


def shortest_period(u_thr: float) -> float:
    """Period below which 1 m peak-to-peak would move the motors that follow their command [s]."""
    return np.pi * HEIGHT * gains(CRANE).K_1 / u_thr


def claims(found: Sequence[Pair], open_loop: Pair, damped: Sequence[Pair]) -> dict[str, Any]:
    """Numbers of the claims; damped: found with the wire's damping of paper C."""
    full = all(p.ssc["alpha_m_min"] > STILL_FULL for p in found)
    off, off_damped = ([1.0 - pressure(p) for p in one] for one in (found, damped))
    size = "by more than slightly" if 100.0 * min(off) > SLIGHTLY else "for most periods by more than slightly"
    base = found[PERIODS.index(PERIOD)]
    return locals()


GROUPS = {
    "NS at": "NS",
    "HS at": "NS",
    "friction of": "friction",
    "`K_2`": "K_2",
    "500 m": "depth",
    "1500 m": "depth",
    "steel": "depth",
}


def alternatives() -> list[causes.Alternative]:
    """Every row as a setting that may be otherwise, and the other periods."""
    out = [
        causes.varied(f"period {T:g} s", tip=Sine.from_si(0.5 * HEIGHT, T), group="period")
        for T in PERIODS
        if T != PERIOD
    ]
    for row in ROWS[1:]:
        if row.period == PERIOD:
            group = next((g for begin, g in GROUPS.items() if row.label.startswith(begin)), "")
            only = ("ns",) if group == "NS" else ()
            out.append(causes.varied(row.label, row.changes, only=only, more=row.more, group=group))
    return out


def off(r: Mapping[str, Numbers]) -> float:
    """How far SSC is below NS, above boost [%]."""
    return 100.0 * (1.0 - above_boost(r["ssc"]) / above_boost(r["ns"]))


FIGURES = (
    causes.Figure("`alpha_m` of SSC", lambda r: r["ssc"]["alpha_m_min"], STILL_FULL, digits=3, printed="full"),
    causes.Figure(
        "pressure above boost, SSC below NS",
        off,
        0.0,
        SLIGHTLY,
        unit="%",
        digits=0,
        printed=f"slightly: at most {SLIGHTLY:g}",
    ),
    causes.lower("ssc", "ns", "e_c_pp", "error, SSC below NS", "no claim"),
)


def attribution() -> causes.Attribution:
    return causes.attribute({mode: (CRANE, case(BASE, mode)) for mode in ("ns", "ssc")}, FIGURES, alternatives())


def compute() -> tuple[Blocks, dict[str, xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    over_damped = [row._replace(changes={"wire": causes.WIRE}) for row in OVER_PERIODS]
    everything, n = pairs((*OVER_PERIODS, *over_damped, *ROWS)), len(PERIODS)
    found, damped, varied = everything[:n], everything[n : 2 * n], everything[2 * n :]
    told = claims(found, varied[ROWS.index(OPEN)], damped)
    blocks = {
        "causes": causes.block(attribution()),
        "claims": told,
        "periods": [over_period(*one) for one in zip(OVER_PERIODS, found, damped, strict=True)],
        "sensitivity": [variant(row, p) for row, p in zip(ROWS, varied, strict=True)],
    }
    runs = dict(runs_200t())
    blocks["notes"] = causes.notes(runs)
    return blocks, runs


def draw(runs: Mapping[str, xarray.Dataset]) -> None:
    title = "nov-250t, 200 t, 100 m of wire, tip 1 m peak-to-peak with 10 s"
    start, end = TESTS["200 t"].window
    save(four_panels(runs, title=title, start=start, end=end), "offshore-200t.png")
