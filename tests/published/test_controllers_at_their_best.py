"""The stored settings of the page on controllers at their best: still inside the limits, and still the best of their neighbourhood."""

import pytest
from tests.scripts import PAGES, script

from stillhook.analysis.tuning.objective import Limits, capacity_of, gain_allowed, scored
from stillhook.analysis.tuning.parameters import present, space, with_settings
from stillhook.engine.simulate import run_cases

page = script(PAGES / "controllers_at_their_best.py")

ASIDE = 0.05
"""Part of a setting's range by which it is moved alone [-]."""
FLAT = 0.03
"""What a step aside may still gain on the score [-]: the search is not exact, and the optimum is flat."""


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["ns", "ssc"])
def test_no_step_aside_in_any_setting_gains_and_limits_are_kept(name: str):
    plain = page.controller(name)
    tuned = page.best(name).on(page.CRANE)
    settings = [s for s in space(page.CRANE, plain.mode) if s.name not in ("alpha_min", "alpha_ns")]
    at, n = present(tuned), len(page.CASES)
    points = [{s.name: at[s.name] + way * ASIDE * (s.high - s.low)} for s in settings for way in (-1.0, 1.0)]
    inside = [p for p in points if all(s.low <= p.get(s.name, s.low) <= s.high for s in settings)]
    cranes = [page.CRANE, tuned, *(with_settings(tuned, p) for p in inside)]
    found = run_cases(
        [c for c in cranes for _ in range(n)], [c.with_mode(plain.mode) for c in page.CASES] * len(cranes)
    )
    limits = Limits(v_w_capacity=min(capacity_of(page.CRANE, plain.mode, page.CASES)))
    start, best, *others = [
        scored(c, plain.mode, page.CASES, found[i * n : (i + 1) * n], limits) for i, c in enumerate(cranes)
    ]
    assert best.broken == ()
    assert tuned.control.K_p <= gain_allowed(tuned, plain.mode, limits)

    def score(s) -> float:
        return 0.5 * s.e_c_pp_mean / start.e_c_pp_mean + 0.5 * s.p_max / start.p_max

    kept = [score(s) for s in others if not s.broken]
    assert len(kept) >= len(settings)
    assert min(kept) > score(best) - FLAT
    assert max(kept) > score(best)
