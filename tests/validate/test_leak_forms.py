"""The form of the leakage: chosen by evidence from logs whose form is known, with intervals that hold the truth."""

import functools
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.validate import dynamics_logs
from tests.validate.ahc_logs import TWIN, campaign
from tests.validate.flow_logs import N_1000, Leaks, flow_parts
from tests.validate.parameter_logs import checked, records

from stillhook.library import crane_toml, load_crane
from stillhook.library.crane_file import changed
from stillhook.library.leakage import leak_at, stated_leak
from stillhook.statistics.estimate import Estimate
from stillhook.units import in_display
from stillhook.validate.criteria.judge import judge
from stillhook.validate.criteria.results import Verdict
from stillhook.validate.dynamics.check import check_dynamics, tuned_crane
from stillhook.validate.dynamics.estimates import TunedValue
from stillhook.validate.parameters import check as parameters
from stillhook.validate.parameters import leak_laws
from stillhook.validate.parameters.flow import balance, leak_rows
from stillhook.validate.parameters.leak_laws import RISE
from stillhook.validate.parameters.leakage import EXTRAPOLATED, FEWEST_FOR_FORM, choose, file_point
from stillhook.winches.circuits.tables import LeakForm

pytestmark = pytest.mark.slow

CONSTANT = changed(TWIN, {"active": {"leak": {"form": "constant"}}})
STROKE = changed(TWIN, {"active": {"leak": {"form": "stroke"}}})
SPEED = changed(TWIN, {"active": {"leak": {"form": "speed"}, "motor": {"C_2": "3e-5 L/min/bar/(rev/min)"}}})
CRANES = {"constant": CONSTANT, "stroke": STROKE, "speed": SPEED, "stroke+speed": TWIN}


@functools.cache
def logs(form: str):
    return records(CRANES[form])


@functools.cache
def step(crane: str, twin: str):
    """Step 1 of a simulated crane against a twin, by their forms."""
    return checked(logs(crane), CRANES[twin])


def leak_of(crane: str, twin: str):
    return step(crane, twin).estimates.balance.leak


def truth_of(crane: str, twin: str) -> float:
    """The crane's leakage over the twin's, less 1, over the windows of the balance: the law of each at every one of them."""
    ours, b = (leak_rows(step(crane, file).estimates.parts) for file in (crane, twin))
    return float(np.nansum(ours.file[np.isfinite(ours.Q_m)]) / np.nansum(b.file[np.isfinite(b.Q_m)])) - 1.0


def verdict(found, key: str) -> Verdict:
    lines = judge(campaign().criteria, found.measures, (found.number,))
    return next(line.verdict for line in lines if line.key == key)


@pytest.mark.thorough
@pytest.mark.parametrize("form", CRANES)
def test_a_crane_with_the_form_and_number_of_its_file_agrees_within_one_and_a_half_per_cent(form):
    leak = leak_of(form, form)
    assert leak.chosen.form is LeakForm(form)
    assert not leak.refuted
    assert abs(leak.value.value) < 0.015
    assert verdict(step(form, form), "p-leakage") is Verdict.SHOWN


@pytest.mark.thorough
@pytest.mark.parametrize("twin", ["stroke", "stroke+speed"])
def test_a_constant_leak_is_recognised_where_the_file_has_it_rise(twin):
    """The file states 0.4 at full stroke, where pumps leak more than in heave compensation; a law with stroke and speed would read +20 to +30 %."""
    leak = leak_of("constant", twin)
    assert leak.chosen.form is LeakForm.CONSTANT
    assert leak.refuted
    assert in_display(leak.reference.value, "leakage") == pytest.approx(0.4, abs=0.004)
    assert leak.value.low < truth_of("constant", twin) < leak.value.high
    if twin == "stroke+speed":
        assert leak.in_file_form.value > leak.chosen.value.high
    (measure,) = step("constant", twin).measures_of("leakage_error")
    assert f"the form of the leakage does not fit: constant in the log, {twin} in the crane file" in measure.note
    assert f"structural error of its law, scaled to these data: {100.0 * leak.bend:.1f} %" in measure.note


@pytest.mark.thorough
@pytest.mark.parametrize("crane", ["stroke", "speed", "stroke+speed"])
def test_a_leak_that_rises_is_measured_and_its_structural_error_stated_against_a_constant_twin(crane):
    leak = leak_of(crane, "constant")
    assert leak.refuted
    assert leak.chosen.form is LeakForm(crane)
    assert leak.bend > 0.02
    assert leak.value.low < truth_of(crane, "constant") < leak.value.high
    reference = in_display(stated_leak(CRANES[crane].active), "leakage")
    assert in_display(leak.reference.value, "leakage") == pytest.approx(reference, rel=0.03)
    (measure,) = step(crane, "constant").measures_of("leakage_error")
    assert "constant in the crane file" in measure.note


