"""Thesis section 2.7.2, 100 t offshore: the speed of the tip that 100 cm^3/rev at u_thr 0.3 tells of, and SSC against
NS there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import causes
import numpy as np
import xarray
from batch import Numbers, side_by_side, sine
from blocks import Blocks, Table, save
from scipy.optimize import brentq

from stillhook import Crane, load_crane
from stillhook.analysis.steady.steady_state import motor_law
from stillhook.engine.pack.winch import gains
from stillhook.library import changed
from stillhook.report.plots.run import four_panels
from stillhook.sea.motion.motion import Motion
from stillhook.spec.scenario import Mode
from stillhook.thesis.offshore import D_M, PERIOD, REDUCTION, SWELL_AND_ROLL, TESTS, U_THR, case, runs_100t, wave
from stillhook.thesis.offshore import with_threshold as at

SLOW_PAGE = True
CRANE = load_crane("nov-250t")
U_THR_USUAL = 0.6
OPEN_LOOP = {"active": {"motor": {"variant": "open-loop-feedback"}}}
SPEEDS = np.linspace(25.0, 60.0, 8) / 60.0  # m/s
IRREGULAR = ((1.0, 13.0), (0.8, 11.0), (0.7, 9.4), (0.5, 8.1), (0.3, 7.0))
STEEL = {
    "volume": "12.7 m^3",
    "added_mass": "13 t",
    "C_D": 1.5,
    "area": "5 m^2",
}  # 7850 kg/m^3; added mass of its own volume


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


class Row(NamedTuple):
    """One variant: what is changed in the crane and in the scenario, and the wave for a given peak speed."""

    label: str
    changes: Mapping[str, Any] = {}
    parts: Sequence[tuple[float, float]] = ((1.0, PERIOD),)
    more: Mapping[str, Any] = {}

    def tip(self, v: float) -> Motion:
        return (
            sine(v, self.parts[0][1]) if len(self.parts) == 1 else wave(self.parts, v, phase=2.0, start=40.0, end=118.0)
        )

    def crane(self, u_thr: float = U_THR_USUAL) -> Crane:
        return at(changed(CRANE, self.changes) if self.changes else CRANE, u_thr)


K_2 = gains(CRANE).K_2
BASE = Row("**one sine, 10 s**")
TWO_SINES = Row("13 s and 6 s, 2 : 0.5", parts=SWELL_AND_ROLL)
OPEN = Row("motors in open loop with feedback, as on this crane", OPEN_LOOP)
ROWS = (
    BASE,
    Row("6 s", parts=((1.0, 6.0),)),
    Row("8 s", parts=((1.0, 8.0),)),
    Row("14 s", parts=((1.0, 14.0),)),
    TWO_SINES,
    Row("irregular, five sines from 7 to 13 s", parts=IRREGULAR),
    OPEN,
    Row("open loop, 13 s and 6 s", OPEN_LOOP, SWELL_AND_ROLL),
    Row("NS at 0.70", {"control": {"alpha_ns": 0.7, "alpha_swl": 0.8}}),
    Row("NS at 0.90", {"control": {"alpha_ns": 0.9, "alpha_swl": 0.8}}),
    Row("smallest displacement of SSC 0.70", {"active": {"motor": {"alpha_min": 0.7}}, "control": {"alpha_hs": 0.7}}),
    Row("friction of crane 1", {"friction": {"library": "crane-1"}}),
    Row("friction of L4593", {"friction": {"library": "L4593"}}),
    Row("`K_2` none", {"control": {"K_2": "0 s^2/m"}}),
    Row("`K_2` doubled", {"control": {"K_2": f"{2.0 * K_2} s^2/m"}}),
    Row("500 m of wire out", more={"s_w": "500 m"}),
    Row("1500 m of wire out", more={"s_w": "1500 m"}),
    Row("steel in water, 500 m of wire out", more={"s_w": "500 m", "water": STEEL}),
)


def speeds_found(rows: Sequence[Row]) -> list[float]:
    """Peak speed of the tip with which the whole plant takes 100 cm^3/rev off the motors, u_thr 0.3 [m/s]."""
    runs = side_by_side(
        [(row.crane(U_THR), case("100 t", row.tip(v), "ssc", row.more)) for row in rows for v in SPEEDS]
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


def compared(rows: Sequence[Row], speeds: Sequence[float]) -> list[Compared]:
    modes = (("ns", U_THR_USUAL), ("ssc", U_THR_USUAL), ("ssc", U_THR))
    asked = [
        (row.crane(u_thr), case("100 t", row.tip(v), mode, row.more))
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


def sensitivity(rows: Sequence[Row], found: Sequence[Compared]) -> list[dict[str, Any]]:
    return [{"c": c, "row": row} for row, c in zip(rows, found, strict=True)]


def claims(base: Compared, open_loop: Compared) -> dict[str, Any]:
    """Numbers of the claims."""
    v = [60.0 * speed_read(r) for r in READINGS]
    limit = [60.0 * speed_triggered(r) for r in READINGS]
    quiet = all(D_M * (1.0 - c.usual["alpha_m_min"]) < 1.0 for c in (base, open_loop))
    lower = all(pressure(c) < 0.0 for c in (base, open_loop))
    return locals()


GROUPS = {
    "motors in open loop": "motor control",
    "NS at": "NS",
    "friction of": "friction",
    "`K_2`": "K_2",
    "500 m": "depth",
    "1500 m": "depth",
    "steel": "depth",
}


def alternatives(v: float) -> list[causes.Alternative]:
    """Every row as a setting that may be otherwise, with a tip as fast as the first row's [m/s]."""
    out = []
    for row in ROWS[1:]:
        if row.parts != BASE.parts and not row.changes:
            out.append(causes.varied(f"tip: {row.label}", tip=row.tip(v), group="tip"))
        elif row.parts == BASE.parts:
            group = next((g for begin, g in GROUPS.items() if row.label.startswith(begin)), "")
            out.append(causes.varied(row.label, row.changes, more=row.more, group=group))
    return out


