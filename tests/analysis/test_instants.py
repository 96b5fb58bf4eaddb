"""Equations at many instants in one compiled call: the numbers of the plain functions, one by one, and the bristle's
rate as its own equation has it."""

from __future__ import annotations

import numpy as np
import pytest

from stillhook import load_crane
from stillhook.analysis.loop_stability.differences import cycles_at, numbers_of, rates_at
from stillhook.analysis.loop_stability.engine_loop import EnginePoint, engine_points
from stillhook.analysis.loop_stability.places import Place
from stillhook.kernels.build import equations
from stillhook.kernels.drivers.equations import equations_of
from stillhook.kernels.lanes import flatten, unflatten
from stillhook.physics.friction import bristle_rate
from stillhook.winches.records import Tip

CRANES = {
    "nov-250t": "ssc",
    "nov-100t-pure-active": "ssc",
    "nov-250t-secondary": "position",
    "nov-100t-cylinder": "position",
    "nov-100t-electric": "position",
    "utility-20t-open-circuit": "position",
}
EXPONENTIAL = 1e-12
"""Of the largest rate of a state over the instants: the compiled exponential is a polynomial, off by 1e-14."""
ROUNDING = 1e-9
"""Of a bristle's rate: it is small beside the two terms that it is the difference of, where the winch slides."""


@pytest.fixture(scope="module", params=CRANES, ids=CRANES)
def point(request: pytest.FixtureRequest) -> EnginePoint:
    crane = load_crane(request.param)
    mode = type(crane.plant.type.default_mode)(CRANES[request.param])
    (found,) = engine_points(crane, mode, [Place(0.5 * crane.SWL, 100.0, 10.0 / 60.0)])
    assert found is not None
    return found


def around(start: np.ndarray) -> np.ndarray:
    """Instants about one: each number off by up to a hundredth of itself."""
    rng = np.random.default_rng(1)
    return start * (1.0 + 0.01 * rng.uniform(-1.0, 1.0, (40, len(start))))


def test_rates_are_those_of_the_driver(point: EnginePoint) -> None:
    records = (point.state, point.command, point.tip, point.geometry, point.params)
    n = len(flatten(point.state)) + len(point.command) + 2
    rows = around(np.array(numbers_of(records))[:n])
    got = rates_at(point.driver, records, range(n))(rows)
    for row, values in zip(rows.tolist(), got, strict=True):
        of_state, rest = row[: -2 - len(point.command)], row[-2 - len(point.command) :]
        x = unflatten(type(point.state), iter(of_state))
        u, tip = type(point.command)(*rest[:-2]), Tip(*rest[-2:])
        rates = point.driver.rates(x, u, point.geometry, tip, point.params)
        if "z" in x.winch._fields:
            c = point.plant.circuit(
                x.winch, point.driver.path_point(x, point.geometry, tip, point.params), u, point.geometry, point.params
            )
            v, bristle = (
                (x.winch.v_rod, point.params.cylinder.bristle)
                if hasattr(x.winch, "v_rod")
                else (x.winch.omega_m, point.params.hoist.bristle)
            )
            z_dot = bristle_rate(v, x.winch.z, c.g, c.held, bristle)
            at = type(x)._fields.index("winch"), x.winch._fields.index("z")
            assert at[0] == 0
            assert values[at[1]] == pytest.approx(z_dot, rel=ROUNDING, abs=ROUNDING * abs(v))
            rates = rates._replace(winch=rates.winch._replace(z=float(values[at[1]])))
        np.testing.assert_allclose(values, flatten(rates), rtol=EXPONENTIAL, atol=EXPONENTIAL * np.abs(got).max())


def test_cycles_are_those_of_the_driver(point: EnginePoint) -> None:
    before = (point.state, point.memory, point.laws, point.tick, point.tip, point.geometry, point.params)
    n = len(flatten(point.state))
    rows = around(np.array(numbers_of(before))[:n])
    got = cycles_at(point.driver, before, range(n))(rows)
    for row, values in zip(rows.tolist(), got, strict=True):
        x = unflatten(type(point.state), iter(row))
        u, m, laws, _ = point.driver.control(x, *before[1:])
        np.testing.assert_allclose(values, flatten((u, m, laws)), rtol=EXPONENTIAL, atol=EXPONENTIAL)


def test_the_same_functions_run_as_plain_python(point: EnginePoint) -> None:
    """What is left where no compiler is installed."""
    records = (point.state, point.command, point.tip, point.geometry, point.params)
    S, out = np.array(numbers_of(records)), np.empty(equations(point.driver).RATES)
    equations_of(point.driver).rates_at(S, out, 1)
    compiled = np.empty_like(out)
    equations(point.driver).rates_at(S, compiled, 1)
    np.testing.assert_allclose(out, compiled, rtol=EXPONENTIAL, atol=EXPONENTIAL * np.abs(out).max())