def test_the_ratio_of_displacements_is_right_though_the_file_has_another_form():
    """A constant law on a leak that rises would take the rise for displacement: half a per cent."""
    assert abs(step("constant", "stroke+speed").estimates.balance.ratio.value) < 1e-3
    assert abs(step("stroke+speed", "constant").estimates.balance.ratio.value) < 1e-3


# --- what is offered as tuned ---------------------------------------------------------------------------------------------------------------------


def tuned_in(crane: str, twin: str):
    """The tuned crane file of a step 4 that rests on the flow balance of step 1 alone."""
    leak = leak_of(crane, twin)
    found = TunedValue("C_leak", Estimate(1.3, 1.1, 1.5), form=() if not leak.refuted else ("the form does not fit",))
    staged = SimpleNamespace(tuned=(found,), leak=leak)
    return tuned_crane(staged, campaign(*logs(crane), twin=CRANES[twin]))


@pytest.mark.parametrize(
    ("crane", "twin"),
    [("constant", "stroke+speed"), ("stroke", "constant"), ("speed", "constant"), ("stroke+speed", "constant")],
)
def test_the_tuned_file_has_the_form_of_the_logs_and_never_a_number_in_one_that_they_refute(crane, twin, tmp_path):
    tuned = tuned_in(crane, twin)
    assert tuned.active.leak.form is LeakForm(crane)
    assert "1.3 times" not in tuned.sources["active.C_leak"].text
    for alpha_p, n_m in ((0.2, 10.0), (0.5, 100.0), (0.7, 150.0)):
        truth = leak_at(CRANES[crane].active, alpha_p, n_m)
        assert leak_at(tuned.active, alpha_p, n_m) == pytest.approx(truth, rel=0.05)
    (tmp_path / "tuned.toml").write_text(crane_toml(tuned))
    assert load_crane(tmp_path / "tuned.toml").active == tuned.active  # its total is that of its parts


def test_a_form_that_fits_is_tuned_by_its_factor():
    tuned = tuned_in("constant", "constant")
    assert tuned.active.leak.form is LeakForm.CONSTANT
    assert in_display(tuned.active.C_leak, "leakage") == pytest.approx(1.3 * 0.4)


@pytest.mark.thorough
@pytest.mark.parametrize("twin", ["constant", "stroke+speed"])
def test_step_4_agrees_in_the_right_form_and_offers_no_factor_in_a_wrong_one(twin):
    tests = (*logs("constant"), dynamics_logs.record(dynamics_logs.signals(form="constant")))
    c = campaign(*tests, twin=CRANES[twin])
    found = check_dynamics(c, tests, lambda share: None)
    (measure,) = found.measures_of("C_leak_error")
    leak = next(f for f in found.estimates.tuned if f.name == "C_leak")
    if twin == "constant":
        assert measure.low < 0.0 < measure.high
        assert abs(measure.value) < 0.05
        assert leak.offered
        assert verdict(found, "4-leakage") is Verdict.SHOWN
    else:  # where it was measured, and not carried to the crane file's point, where both have 0.4
        assert measure.low < truth_of("constant", twin) < measure.high
        assert found.estimates.leak_at == found.estimates.leak.at
        assert not leak.offered
        assert verdict(found, "4-leakage") is Verdict.SHOWN
        assert "is not proposed as a tuned value: the form of the leakage does not fit" in " ".join(found.statements)
        tuned = tuned_crane(found.estimates, c).active.leak
        assert tuned.form is LeakForm.CONSTANT
        assert tuned.at.p == pytest.approx(found.estimates.leak.at.p, rel=1e-3)


# --- intervals ------------------------------------------------------------------------------------------------------------------------------------

DRAWS = 120
LEAST, MOST = 0.90, 0.98  # of 95 % intervals, asked for by the issue
PER_FORM = {
    "stroke+speed": lambda x: Leaks(constant=0.174 * x, stroke=x, speed=0.0435 * x),
    "constant": lambda x: Leaks(constant=0.4 * x),
    "stroke": lambda x: Leaks(constant=0.2175 * x, stroke=x),
    "speed": lambda x: Leaks(constant=0.3 * x, speed=0.08 * x),
}


def drawn(i: int):
    """A crane of one of the forms, its leak within a quarter of the file's, motors that slip, oil that warms by up to 5 K, zeros of p_a and
    p_b that drift by 0.3 bar, a speed that is logged late; its flow balance against the library's twin, and the true leak [L/min/bar]."""
    rng = np.random.default_rng(1000 + i)
    leaks = PER_FORM[list(PER_FORM)[i % len(PER_FORM)]](rng.uniform(0.8, 1.25))
    slip, warming, late = rng.uniform(0.0, 0.015), rng.uniform(0.0, 5.0), rng.uniform(0.0, 0.04)
    parts, truth = flow_parts(
        Leaks(leaks.constant, leaks.stroke, leaks.speed, slip, warming, 0.3, late), i, seconds=240.0
    )
    return balance(parts), truth


