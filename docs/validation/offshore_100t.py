"""Thesis section 2.7.2, 100 t offshore: the speed of the tip that 100 cm^3/rev at u_thr 0.3 tells of, and SSC against
NS there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import causes
import numpy as np
import xarray
from batch import Numbers, side_by_side
from blocks import Blocks, save
from scipy.optimize import brentq

from stillhook import Crane, load_crane
from stillhook.analysis.steady.steady_state import motor_law
from stillhook.engine.pack.winch import gains
from stillhook.report.plots.run import four_panels
from stillhook.sea.motion.motion import Motion
from stillhook.spec.scenario import Mode
from stillhook.thesis.offshore import D_M, PERIOD, REDUCTION, TESTS, U_THR, case, runs_100t, wave
from stillhook.thesis.offshore import with_threshold as at
from stillhook.thesis.quay import sine

SLOW_PAGE = True
CRANE = load_crane("nov-250t")
U_THR_USUAL = 0.6
SPEEDS = np.linspace(25.0, 60.0, 8) / 60.0  # m/s


class Reading(NamedTuple):
    """A reading of figure 2.33: whether the motors had feedback in closed loop or an offset and play, and whether the
    figure shows them."""

    label: str
    lag: float  # of the displacement over the command while the command falls
    measured: bool


MOTOR = CRANE.active.motor
READINGS = (
    Reading("motors follow their command (closed loop)", 0.0, True),
    Reading("open loop; the figure shows the motors", MOTOR.offset + 0.5 * MOTOR.hysteresis, True),
    Reading("open loop; the figure shows the command", MOTOR.offset + 0.5 * MOTOR.hysteresis, False),
)


def speed_for(u_m: float, lag: float, u_thr: float) -> float:
    """Steady speed on the published outer diameter at which SSC commands u_m while the motors stand `lag` above it
    [m/s]."""
    law = motor_law(at(CRANE, u_thr), Mode.SSC)
    u_ff = float(brentq(lambda u: law(u) - u_m, u_thr, 1.0))
    return u_ff / (gains(CRANE).K_1 * min(u_m + lag, 1.0))


def speed_read(r: Reading) -> float:
    """Speed at which the figure shows 100 cm^3/rev with u_thr 0.3 [m/s]."""
    return speed_for(1.0 - REDUCTION / D_M - (r.lag if r.measured else 0.0), r.lag, U_THR)


def speed_triggered(r: Reading) -> float:
    """Speed above which the figure would show any reduction with u_thr 0.6 [m/s]."""
    u_m = 1.0 - (r.lag if r.measured else 0.0)
    return speed_for(u_m, r.lag, U_THR_USUAL) if u_m < 1.0 else U_THR_USUAL / gains(CRANE).K_1


def largest_alpha_min() -> float:
    """Smallest displacement of SSC below which motors that follow show 100 cm^3/rev at 0.3 and nothing at 0.6 [-]:
    linear law, eq. 2.10."""
    alpha_m = 1.0 - REDUCTION / D_M
    k_red = (U_THR_USUAL * alpha_m - U_THR) / (1.0 - U_THR)
    return 1.0 - (1.0 - alpha_m) / k_red


ROWS = causes.variants(globals())
BASE, TWO_SINES, OPEN = (ROWS[i] for i in (0, 4, 6))


def tip_of(row: causes.Variant, v: float) -> Motion:
    """The wave of a variant, with this peak speed [m/s]."""
    parts = row.own.get("parts", [(1.0, PERIOD)])
    return sine(parts[0][1], v) if len(parts) == 1 else wave(parts, v, phase=2.0, start=40.0, end=118.0)


def crane_of(row: causes.Variant, u_thr: float = U_THR_USUAL) -> Crane:
    return at(row.on(CRANE), u_thr)


def speeds_found(rows: Sequence[causes.Variant]) -> list[float]:
    """Peak speed of the tip with which the whole plant takes 100 cm^3/rev off the motors, u_thr 0.3 [m/s]."""
    runs = side_by_side(
        [(crane_of(row, U_THR), case("100 t", tip_of(row, v), "ssc", row.more)) for row in rows for v in SPEEDS]
    )
    n = len(SPEEDS)
    taken = [[D_M * (1.0 - one["alpha_m_min"]) for one in runs[i * n : (i + 1) * n]] for i in range(len(rows))]
    assert all(t[0] < REDUCTION < t[-1] for t in taken), taken
    return [float(np.interp(REDUCTION, t, SPEEDS)) for t in taken]


class Compared(NamedTuple):
    """NS, SSC with 0.6 and SSC with 0.3 at the same tip motion of peak speed v [m/s]."""

    v: float
    ns: Numbers
    usual: Numbers
    ssc: Numbers


def compared(rows: Sequence[causes.Variant], speeds: Sequence[float]) -> list[Compared]:
    modes = (("ns", U_THR_USUAL), ("ssc", U_THR_USUAL), ("ssc", U_THR))
    asked = [
        (crane_of(row, u_thr), case("100 t", tip_of(row, v), mode, row.more))
        for row, v in zip(rows, speeds, strict=True)
        for mode, u_thr in modes
    ]
    runs = side_by_side(asked)
    return [Compared(v, *runs[3 * i : 3 * i + 3]) for i, v in enumerate(speeds)]


def above_boost(one: Numbers) -> float:
    return one["p_a_max"] - CRANE.active.boost.p


def pressure(c: Compared) -> float:
    """SSC with 0.3 against NS, above boost."""
    return above_boost(c.ssc) / above_boost(c.ns) - 1.0


def error(c: Compared) -> float:
    return c.ssc["e_c_pp"] / c.ns["e_c_pp"] - 1.0


def sensitivity(rows: Sequence[causes.Variant], found: Sequence[Compared]) -> list[dict[str, Any]]:
    return [{"c": c, "row": row} for row, c in zip(rows, found, strict=True)]


def claims(base: Compared, open_loop: Compared) -> dict[str, Any]:
    """Numbers of the claims."""
    v = [60.0 * speed_read(r) for r in READINGS]
    limit = [60.0 * speed_triggered(r) for r in READINGS]
    quiet = all(D_M * (1.0 - c.usual["alpha_m_min"]) < 1.0 for c in (base, open_loop))
    lower = all(pressure(c) < 0.0 for c in (base, open_loop))
    return locals()


def alternatives(v: float) -> list[causes.Alternative]:
    """Every row as a setting that may be otherwise, with a tip as fast as the first row's [m/s]."""
    waves = [causes.varied(f"tip: {r.label}", tip=tip_of(r, v), group="tip") for r in ROWS if r.own and not r.changes]
    return [*waves, *(r.alternative() for r in ROWS[1:] if not r.own)]