def off(r: Mapping[str, Numbers]) -> float:
    """How far SSC with 0.3 is below NS, above boost [%]."""
    return 100.0 * (1.0 - above_boost(r["ssc"]) / above_boost(r["ns"]))


FIGURES = (
    causes.Figure(
        "off the motors at 0.3",
        lambda r: D_M * (1.0 - r["ssc"]["alpha_m_min"]),
        90.0,
        110.0,
        unit="cm³/rev",
        digits=0,
        printed="about 100",
    ),
    causes.Figure(
        "off at 0.6",
        lambda r: D_M * (1.0 - r["usual"]["alpha_m_min"]),
        most=1.0,
        unit="cm³/rev",
        digits=0,
        printed="none",
    ),
    causes.Figure("pressure above boost, SSC below NS", off, 0.0, unit="%", digits=0, printed="lower"),
    causes.lower("ssc", "ns", "e_c_pp", "error, SSC below NS", "lower"),
)


def attribution(v: float) -> causes.Attribution:
    """What the figures depend on, at the tip's peak speed [m/s] with which SSC takes 100 cm^3/rev off the motors."""
    tip = BASE.tip(v)
    runs = {
        "ns": (BASE.crane(), case("100 t", tip, "ns")),
        "usual": (BASE.crane(), case("100 t", tip, "ssc")),
        "ssc": (BASE.crane(U_THR), case("100 t", tip, "ssc")),
    }
    return causes.attribute(runs, FIGURES, alternatives(v))


def compute() -> tuple[Blocks, dict[str, xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    found = compared(ROWS, speeds_found(ROWS))
    by_label = dict(zip((r.label for r in ROWS), found, strict=True))
    told = claims(by_label[BASE.label], by_label[OPEN.label])
    readings = [{"r": r} for r in READINGS]
    heights = readings
    blocks = {
        "causes": causes.block(attribution(found[0].v)),
        "claims": told,
        "readings": readings,
        "bound": ({}),
        "heights": Table(("tip's highest speed", *(f"{T} s" for T in (6, 8, 10, 12, 14))), heights),
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