@pytest.mark.thorough
def test_intervals_hold_the_leak_in_95_of_100_cranes_under_drift_and_warming_oil(monkeypatch):
    """Cranes whose law is one of the forms: what is known of a rise with pressure is that there is none, and the part of the interval for
    what no form closes is left out."""
    monkeypatch.setattr(leak_laws, "UNCLOSED", 0.0)
    monkeypatch.setattr(leak_laws, "RISE_SPREAD", 1e-6)
    hits = 0
    for i in range(DRAWS):
        b, truth = drawn(i)
        error = truth / in_display(b.leak.twin, "leakage") - 1.0
        hits += b.leak.value.low <= error <= b.leak.value.high
    assert LEAST <= hits / DRAWS <= MOST


@pytest.mark.thorough
def test_the_crane_file_s_form_is_refuted_in_one_of_thirty_cranes_that_have_it():
    assert sum(drawn(i)[0].leak.refuted for i in range(0, DRAWS, len(PER_FORM))) <= 1


def test_slip_of_the_electric_motors_is_no_leak_that_rises():
    """1 % at full flow and 250 bar took a sixth of the leak for one that goes with speed."""
    parts, truth = flow_parts(Leaks(constant=0.4, slip=0.01), 3, crane=CONSTANT)
    b = balance(parts)
    assert not b.leak.refuted
    slip = b.leak.chosen.fit.b[leak_laws.NUISANCE.index("slip")]
    assert slip == pytest.approx(0.01, abs=0.006)
    assert in_display(b.leak.twin, "leakage") * (1.0 + b.leak.value.value) == pytest.approx(truth, rel=0.03)


def test_forms_that_weak_data_leave_are_all_named_and_widen_the_interval():
    """Small waves: setting and speed stay where the table is flat, and nothing tells the forms apart."""
    parts, truth = flow_parts(
        Leaks(constant=0.174, stroke=1.0, speed=0.0435, slip=0.01, drift=0.3), 5, tests=1, seconds=120.0
    )
    b = balance(parts)
    assert not b.leak.refuted
    assert len(b.leak.remaining_forms) > 1
    assert b.leak.value.structural > 0.0
    assert b.leak.value.low <= truth / in_display(b.leak.twin, "leakage") - 1.0 <= b.leak.value.high


