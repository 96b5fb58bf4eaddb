"""Thesis table 2.8 test 4: the feedforward gains K_1 and K_2 varied, for NS, HS and SSC, without and with a late motion
signal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import causes
import numpy as np
from batch import side_by_side
from blocks import Blocks
from numpy.typing import NDArray

from stillhook import Scenario, load_crane
from stillhook.analysis.steady.steady_state import reduction_lead
from stillhook.engine.pack.winch import gains, wire_speed_max
from stillhook.library import changed
from stillhook.thesis.quay import sine

SLOW_PAGE = True
CRANE = load_crane("nov-250t")
IDEAL = gains(CRANE)
PRINTED = 0.68  # s/m: paper E table 2
K_1S = (PRINTED / IDEAL.K_1, 0.90, 0.95, 0.975, 1.0, 1.025, 1.05, 1.10)  # of the ideal
K_2S = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0)  # of the derived
MODES = ("ns", "hs", "ssc")
DELAY = 0.1  # s: of the motion signal
SPEED, PERIOD = 60.0, 12.0  # m/min, s
CM = 100.0
FloatArray = NDArray[np.float64]


ASKED: dict[str, Any] = {"load": "100 t", "s_w": "100 m", "warm_up": "40 s", "duration": "82 s"}
USUAL = {"speed": SPEED, "period": PERIOD, "K_1s": (0.975, 1.0, 1.025, 1.05), "K_2s": (1.0, 1.5, 2.0, 2.5)}
"""What a variant looks at unless it says otherwise: sine [m/min, s], and gains over the ideal ones."""
BASE = causes.Variant("", own={"K_1s": K_1S, "K_2s": K_2S})
LATE = BASE._replace(more={"sensors": {"delay": f"{DELAY} s"}})
ROWS = causes.variants(globals())


def late(row: causes.Variant) -> float:
    """Delay of the motion signal [s]."""
    return float(row.more.get("sensors", {"delay": "0 s"})["delay"].split()[0])


def errors(row: causes.Variant) -> dict[str, FloatArray]:
    """Control error peak-to-peak over K_1 and K_2 for every mode [cm]."""
    base, of = row.on(CRANE), USUAL | row.own
    pairs = [(a * IDEAL.K_1, b * IDEAL.K_2) for a in of["K_1s"] for b in of["K_2s"]]
    made = [changed(base, {"control": {"K_1": f"{K_1!r} s/m", "K_2": f"{K_2!r} s^2/m"}}) for K_1, K_2 in pairs]
    tip = sine(of["period"], of["speed"] / 60.0)
    cases = [Scenario(tip=tip, mode=mode, **ASKED | row.more) for mode in MODES]
    found = side_by_side([(crane, case) for case in cases for crane in made])
    each = np.array([CM * one["e_c_pp"] for one in found]).reshape(len(MODES), len(of["K_1s"]), len(of["K_2s"]))
    return dict(zip(MODES, each, strict=True))


class Best(NamedTuple):
    """Gains of the least error, as parts of the ideal ones, and that error and the one at the ideal gains [cm]."""

    K_1: float
    K_2: float
    error: float
    ideal: float


def best(row: causes.Variant, e: FloatArray) -> Best:
    """The lowest of the computed points."""
    K_1s, K_2s = ((USUAL | row.own)[name] for name in ("K_1s", "K_2s"))
    i, j = np.unravel_index(int(np.argmin(e)), e.shape)
    return Best(K_1s[i], K_2s[j], float(e[i, j]), float(e[K_1s.index(1.0), K_2s.index(1.0)]))


MEASURED = 20.0  # cm: paper E scenario 2 measured less than 10 with SSC and some 20 with HS
V_MEASURED = 89.0  # m/min: there, as fast as NS
LOOKED_AT = (0.95, 0.975, 1.0, 1.025, 1.05, 1.10)  # K_1 of the ideal
LEADS = (0.5, 1.0, 1.5, 2.0, 2.5)  # K_2 of the derived


def setting(row: causes.Variant) -> causes.Alternative:
    """A row as a setting that may be otherwise; gains stay those of the run, speed and load those of the measurement,
    if there is one."""
    of, delay = USUAL | row.own, late(row)
    tip = sine(of["period"], of["speed"] / 60.0) if (of["speed"], of["period"]) != (SPEED, PERIOD) else None
    sensors = {k: x for k, x in row.more.items() if k == "sensors"}
    group = "control" if "open loop" in row.label else "delay" if delay else "wave" if tip is not None else ""
    there = sine(of["period"], V_MEASURED / 60.0) if of["period"] != PERIOD else None

    def change(runs: causes.Runs) -> causes.Runs:
        others = [name for name in runs if name != "printed"]
        changed_ = causes.varied(row.label, row.changes, tip=tip, more=row.more, only=others).change(runs)
        return causes.varied(row.label, row.changes, tip=there, more=sensors, only=("printed",)).change(changed_)

    return causes.Alternative(row.label, change, group)


def attribution() -> causes.Attribution:
    """What the error with the printed K_1 and the places of the least error of SSC depend on, one change at a time."""
    case = Scenario(tip=sine(PERIOD, SPEED / 60.0), mode="ssc", **ASKED)
    quay = ASKED | {"load": "0 t", "s_w": "15 m"}
    measured = Scenario(tip=sine(PERIOD, V_MEASURED / 60.0), mode="ssc", **quay)

    def at(k_1: float, k_2: float) -> causes.Pair:
        return (
            changed(CRANE, {"control": {"K_1": f"{k_1 * IDEAL.K_1!r} s/m", "K_2": f"{k_2 * IDEAL.K_2!r} s^2/m"}}),
            case,
        )

    runs = (
        {"printed": (at(PRINTED / IDEAL.K_1, 1.0)[0], measured)}
        | {f"K_1 {k:g}": at(k, 1.0) for k in LOOKED_AT}
        | {f"K_2 {k:g}": at(1.025, k) for k in LEADS}
    )

    tried = [setting(r) for r in ROWS[1:] if r.label != "the same, 6 s"]
    return causes.attribute(runs, causes.figures(globals()), tried, pairs=False)


def lag_asked(delay: float) -> float:
    """K_2 over its derived value that leads for pump servo, half a PLC cycle, computing time and delay of the signal
    [-]."""
    servo = CRANE.active.pump.servo
    T_p = 2.0 * servo.zeta / servo.omega_n
    return (T_p + 0.5 * CRANE.control.t_cycle + CRANE.control.computing + delay) / T_p


def missing_speed(k: float, alpha_m: float) -> float:
    """Error peak-to-peak that K_1 of k times the ideal leaves to the position loop: integrator and K_p alone, fully
    moving [cm]."""
    w, v, back = 2.0 * np.pi / PERIOD, SPEED / 60.0, IDEAL.K_p / (IDEAL.K_1 * alpha_m)
    return 2.0 * CM * abs(1.0 - k) * v / float(np.hypot(w, back))


def grid_rows(e: Mapping[str, FloatArray]) -> list[tuple[object, ...]]:
    """Errors at K_2 derived over K_1, in one table for all modes [cm]."""
    i_2 = K_2S.index(1.0)
    return [(f"{mode.upper()}, over `K_1`", *(f"{x:.1f}" for x in e[mode][:, i_2])) for mode in MODES]


def over_K_2(e: Mapping[str, FloatArray], delay: str) -> list[tuple[object, ...]]:
    i_1 = K_1S.index(1.0)
    return [(f"{mode.upper()}, {delay}", *(f"{x:.1f}" for x in e[mode][i_1])) for mode in MODES]


def variant(row: causes.Variant) -> tuple[object, ...]:
    found = {mode: best(row, e) for mode, e in errors(row).items()}
    cells = [(f"{b.K_1:g}, {b.K_2:g}", f"{b.ideal:.1f}", f"{b.error:.1f}") for b in found.values()]
    return (row.label, f"{lag_asked(late(row)):.1f}", *(x for cell in cells for x in cell))


def claims(base: Mapping[str, FloatArray], late: Mapping[str, FloatArray]) -> dict[str, Any]:
    """Numbers of the claims."""
    i_2 = K_2S.index(1.0)
    printed, ideal = (", ".join(f"{base[m][i, i_2]:.0f} cm {m.upper()}" for m in MODES) for i in (0, K_1S.index(1.0)))
    tops = {m: (best(BASE, base[m]), best(LATE, late[m])) for m in MODES}
    lead = [
        reduction_lead(c, 110.0 / 60.0, 6.0) for c in (changed(CRANE, {"control": {"K_1": f"{PRINTED} s/m"}}), CRANE)
    ]
    K_1 = {m: now.K_1 for m, (now, _) in tops.items()}
    return locals()


def compute() -> tuple[Blocks, None]:
    """Blocks of the page and its claims."""
    base, late = errors(BASE), errors(LATE)
    told = claims(base, late)
    estimate = ("estimate of the missing speed, SSC", *(f"{missing_speed(k, 1.0):.1f}" for k in K_1S))
    blocks = {
        "causes": causes.block(attribution()),
        "claims": told,
        "printed": {"v_max": 60.0 * wire_speed_max(CRANE)},
        "over-k1": [*grid_rows(base), estimate],
        "over-k2": [*over_K_2(base, "no delay"), *over_K_2(late, "0.1 s late")],
        "sensitivity": [variant(r) for r in ROWS],
    }
    return blocks, None