def attribution(v: float) -> causes.Attribution:
    """What the figures depend on, at the tip's peak speed [m/s] with which SSC takes 100 cm^3/rev off the motors."""
    tip = tip_of(BASE, v)
    runs = {
        "ns": (crane_of(BASE), case("100 t", tip, "ns")),
        "usual": (crane_of(BASE), case("100 t", tip, "ssc")),
        "ssc": (crane_of(BASE, U_THR), case("100 t", tip, "ssc")),
    }
    return causes.attribute(runs, causes.figures(globals()), alternatives(v))


def compute() -> tuple[Blocks, dict[str, xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    found = compared(ROWS, speeds_found(ROWS))
    by_label = dict(zip((r.label for r in ROWS), found, strict=True))
    told = claims(by_label[BASE.label], by_label[OPEN.label])
    readings = [{"r": r} for r in READINGS]
    blocks = {
        "causes": causes.block(attribution(found[0].v)),
        "claims": told,
        "readings": readings,
        "bound": ({}),
        "heights": readings,
        "sensitivity": sensitivity(ROWS, found),
    }
    runs = dict(runs_100t(by_label[TWO_SINES.label].v))
    blocks["notes"] = causes.notes(runs)
    return blocks, runs


def draw(runs: Mapping[str, xarray.Dataset]) -> None:
    start, end = TESTS["100 t"].window
    title = (
        "nov-250t, 100 t, 100 m of wire, swell of 13 s and roll of 6 s, in which SSC with u_thr 0.3 takes 100 cm³/rev"
        " off the motors"
    )
    save(four_panels(runs, title=title, start=start, end=end), "offshore-100t.png")
