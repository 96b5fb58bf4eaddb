"""Margins out of the running engine: those of the closed circuit come out as its own linearisation has them, and a
winch beyond its limit swings in a run."""

from __future__ import annotations

import numpy as np
import pytest

from stillhook import load_crane
from stillhook.analysis.loop_stability.differences import step_of
from stillhook.analysis.loop_stability.engine_loop import REMEMBERED, engine_linear, engine_loop, engine_points
from stillhook.analysis.loop_stability.governing import place_limits
from stillhook.analysis.loop_stability.margins import gain_limit_of
from stillhook.analysis.loop_stability.places import Place, places_of
from stillhook.control.registry import Mode
from stillhook.kernels.lanes import flatten, unflatten
from stillhook.winches.records import Tip

OF_ITS_OWN = 0.01
"""Gain limit of the engine over that at the exact operating point [-]: the run has settled to 1 % of its speed, and the
accumulator has moved from mid stroke."""
OF_A_CYCLE = 0.02
"""What a cycle of the engine may differ from that of the linear loop [-]: the bristle is split from the rest, half a step off."""
STEPS = 40


@pytest.mark.parametrize("mode", [Mode.NS, Mode.SSC])
@pytest.mark.parametrize("name", ["nov-100t-pure-active", "nov-250t"])
def test_a_closed_circuit_has_the_same_limit_as_by_its_own_linearisation(name: str, mode: Mode) -> None:
    crane = load_crane(name)
    places = places_of((0.0, 0.5 * crane.SWL), (100.0,), (20.0 / 60.0,))
    for place, point in zip(places, engine_points(crane, mode, places), strict=True):
        (own,) = place_limits(crane, mode, [place])
        assert point is not None
        assert own.loop is not None
        limit, omega = gain_limit_of(engine_loop(point))
        theirs, omega_own = gain_limit_of(own.loop)
        assert limit == pytest.approx(theirs, rel=OF_ITS_OWN)
        assert omega == pytest.approx(omega_own, rel=OF_ITS_OWN)


def test_a_delay_lowers_the_limit_of_a_drive_without_resonance() -> None:
    crane = load_crane("nov-100t-electric")
    places = [Place(0.0, 100.0, 2.0 / 60.0)]
    prompt, late = (place_limits(crane, Mode.POSITION, places, delay=delay)[0].gains.high for delay in (0.0, 0.1))
    assert late < prompt


@pytest.mark.parametrize("name", ["nov-250t-secondary", "utility-20t-open-circuit"])
def test_one_cycle_of_the_linear_loop_is_that_of_the_engine(name: str) -> None:
    """The engine stepped through a PLC cycle, its commands a cycle late, and the memory of what the drive filters: each
    state moved a little. A filter that is forgotten, or a command that comes at once, would show here: of the drop over a valve, of the
    load fed ahead."""
    crane = load_crane(name)
    (point,) = engine_points(crane, Mode.POSITION, [Place(0.5 * crane.SWL, 100.0, 2.0 / 60.0)])
    assert point is not None
    loop, linear = engine_loop(point), engine_linear(point)
    n, m = len(linear.states), len(linear.commands)
    assert loop.n == 1
    at_held = n + REMEMBERED.index("held")
    start = np.array(flatten(point.state))

    def cycle(x: np.ndarray, held: float) -> tuple[np.ndarray, float, np.ndarray]:
        state = unflatten(type(point.state), (float(v) for v in x))
        memory = point.memory._replace(held=held)
        u, memory, _, _ = point.driver.control(
            state, memory, point.laws, point.tick, point.tip, point.geometry, point.params
        )
        s, v = point.tip
        h = crane.control.t_cycle / STEPS
        for i in range(STEPS):
            ways = (Tip(s + v * (i + c) * h, v) for c in (0.0, 0.5, 1.0))
            state = point.driver.step(state, point.command, point.geometry, *ways, point.params, h)
        return np.array(flatten(state)), memory.held, np.array(u)

    for j, name_j in enumerate(linear.states):
        if name_j in ("s_w", "s_load", "z") or name_j.startswith(("V_", "E", "theta")):
            continue  # what stands while the loop is judged, and the bristle, which the engine takes half a step off
        h = step_of(name_j, start[j])
        up, down = start.copy(), start.copy()
        up[j] += h
        down[j] -= h
        (x_1, held_1, u_1), (x_0, held_0, u_0) = cycle(up, point.memory.held), cycle(down, point.memory.held)
        moved = (x_1 - x_0) / (2.0 * h)
        scale = np.abs(moved) + 1e-3 * np.max(np.abs(moved))
        fast = [i for i, s in enumerate(linear.states) if s not in ("z", "s_w", "s_load")]
        stands = [i for i in fast if linear.states[i].startswith(("V_", "E", "theta"))]
        keep = [i for i in fast if i not in stands]
        assert np.max(np.abs(moved - loop.Phi[:n, j])[keep] / scale[keep]) < OF_A_CYCLE
        assert loop.Phi[at_held, j] == pytest.approx((held_1 - held_0) / (2.0 * h), rel=OF_A_CYCLE, abs=1e-6)
        told = (u_1 - u_0) / (2.0 * h)
        assert loop.Phi[-m:, j] == pytest.approx(told, rel=OF_A_CYCLE, abs=1e-9 + 1e-6 * np.max(np.abs(told)))


@pytest.mark.slow
@pytest.mark.parametrize("v_tip", [0.6239, -0.6239, 0.7071])
def test_a_fast_place_is_steady_where_its_run_is_no_whole_number_of_cycles(v_tip):
    """The run ends with a cycle; the tip was taken to be where it is some milliseconds later, which pulled at the load
    with 0.5 of the tip's speed a second."""
    (point,) = engine_points(load_crane("nov-100t-electric"), Mode.POSITION, [(9570.0, 510.1, v_tip, 0.0)])
    rates = point.driver.rates(point.state, point.command, point.geometry, point.tip, point.params).path
    assert abs(rates.v_load / v_tip) < 0.02
