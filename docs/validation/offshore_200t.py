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

from stillhook import Scenario, Sine, load_crane
from stillhook.engine.pack.winch import gains
from stillhook.report.plots.run import four_panels
from stillhook.thesis.offshore import HEIGHT, PERIOD, TESTS, runs_200t
from stillhook.thesis.offshore import case as case_of

SLOW_PAGE = True
CRANE = load_crane("nov-250t")
PERIODS = (6.0, 8.0, 10.0, 12.0, 14.0)  # s
U_THR, U_THR_100T = 0.6, 0.3
SLIGHTLY = 15.0  # %: what "slightly lower" is taken for here
STILL_FULL = 0.995  # displacement from which motors count as full


OVER_PERIODS = tuple(causes.Variant(f"{T:g} s", own={"period": T}) for T in PERIODS)
ROWS = causes.variants(globals())
BASE, OPEN = ROWS[:2]


def period(row: causes.Variant) -> float:
    """Of the sine [s]."""
    return float(row.own.get("period", PERIOD))


class Pair(NamedTuple):
    """NS and SSC in the same sea."""

    ns: Numbers
    ssc: Numbers


def case(row: causes.Variant, mode: str) -> Scenario:
    return case_of("200 t", Sine.from_si(0.5 * HEIGHT, period(row)), mode, row.more)


def pairs(rows: Sequence[causes.Variant]) -> list[Pair]:
    runs = side_by_side([(row.on(CRANE, "ns"), case(row, mode)) for row in rows for mode in ("ns", "ssc")])
    return [Pair(*runs[2 * i : 2 * i + 2]) for i in range(len(rows))]


def above_boost(one: Numbers) -> float:
    return one["p_a_max"] - CRANE.active.boost.p


def pressure(p: Pair) -> float:
    """SSC over NS, above boost."""
    return above_boost(p.ssc) / above_boost(p.ns)


def over_period(row: causes.Variant, p: Pair, damped: Pair) -> dict[str, Any]:
    v = np.pi * HEIGHT / period(row)
    return locals()


def variant(row: causes.Variant, p: Pair) -> dict[str, Any]:
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


def alternatives() -> list[causes.Alternative]:
    """The other periods, and every row as settings that may be otherwise."""
    other = [T for T in PERIODS if T != PERIOD]
    waves = [causes.varied(f"period {T:g} s", tip=Sine.from_si(0.5 * HEIGHT, T), group="period") for T in other]
    return [*waves, *(row.alternative() for row in ROWS[1:] if not row.own)]


def attribution() -> causes.Attribution:
    return causes.attribute(
        {mode: (CRANE, case(BASE, mode)) for mode in ("ns", "ssc")}, causes.figures(globals()), alternatives()
    )


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
