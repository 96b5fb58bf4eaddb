"""Which factors a spread comes from: the indices against a function whose indices are known, and on the winch
itself."""

import numpy as np
import pytest

from stillhook import Scenario, load_crane
from stillhook.analysis.uncertainty.draws import Uncertainty, even
from stillhook.analysis.uncertainty.sobol import design, indices, sensitivity
from stillhook.errors import StillhookError
from stillhook.library import changed

CRANE = load_crane("nov-250t")
CASE = Scenario(load="100 t", s_w="100 m", tip="sine 2 m 12 s", duration="32 s", warm_up="20 s")
SAMPLING = 0.03
"""Of an index from 2048 rows; the estimate scatters by about a hundredth."""
FEW = 0.12
"""The same from 64 rows."""


def ishigami(x):
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def test_ishigami_function():
    """Known indices: Ishigami and Homma 1990, a = 7, b = 0.1 on (-pi, pi)."""
    n = 2048
    u = np.pi * (2.0 * even(n, 6, 0) - 1.0)
    plan = design(u[:, :3], u[:, 3:], [[0], [1], [2]])
    found, change = indices(ishigami(plan), 3, n)
    assert [i.first.value for i in found] == pytest.approx([0.3139, 0.4424, 0.0], abs=SAMPLING)
    assert [i.total.value for i in found] == pytest.approx([0.5576, 0.4424, 0.2437], abs=SAMPLING)
    for i, (first, total) in zip(found, [(0.3139, 0.5576), (0.4424, 0.4424), (0.0, 0.2437)], strict=True):
        assert i.first.low - SAMPLING < first < i.first.high + SAMPLING
        assert i.total.low - SAMPLING < total < i.total.high + SAMPLING
    assert change < 2.0 * SAMPLING


def test_numbers_that_hang_together_are_one_group():
    """x and y move as one; f = x + y + z with variances 4 (of 2x) and 1."""
    n = 1024
    u = even(n, 4, 1)
    A, B = (np.column_stack([c[:, 0], c[:, 0], c[:, 1]]) for c in (u[:, :2], u[:, 2:]))
    plan = design(A, B, [[0, 1], [2]])
    found, _ = indices(plan.sum(axis=1), 2, n)
    assert [i.first.value for i in found] == pytest.approx([0.8, 0.2], abs=SAMPLING)


@pytest.mark.thorough
def test_mean_pressure_hangs_on_the_one_factor_that_moves_it():
    """A tenth more or less load moves the largest wire tension in proportion; boost pressure does not move it at
    all."""
    known = Uncertainty.of({"load": {"uniform": [0.9, 1.1]}, "boost": {"uniform": [0.9, 1.1]}, "delay": "0 s"})
    (found,) = sensitivity(CRANE, CASE, known, outputs=["F_w_max"], n=64)
    assert list(found.indices) == ["load", "boost"]  # the fixed delay has no index
    assert found.indices["load"].first.value == pytest.approx(1.0, abs=FEW)
    assert found.indices["boost"].total.value == pytest.approx(0.0, abs=0.01)
    assert found.converged
    assert found.runs == 64 * 4


@pytest.mark.slow
def test_the_same_seed_gives_the_same_indices():
    known = Uncertainty.of({"friction": "default", "leakage": "default"})
    a, b = (sensitivity(CRANE, CASE, known, outputs=["p_max"], n=16, seed=2)[0] for _ in range(2))
    assert a == b


@pytest.mark.thorough
def test_what_a_difference_of_controllers_hangs_on_is_told_of_pairs():
    known = Uncertainty.of({"friction": "default", "motor_servo": "default"})
    cases = [CASE.with_mode(m) for m in ("hs", "ssc")]
    still_load = {
        "wire": {"zeta": 0.95, "zeta_low": 0.95, "zeta_high": 0.95}
    }  # a ringing load would swivel the passive motors
    found = sensitivity(changed(CRANE, still_load), cases, known, outputs=["p_max"], n=64, against="hs")
    assert [s.case for s in found] == ["hs", "ssc", "ssc / hs"]
    one, pair = found[0].indices, found[2].indices
    assert next(iter(one)) == "friction"
    assert one["motor_servo"].total.value < 0.01  # fixed motors do not swivel
    assert pair["motor_servo"].total.value > one["motor_servo"].total.value


@pytest.mark.slow
def test_a_number_that_does_not_vary_has_no_indices():
    (found,) = sensitivity(CRANE, CASE, Uncertainty.of({"boost": "default"}), outputs=["s_tip_pp"], n=16)
    assert found.indices == {}


@pytest.mark.parametrize(
    ("kwargs", "words"),
    [
        ({"n": 100}, "a power of two"),
        ({"n": 8}, "a power of two from 16"),
        ({"outputs": ["e_pp"]}, "not a result of the summary"),
        ({"against": "hs"}, "unknown case. Allowed: ssc"),
        ({"uncertainty": Uncertainty.of({"boost": 1.0})}, "all are fixed"),
    ],
)
def test_what_cannot_be_analysed_is_refused_in_one_line(kwargs, words):
    with pytest.raises(StillhookError, match=words) as caught:
        sensitivity(CRANE, CASE, **{"n": 16} | kwargs)
    assert "\n" not in str(caught.value)
