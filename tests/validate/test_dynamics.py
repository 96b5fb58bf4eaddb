"""Step 4: turns of a winch whose capacitance, leakage and inertia are known, against the twin."""

import functools
import json
import math
from dataclasses import replace

import pytest

from stillhook.library import crane_toml
from stillhook.library.crane_file import crane_from_toml
from stillhook.spec.crane import effective_inertia
from stillhook.validate.criteria.judge import judge
from stillhook.validate.criteria.results import MEASURES, StepNumber, Verdict
from stillhook.validate.dynamics.check import check_dynamics, tuned_crane
from stillhook.validate.report.figures import turns as figure_of

from .ahc_logs import campaign
from .dynamics_logs import changed, record, signals

pytestmark = pytest.mark.slow

OFF = {"C_h": 0.18, "C_leak": math.log(1.5), "J_m_eff": -0.12}
"""Logarithms by which the crane lies off its file: further than a well-matched one, within what tuning is for."""
BESIDE = {"dry": 0.2, "pump_omega_n": 0.05, "boost": -0.3, "viscous": 0.3}
"""What else differs, and must not bias the three."""
CLOSE = 0.05
"""Asked for by the issue: tuned within 5 % of the truth."""


def checked(*records):  # type: ignore[no-untyped-def]
    return check_dynamics(campaign(*records), records, lambda share: None)


@functools.cache
def off_record():  # type: ignore[no-untyped-def]
    return record(signals(tuple((OFF | BESIDE).items())))


@functools.cache
def off_step():
    return checked(off_record())


def verdicts(step):  # type: ignore[no-untyped-def]
    lines = judge(campaign().criteria, step.measures, (StepNumber.DYNAMICS,))
    return {line.key: line.verdict for line in lines if line.judged}


def in_the_way(step):  # type: ignore[no-untyped-def]
    """Lines in the way of a certificate. Gradients and periods of a dozen swings may stay not shown."""
    return {
        line.key: line.message
        for line in judge(campaign().criteria, step.measures, (StepNumber.DYNAMICS,))
        if line.failed
    }


@pytest.mark.thorough
def test_tuned_numbers_lie_within_five_per_cent_of_the_truth_and_their_intervals_hold_it() -> None:
    for found in off_step().estimates.tuned:
        truth = math.exp(OFF[found.name])
        assert found.known, found.reason
        assert abs(found.factor.value / truth - 1.0) < CLOSE
        assert found.factor.low < truth < found.factor.high


@pytest.mark.long
def test_a_crane_file_with_half_of_the_leakage_missing_fails_and_the_line_says_by_how_much() -> None:
    assert verdicts(off_step())["4-leakage"] is Verdict.REFUTED
    (measure,) = off_step().measures_of("C_leak_error")
    assert measure.value == pytest.approx(0.5, abs=CLOSE * 1.5)


@pytest.mark.thorough
def test_the_tuned_crane_passes_the_same_test_and_its_numbers_name_the_campaign() -> None:
    crane = tuned_crane(off_step().estimates, campaign(off_record()))
    assert crane is not None
    again = crane_from_toml(crane_toml(crane), "tuned.toml")
    assert again == crane
    assert effective_inertia(crane) == pytest.approx(crane.inertia.J_m_eff, rel=1e-3)
    for path in ("active.line.V", "active.pump.leak_scale", "active.motor.C_1", "inertia.J_m_eff", "inertia.J_drum"):
        assert crane.sources[path].kind == "fitted"
        assert "staged" in crane.sources[path].text
    step = check_dynamics(replace(campaign(off_record()), crane=crane), (off_record(),), lambda share: None)
    assert set(verdicts(step).values()) == {Verdict.SHOWN}


@pytest.mark.thorough
def test_tuning_brings_gradients_periods_and_signals_nearer() -> None:
    """Turns from a brake that stays open: one that opens into a turn damps its swing, and too few are left that ring three times."""
    step = checked(record(signals(tuple((OFF | BESIDE).items()), brake=False)))

    def worst(name: str) -> float:
        return max(abs(m.value) for m in step.measures_of(name))

    for name in ("swing_period_error", "swing_damping_error", "dynamics_misfit"):
        assert worst(f"{name}_tuned") < 0.5 * worst(name)


def test_tables_statements_and_data_are_whole_and_plain() -> None:
    step = off_step()
    assert all(len(row) == len(table.header) for table in step.tables for row in table.rows)
    json.dumps(step.to_dict(), allow_nan=False)


def test_the_figure_shows_turns() -> None:
    assert set(figure_of(off_step().estimates, campaign(off_record()))) == {"turns"}


@pytest.mark.thorough
def test_a_well_matched_crane_passes_with_speed_from_the_wire_alone_and_under_a_load_that_is_told() -> None:
    near = signals((("C_h", 0.04), ("C_leak", -0.05), ("J_m_eff", 0.03)), load=2e3, s_w=25.0)
    step = checked(record(near, without=("omega_m", "alpha_m"), load=2e3))
    assert in_the_way(step) == {}
    said = " ".join(step.statements)
    assert 'Test "turns" has 2 t on the hook; paper F requires none' in said
    assert "up to 25 m of wire out; paper F requires less than 20 m" in said


@pytest.mark.thorough
def test_signals_that_do_not_belong_together_tell_nothing() -> None:
    r = record(signals())
    cut = replace(r, segments=(replace(r.segments[0], last=1600),))
    step = checked(changed(cut, p_a=r.signals["p_b"], p_b=r.signals["p_a"]))
    assert not any(f.known for f in step.estimates.tuned)
    assert "inconsistent signals" in step.estimates.tuned[0].reason
    assert verdicts(step)["4-C_h"] is Verdict.NOT_COVERED
    assert tuned_crane(step.estimates, campaign(cut)) is None


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: record(signals(), without=("u_p",)), "has no u_p"),
        (lambda: record(signals(), without=("u_m", "alpha_m")), "has no u_m, nor alpha_m"),
        (lambda: record(signals(), without=("p_a", "p_b")), "has no p_a, nor p_b"),
        (lambda: record(signals(), every=5), "was logged every 0.05 s"),
        (lambda: record(signals(ramp=6.0)), "0 quick turns"),
    ],
)
def test_a_log_that_cannot_tell_says_why_and_what_to_log(made, said) -> None:  # type: ignore[no-untyped-def]
    step = checked(made())
    assert {m.name for m in step.measures} == {n for n, m in MEASURES.items() if m.step is StepNumber.DYNAMICS}
    assert all(m.value is None and said in m.note and "log the winch without load" in m.note for m in step.measures)
    assert step.estimates is None


def test_a_campaign_without_such_a_test_says_so() -> None:
    assert 'no test of kind "dynamics"' in checked().statements[0]
