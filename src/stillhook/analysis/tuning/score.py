"""How a set of settings scores: error and pressure over the scenarios, and which limits it breaks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from stillhook.analysis.loop_stability.governing import WIRES, Governing, governing
from stillhook.analysis.loop_stability.margins import Margins, margins
from stillhook.analysis.steady.steady_state import speed_limit
from stillhook.analysis.tuning.objective import PERIODS, WEIGHTS, Limits, Objective, peak_sine
from stillhook.engine.scenario.checks import layer_diameter_at
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Scenario
from stillhook.units import parse, show

OURS = ("saturated", "relief", "overspeed", "cavitation", "slack", "unstable", "uncompensated", "audit", "diverged")
"""Parts of a status that a controller is to blame for: what load and motion do to wire and accumulator is none of its
business."""
SHARES_OF_FASTEST = (0.95, 0.9, 0.85, 0.8, 0.7, 0.6)
"""Peak speeds of the fast runs, as parts of the speed with the pumps full: the first that the start manages is asked of
all settings."""
NEAR = 0.01
"""Part by which a limit may be missed and still counts as active."""


class Score(NamedTuple):
    """Result of settings: score objective over that of the start [-]; mean and largest error [m], highest pressure [Pa]
    over the scenarios; per scenario e_c_pp [m], p_max [Pa] and u_p_max [-]; least v_w_capacity [m/s]; broken: the
    limits that are not kept, worst first.
    """

    score: float
    e_c_pp_mean: float
    e_c_pp_worst: float
    p_max: float
    e_c_pp: tuple[float, ...]
    pressures: tuple[float, ...]
    u_p_max: float
    v_w_capacity: float
    broken: tuple[str, ...]


class Fast(NamedTuple):
    """A fast run that tuned settings must manage as the start does: scenario, and what of `OURS` came up in the start's
    run."""

    case: Scenario
    allowed: frozenset[str]


def fast_candidates(crane: Crane, mode: Mode, like: Scenario) -> list[list[Scenario]]:
    """Runs at parts of the speed with the pumps full, fastest first, for each default period; lightest load, wire and
    sensors as in `like`.

    A speed that only a constant speed reaches is no speed capacity: the motors of SSC need time to stroke.
    """
    load = 0.0 if crane.hook_mass > 0.0 else like.load
    v = speed_limit(crane, mode, load) * layer_diameter_at(crane, like.s_w) / crane.drum.d_max
    plain = like.model_copy(update={"load": load, "mode": mode})
    return [
        [plain.model_copy(update={"tip": peak_sine(part * v, parse(T, "time"))}) for part in SHARES_OF_FASTEST]
        for T in PERIODS
    ]


def attributed_limits(status: str) -> frozenset[str]:
    """Parts of a status that the controller causes."""
    return frozenset(status.split(", ")) & frozenset(OURS)


def scored(
    crane: Crane,
    mode: Mode,
    cases: Sequence[Scenario],
    results: Sequence[Mapping[str, Any]],
    limits: Limits,
    fast: Sequence[Fast] = (),
) -> Score:
    """A set of settings by the summaries of its runs, those of the fast runs last; score is left NaN (see
    `relative`)."""
    results, quick = results[: len(cases)], results[len(cases) :]
    e = tuple(float(s["e_c_pp"]) for s in results)
    p = tuple(float(s["p_max"]) for s in results)
    capacity = capacity_of(crane, mode, cases)
    broken = [*linear_broken(crane, mode, limits, capacity, wires_of(cases))]
    for name in OURS:
        bad = sum(name in str(s["status"]).split(", ") for s in results)
        if bad:
            broken.append(f"{name} in {bad} of {len(results)} scenarios")
    for run, summary in zip(fast, quick, strict=True):
        beyond = attributed_limits(str(summary["status"])) - run.allowed
        if beyond:
            broken.append(f"{', '.join(sorted(beyond))} in a fast run ({run.case.tip.describe()})")
    if not max(p) <= limits.p_max:
        broken.append(f"p_max {show(max(p), 'pressure', 4)} above {show(limits.p_max, 'pressure', 4)}")
    u_p = max(float(s["u_p_max"]) for s in results)
    return Score(
        score=math.nan,
        e_c_pp_mean=float(np.mean(e)),
        e_c_pp_worst=max(e),
        p_max=max(p),
        e_c_pp=e,
        pressures=p,
        u_p_max=u_p,
        v_w_capacity=min(capacity),
        broken=tuple(broken),
    )


def relative(score: Score, start: Score, objective: Objective) -> Score:
    """The score as a part of that of the start."""
    w = WEIGHTS[objective]
    ours, theirs = ((s.e_c_pp_mean, s.e_c_pp_worst, s.p_max) for s in (score, start))
    return score._replace(score=sum(a * x / y for a, x, y in zip(w, ours, theirs, strict=True)))


def capacity_of(crane: Crane, mode: Mode, cases: Sequence[Scenario]) -> list[float]:
    """Speed with the pumps full for every load among the scenarios, on the published diameter [m/s]."""
    return [speed_limit(crane, mode, load) for load in sorted({c.load for c in cases})]


def wires_of(cases: Sequence[Scenario]) -> tuple[float, ...]:
    """Lengths of wire paid out among the scenarios [m]."""
    return tuple(sorted({c.s_w for c in cases}))


def linear_broken(
    crane: Crane, mode: Mode, limits: Limits, capacity: Sequence[float], wires: Sequence[float] = WIRES
) -> list[str]:
    """Margins that the position loop does not keep, and speed that is missing: the criteria that need no run."""
    out = []
    K_p, most = crane.control.K_p, governing_loop(crane, mode, limits, wires)
    if K_p > most.K_p:
        m = margins(most.loop, K_p)
        if m.gain_margin < limits.gain_margin:
            out.append(f"gain margin {m.gain_margin:.3g} below {limits.gain_margin:.3g}")
        if m.phase_margin < limits.phase_margin:
            out.append(
                f"phase margin {math.degrees(m.phase_margin):.3g} deg below {math.degrees(limits.phase_margin):.3g} deg"
            )
        if m.stable and m.sensitivity_peak > limits.sensitivity_peak:
            out.append(f"sensitivity peak {m.sensitivity_peak:.4g} above {limits.sensitivity_peak:.3g}")
        out = out or [
            f"K_p {show(K_p, 'gain_per_length', 4)} above {show(most.K_p, 'gain_per_length', 4)}, which the margins"
            " allow"
        ]
        out[-1] += f" ({most.describe()})"
    wanted = limits.v_w_capacity
    if wanted is not None and min(capacity) < wanted * (1.0 - 1e-6):
        out.append(f"speed capacity {show(min(capacity), 'speed', 4)} below {show(wanted, 'speed', 4)}")
    return out


def governing_loop(crane: Crane, mode: Mode, limits: Limits, wires: Sequence[float] = WIRES) -> Governing:
    """The loop that allows the least gain within the margins, at the loads up to that of the limits and with these
    wires paid out [m]."""
    return governing(crane, mode, limits.margins, wires=wires, load=limits.load)


def loop_margins(crane: Crane, mode: Mode, limits: Limits | None = None, wires: Sequence[float] = WIRES) -> Margins:
    """Margins of the position loop with its PLC where they are least; see `governing_loop`."""
    return margins(governing_loop(crane, mode, limits or Limits(), wires).loop, max(crane.control.K_p, 1e-6))


def gain_allowed(crane: Crane, mode: Mode, limits: Limits, wires: Sequence[float] = WIRES) -> float:
    """Largest K_p that keeps the margins [1/m]; displacements are cut down to whole steps, which is on the safe
    side."""
    return governing_loop(crane, mode, limits, wires).K_p