def test_too_few_blocks_leave_the_form_of_the_file_and_measure_its_number():
    parts, _ = flow_parts(Leaks(constant=0.4), 6)
    rows = leak_rows(parts)
    block = np.searchsorted(np.unique(rows.block), rows.block)
    few = replace(rows, block=block * (FEWEST_FOR_FORM - 1) // (block.max() + 1))
    leak = choose(CONSTANT, few)
    assert [c.parts for c in leak.candidates] == [("file",)]
    assert not leak.refuted
    assert len(choose(TWIN, rows).candidates) > 1


# --- a law that is none of the published ones to the letter ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Rising(Leaks):
    """A leak with a rise [L/min/bar] in proportion to the pumps' setting."""

    rise: float = 0.0

    def conductance(self, alpha_p, n_m):
        return super().conductance(alpha_p, n_m) + self.rise * np.abs(alpha_p)


BETWEEN = 24
FEWEST_HELD = 22  # of 24 intervals of 95 %: fewer come by chance in 3 of 100


def between(i: int):
    """A crane whose leak has a slope that is small but not nil: its flow balance, true leak at the working point and at the crane file's."""
    rng = np.random.default_rng(4000 + i)
    leaks = Rising(
        constant=0.3 * rng.uniform(0.95, 1.05),
        speed=0.1 * rng.uniform(0.0, 0.15),
        slip=rng.uniform(0.006, 0.012),
        warming=rng.uniform(0.0, 4.0),
        drift=0.3,
        late=0.02,
        rise=rng.uniform(0.0, 0.06),
    )
    parts, _ = flow_parts(leaks, 500 + i, seconds=240.0)
    b = balance(parts)
    return b, float(leaks.conductance(b.leak.at.alpha_p, b.leak.at.n_m)), float(leaks.conductance(1.0, N_1000))


@pytest.mark.thorough
def test_a_small_slope_lies_in_the_intervals_at_the_working_point_and_at_the_setting_and_speed_of_the_file():
    """Evidence prefers no slope to a small one. Extrapolated to the crane file's point without it, 0.33 L/min/bar +- 0.01 stood for 0.36."""
    here_held, there_held = 0, 0
    for i in range(BETWEEN):
        b, here, there = between(i)
        here_held += b.leak.value.low <= here / in_display(b.leak.twin, "leakage") - 1.0 <= b.leak.value.high
        e = b.leak.at_file_point
        there_held += e.low <= there / in_display(b.leak.stated, "leakage") - 1.0 <= e.high
    assert here_held >= FEWEST_HELD
    assert there_held >= FEWEST_HELD


def changing(i: int, least: float, most: float) -> bool:
    """Whether the interval holds the leak of a crane whose conductance changes, up or down and evenly between two sizes, up to 250 bar;
    of any form, in any of these sizes, with slip, warming oil, drift, and a late speed."""
    rng = np.random.default_rng(50_000 + i)
    form = list(PER_FORM)[i % len(PER_FORM)]
    law = PER_FORM[form](rng.uniform(0.7, 1.2))
    change = rng.uniform(least, most) * rng.choice([-1.0, 1.0])
    leaks = replace(
        law,
        slip=rng.uniform(0.0, 0.015),
        warming=rng.uniform(0.0, 4.0),
        drift=0.3,
        late=0.02,
        by_pressure=225.0 / 250.0 * change,
    )
    parts, truth = flow_parts(leaks, 51_000 + i, seconds=240.0)
    b = balance(parts)
    return b.leak.value.low <= truth / in_display(b.leak.twin, "leakage") - 1.0 <= b.leak.value.high


CHANGING = 100


@pytest.mark.thorough
def test_intervals_hold_a_leak_that_changes_with_pressure_within_the_stated_range():
    """Changes of 0 to 60 % of itself, the range that gaps, viscosity and heat can explain; no number of the method is the deviation of this draw.
    Fewer than 91 come by chance in 3 of 100 where the interval holds in 95 %."""
    assert RISE == 0.6
    assert sum(changing(i, 0.0, RISE) for i in range(CHANGING)) >= 91


@pytest.mark.thorough
def test_beyond_the_stated_range_intervals_hold_the_leak_less_often():
    """The line states its range for a reason: of changes by 60 to 100 % about nine of ten are held, not 95 of 100."""
    held = sum(changing(i, RISE, 1.0) for i in range(CHANGING))
    assert 0.80 * CHANGING <= held <= 0.95 * CHANGING


def test_the_line_states_the_range_of_pressure_dependence_for_which_its_interval_holds():
    (judged,) = step("constant", "constant").measures_of("leakage_error")
    assert "a conductance that changes by at most 60 % of itself up to 250 bar" in judged.note


def test_a_leak_that_rises_in_proportion_to_the_setting_is_named_and_no_number_of_it_offered():
    """0.13 + 0.27 alpha_p: it has the file's 0.4 at full stroke, and half of the twin's where the data are."""
    leaks = Rising(constant=0.13, rise=0.27, slip=0.008, drift=0.3)
    leak = balance(flow_parts(leaks, 7)[0]).leak
    here = float(leaks.conductance(leak.at.alpha_p, leak.at.n_m))
    assert leak.refuted
    assert leak.chosen.form is LeakForm.STROKE
    assert leak.value.low < here / in_display(leak.twin, "leakage") - 1.0 < leak.value.high
    assert leak.at_file_point.low < 0.0 < leak.at_file_point.high
    assert not leak.offered


def test_the_leakage_is_judged_where_the_data_are_and_the_distance_of_the_file_s_point_is_stated():
    leak = balance(flow_parts(Leaks(constant=0.4), 8)[0]).leak
    assert leak.refuted
    assert leak.span.p[0] < leak.at.p < leak.span.p[1] < leak.file_at.p
    assert leak.beyond_pressure == pytest.approx(leak.file_at.p - leak.span.p[1])
    text = file_point(leak)
    assert text.startswith("the crane file's point (225 bar, alpha_p 1, 1000 rev/min) is outside the data by 1")
    assert "bar (data " in text
    found = step("constant", "stroke+speed")
    (judged,), (there,) = (found.measures_of(name) for name in ("leakage_error", "leakage_file_error"))
    assert judged.value == found.estimates.balance.leak.value.value
    assert text.split(" by ")[0] in judged.note
    assert there.value is None
    assert "nothing was measured" in there.note


def test_where_the_data_reach_the_file_s_point_its_value_there_is_for_information():
    leak = balance(flow_parts(Leaks(constant=0.4), 8)[0]).leak
    near = replace(leak, file_at=leak.file_at.model_copy(update={"p": leak.at.p}))
    assert near.beyond_pressure == 0.0
    assert "bar (data" not in file_point(near)
    assert parameters.at_file_point(near, "").value == pytest.approx(near.at_file_point.value)
    assert leak.offered
    assert not replace(leak, reference=Estimate.around(leak.reference.value, 1.1 * EXTRAPOLATED * leak.stated)).offered
