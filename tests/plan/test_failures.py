"""Failure cases of a plan: what is run, how it is judged, and what follows by depth."""

import math
import re
import sys
from dataclasses import replace
from importlib.resources import files
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from stillhook import load_crane
from stillhook.base.progress import Parts
from stillhook.kernels import build
from stillhook.plan import plan
from stillhook.plan.assessments import failures
from stillhook.plan.assessments.failures import bands
from stillhook.plan.assessments.failures import runs as failure_runs
from stillhook.plan.assessments.failures.assessment import Work, _of_winch, _stop_in_wave_zone, page
from stillhook.plan.assessments.failures.cases import BOTTLES, FAILURES, at_fault, less_gas
from stillhook.plan.assessments.failures.depths import braked, time_between
from stillhook.plan.assessments.failures.drive_off import DRIFT_OFF, DRIFT_SPEED, time_of_way
from stillhook.plan.assessments.failures.judging import height_from, used, worst
from stillhook.plan.assessments.failures.runs import AFTER, MOMENTS, TRAINS, FailureRuns, Request
from stillhook.plan.assessments.failures.section import _from, _why
from stillhook.plan.assessments.failures.wave_zone import heights_in_wave_zone
from stillhook.plan.definition.rules import Alternative, Seas
from stillhook.plan.file import load_plan
from stillhook.plan.report.decision.status import _of_assessments
from stillhook.plan.tiers.frequency import forcing_at
from stillhook.plan.tiers.situations import situations
from stillhook.plan.tiers.time_domain.cells import Cells, Execution
from stillhook.plan.tiers.time_domain.lowering import SETTLE, SeaState
from stillhook.report.document import Table, Verdict, walk
from stillhook.report.formatting import EMPTY
from stillhook.spec.lift.phase import WinchMode
from stillhook.spec.scenario import Sensors

pytestmark = pytest.mark.long

EXAMPLE = "template-to-1500m"
MILLIMETRES = 1.0
"""Time of ways between phases that join within a centimetre [s]."""
SEA = SeaState(2.0, 9.0, math.radians(195.0))


@pytest.fixture(scope="module")
def lift():
    return load_plan(EXAMPLE)


@pytest.fixture(scope="module")
def result():
    return plan(replace(load_plan(EXAMPLE), weather=None), tier="frequency")


@pytest.fixture(scope="module")
def as_required(tmp_path_factory):
    """Facts of the example as the requirement has it, of version 0.10: 120 t on the hook, without a build-up."""
    text = (files("stillhook.library") / "data/lifts" / f"{EXAMPLE}.toml").read_text(encoding="utf-8")
    kept = [line for line in text.split("\n") if not line.startswith(("points =", "mass =", "tilt =", "# items"))]
    tables = re.split(r"(?m)^(?=\[)", "\n".join(kept))
    plain = "".join(t for t in tables if not t.startswith(("[weight]", "[[rigging.item]]", "[weather]")))
    path = tmp_path_factory.mktemp("plan") / "plan.toml"
    path.write_text(plain, encoding="utf-8")
    return plan(str(path), tier="frequency").facts[failures.NAME]


@pytest.fixture(scope="module")
def facts(result):
    return result.facts[failures.NAME]


def cases(lift, key: str, phase: str):
    runs = FailureRuns(Cells(lift, Execution()), Alternative.SSC)
    return runs._cases(Request(key, phase, SEA))[1]


def test_slack_on_a_steady_brake_begins_where_the_requirement_has_it(as_required):
    # LIFTPLAN 9: slack from 4.92 m (above the deep stop, half an hour)
    deep = [
        row for row in as_required["by_depth"] if row["z"] == pytest.approx(-1475.0) and row["rule"] == "slack-sling"
    ]
    assert min(row["Hs_from"] for row in deep) == pytest.approx(4.92, abs=0.01)


def test_touch_down_on_a_steady_brake_is_beyond_its_limit_where_the_requirement_has_it(as_required):
    # LIFTPLAN 9: 1.73, 1.57, 1.49, 1.44 m at 7 to 10 s
    rows = {row["Tp"]: row for row in as_required["steady"]["touch_down"]["by_period"]}
    for Tp, Hs in ((7.0, 1.73), (8.0, 1.57), (9.0, 1.49), (10.0, 1.44)):
        assert rows[Tp]["Hs_from"] == pytest.approx(Hs, abs=0.01)


def test_the_low_weight_case_is_slack_no_later_than_the_high_one(facts, lift):
    heights = np.full(len(lift.environment.table().columns), 2.0)
    high = {(p.phase, p.z): p for p in braked(lift, heights)}
    assert lift.low is not None
    for row in facts["by_depth"]:
        if row["rule"] == "slack-sling":
            assert row["Hs_from"] <= np.nanmin(high[row["phase"], row["z"]].Hs["slack-sling"])


def test_a_plan_without_runs_says_that_failures_of_the_winch_were_not_assessed(facts):
    verdicts = {case["key"]: case["verdict"] for case in facts["cases"]}
    assert all(verdicts[failure.key] == "not-assessed" for failure in FAILURES)
    assert verdicts["drive-off"] == "not-assessed"
    assert facts["page"]["loads_to"] > 0.0


def test_loads_are_within_limits_up_to_the_lowest_sea_in_which_a_trip_is_not():
    # the row that uses most begins to fail at 0.75 m, another at 0.70 m
    trip = {"key": "ahc-trip", "verdict": "not-ok", "loads": "not-ok"}
    rows = [{"Hs": 2.0, "Hs_from": Hs, "v_landed": v} for Hs, v in ((0.75, None), (0.70, 0.3), (1.3, 0.6), (None, 0.1))]
    trip |= {"rows": rows, "worst": rows[0]}
    steady = {"loads": {"Hs_from": 4.3}, "touch_down": {"Hs_from": 1.4, "limit": 0.5}, "highest": 6.0}
    made_up = {"cases": [trip], "steady": steady, "seas": [], "near_seabed": {"depth": None, "fall": 1.0}}
    assert page(made_up)["loads_to"] == 0.70
    assert (
        page(made_up)["touch_down_from"] == 1.3
    )  # of the run that touches down at 0.6 m/s, below the 1.4 m on the brake
    assert page({**made_up, "cases": [trip | {"loads": "ok"}]})["loads_to"] == 4.3


def test_the_closed_form_alone_assesses_no_failure():
    assert failures.NAME not in plan(replace(load_plan(EXAMPLE), weather=None), tier="closed-form").facts


def test_the_section_needs_the_facts_alone(result):
    parts = list(walk(failures.parts(result.facts)))
    verdicts = next(p for p in parts if isinstance(p, Table) and p.title == "Verdicts")
    words = [row[1].word for row in verdicts.rows if isinstance(row[1], Verdict)]
    assert len(words) == len(result.facts[failures.NAME]["cases"])
    assert "OK" not in words


def test_a_failure_begins_at_as_many_moments_as_are_stated_of_the_same_waves(lift):
    made = cases(lift, "ahc-trip", "lower water")
    assert len(made) == MOMENTS
    assert len({case.seed for case in made}) == TRAINS
    moments = [case.lift.programme[-2].time for case in made]
    assert len(set(moments)) == MOMENTS
    assert max(moments) - min(moments) < SEA.Tp
    assert {case.lift.programme[-1].mode for case in made} == {WinchMode.STOP}
    waves = {case.seed: case.motion for case in made}
    other = {case.seed: case.motion for case in cases(lift, "motion-frozen", "lower water")}
    assert waves == other


def test_a_sensor_fails_within_the_part_of_a_run_that_counts(lift):
    for case in cases(lift, "motion-frozen", "landing"):
        begins = sum(phase.time or 0.0 for phase in case.lift.programme[:-1])
        fault = case.lift.sensors.s_tip.faults[-1]
        assert begins <= fault.time <= begins + SEA.Tp
        assert fault.until > case.lift.duration
        assert case.lift.duration >= SETTLE + AFTER


def test_a_landing_is_broken_off_at_every_height_from_its_stand_off_down(lift):
    made, phase = cases(lift, "ahc-trip", "landing"), lift.phase("landing")
    heights = [phase.stand_off - phase.speed * case.lift.programme[-2].time for case in made]
    assert max(heights) > 0.9 * phase.stand_off
    assert 0.0 < min(heights) < 0.1 * phase.stand_off


def test_faults_keep_what_a_sensor_has_already():
    sensors = Sensors(noise_s_tip="1 cm", s_w={"noise": "1 mm"}, delay="50 ms")
    frozen = at_fault(sensors, {"s_tip": {"fault": {"time": "5 s", "until": "9 s", "kind": "frozen"}}})
    assert frozen.s_tip.noise == pytest.approx(0.01)
    assert frozen.noise_s_tip == 0.0
    assert (frozen.delay, frozen.s_w) == (sensors.delay, sensors.s_w)
    assert Sensors.from_dict(frozen.model_dump(mode="json")).s_tip.faults[0].time == 5.0


@pytest.mark.parametrize("name", ["nov-250t", "nov-100t-cylinder", "nov-250t-secondary"])
def test_a_winch_on_gas_can_lose_a_bottle(name):
    crane = load_crane(name)
    less = less_gas(crane)
    assert less is not None
    before, after = (next(g for g in map(gas_of, (c,)) if g) for c in (crane, less))
    assert after == pytest.approx(before * (1.0 - 1.0 / BOTTLES))


def gas_of(crane) -> float:
    parts = (crane.passive, getattr(crane.cylinder, "passive", None), crane.secondary)
    return next(part.accumulator.gas.V_0 for part in parts if part is not None)


@pytest.mark.parametrize("name", ["nov-100t-pure-active", "nov-100t-electric", "utility-20t-open-circuit"])
def test_a_winch_without_gas_has_no_bottle_to_lose(name):
    assert less_gas(load_crane(name)) is None


@pytest.mark.parametrize(
    ("points", "at_rest", "Hs"),
    [
        ({2.0: 0.9}, 0.4, math.inf),
        ({2.0: 1.4}, 0.4, 1.2),
        ({2.0: 1.4, 1.2: 0.8}, 0.4, 1.45),
        ({2.0: 1.4, 1.2: 1.2}, 0.4, 0.9),
        ({2.0: math.inf, 1.0: 0.5}, 0.4, 1.0),
        ({2.0: 1.4}, 1.0, 0.0),
    ],
)
def test_the_height_from_which_a_limit_is_passed_is_rounded_down(points, at_rest, Hs):
    assert height_from(points, at_rest) == pytest.approx(Hs)


def test_a_vessel_that_drifts_takes_the_time_of_uniform_acceleration_and_then_of_its_speed():
    reached = 0.5 * DRIFT_SPEED**2 / DRIFT_OFF
    assert time_of_way(reached, DRIFT_OFF, DRIFT_SPEED) == pytest.approx(DRIFT_SPEED / DRIFT_OFF)
    beyond = time_of_way(reached + 50.0, DRIFT_OFF, DRIFT_SPEED) - time_of_way(reached, DRIFT_OFF, DRIFT_SPEED)
    assert beyond == pytest.approx(50.0 / DRIFT_SPEED)


def test_the_way_back_takes_the_time_of_the_way_down(lift):
    moving = [p for p in lift.phases[1:] if p.speed and not p.held]  # the first lifts it off the deck
    down = sum(abs(p.z_end - p.z_start) / p.speed for p in moving)
    assert time_between(lift, moving[0].z_start, moving[-1].z_end) == pytest.approx(down, abs=MILLIMETRES)


ZONE = {"phase": "splash zone", "top": -2.0, "bottom": -8.0, "reason": "loads", "method": "twin"}
SEABED = {"phase": "landing", "top": -1498.0, "bottom": -1500.0, "reason": "touch-down", "method": "frequency"}


STOPPED = {"key": "wave-zone-stop", "by_depth": [{}]}


def test_a_stop_that_is_beyond_a_limit_at_any_depth_is_not_ok(lift):
    def rows(wanted):
        used = {each.z: 1.05 if each.z == 0.0 else 0.9 for each in wanted}
        return [
            {
                "phase": "splash zone",
                "z": z,
                "Tp": 9.0,
                "rule": "dynamic-load",
                "used": x,
                "Hs_from": 1.7 if x > 1.0 else None,
            }
            for z, x in used.items()
        ]

    runs = SimpleNamespace(request=lambda wanted: None)
    work = SimpleNamespace(plan=lift, state=SimpleNamespace(twin=True), seas=[SEA], runs=runs, rows=rows)
    work.judge = lambda wanted, progress: None
    case = _stop_in_wave_zone(work, None)
    assert (case["verdict"], case["Hs_from"], case["worst"]["z"]) == ("not-ok", 1.7, 0.0)
    assert [row["used"] for row in case["rows"]] == [0.9]


def test_without_a_run_of_a_stop_nothing_is_said_of_the_wave_zone(lift):
    zone = [row for row in bands.actions(lift, [], []) if row["phase"] == "splash zone"]
    assert [(row["action"], row["time"]) for row in zone] == [("not-assessed", None)]


def test_every_depth_over_the_side_has_one_action(lift):
    rows = bands.actions(lift, [ZONE, SEABED], [STOPPED])
    for phase in lift.phases:
        of_phase = [row for row in rows if row["phase"] == phase.name]
        if not of_phase or phase.z_start == phase.z_end:
            continue
        assert (of_phase[0]["top"], of_phase[-1]["bottom"]) == (phase.z_start, phase.z_end)
        for upper, lower in pairwise(of_phase):
            assert upper["bottom"] == pytest.approx(lower["top"])


def test_a_band_is_left_by_the_sooner_way_and_the_seabed_upwards_alone(lift):
    rows = bands.actions(lift, [ZONE, SEABED], [STOPPED])
    zone = [row for row in rows if row["phase"] == "splash zone" and row["action"] != "hold"]
    assert [(row["action"], row["to"]) for row in zone] == [("hoist", -2.0), ("lower-on", -8.0)]
    speed = lift.phase("splash zone").speed
    assert all(row["time"] == pytest.approx(3.0 / speed, rel=1e-3) for row in zone)
    last = rows[-1]
    assert (last["action"], last["to"], last["bottom"]) == ("hoist", -1498.0, -1500.0)
    assert last["time"] == pytest.approx(2.0 / lift.phase("landing").speed)


def test_heights_of_a_stop_go_from_the_surface_to_the_end_of_the_passage(lift):
    z = heights_in_wave_zone(lift, lift.phase("splash zone"))
    assert (z[0], z[-1]) == (0.0, -25.0)
    assert np.all(np.diff(z) < 0.0)


@pytest.fixture(scope="module")
def runs(lift, tmp_path_factory):
    store = tmp_path_factory.mktemp("runs")
    made = FailureRuns(Cells(lift, Execution(store)), Alternative.SSC)
    made.request([Request(key, "landing, held", SEA) for key in ("ahc-trip", "gas-bottle", "motion-frozen")])
    return made


def of(runs: FailureRuns, key: str):
    return runs.runs[Request(key, "landing, held", SEA)]


def test_a_trip_gives_back_the_motion_that_compensation_took(runs):
    on_brake, compensated = (of(runs, key)["load_pp"] for key in ("ahc-trip", "gas-bottle"))
    assert np.all(on_brake > 2.0 * compensated)


def test_the_peak_of_a_trip_depends_on_the_phase_of_the_waves(runs):
    peaks = of(runs, "ahc-trip")["F_w_max"].reshape(-1, TRAINS)
    within = np.ptp(peaks, axis=0)
    assert np.all(within > 1e3)


def test_the_jump_of_a_trip_is_below_that_of_the_fastest_tip(runs, lift):
    # sqrt(K M) v of the fastest tip of a Rayleigh sea, and its swing on the brake: nothing adds energy besides
    phase = lift.phase("landing, held")
    at = lift.tip_of(phase)
    forcing = forcing_at(lift, Seas(*(np.array([x]) for x in SEA)), at.x, at.y)
    load = situations(lift, phase)[-1]
    omega = 2.0 * math.pi / load.T_0
    M = lift.payload.mass + lift.payload.covered(lift.rho).A33
    v = 4.0 * float(forcing.deviation(1)[0])
    resonance = 1.0 / (1.0 - (SEA.Tp / load.T_0) ** -2.0)
    numbers = of(runs, "ahc-trip")
    assert np.all(numbers["F_w_max"] - load.load.F_top < M * omega * v * (1.0 + resonance))
    assert np.all(numbers["F_w_max"] > load.load.F_top)


def test_a_frozen_motion_unit_moves_the_load_no_less_than_the_brake_does(runs):
    frozen, on_brake = (of(runs, key)["load_pp"] for key in ("motion-frozen", "ahc-trip"))
    assert frozen.max() > on_brake.max()


def test_a_stopped_assessment_takes_its_runs_from_the_store(runs, lift):
    store = runs.cells.execution.store
    before = {path.name for path in store.iterdir()}
    again = FailureRuns(Cells(lift, Execution(store)), Alternative.SSC)
    again.request([Request("ahc-trip", "landing, held", SEA)])
    assert {path.name for path in store.iterdir()} == before
    for name, values in of(runs, "ahc-trip").items():
        assert np.array_equal(values, of(again, "ahc-trip")[name], equal_nan=True)


SENSORS = {"motion-frozen", "motion-drift", "load-cell-zero", "load-cell-over"}


def test_faults_of_sensors_without_a_compiler_are_not_assessed_and_say_so(lift, monkeypatch):
    """A wheel holds no model with sensors: every other failure is run, and the plan is not for approval."""
    made = build._driver

    def shipped(plant, lanes, setup, extra):
        return build._by_numba(None, None) if setup.sensors else made(plant, lanes, setup, extra)

    monkeypatch.setattr(build, "_driver", shipped)
    monkeypatch.setitem(sys.modules, "numba", None)
    monkeypatch.setattr(failure_runs, "MOMENTS", TRAINS)
    one = FailureRuns(Cells(replace(lift, phases=(lift.phase("landing, held"),)), Execution()), Alternative.SSC)
    work = Work(None, Parts(None, {"trip": 1.0, "others": 1.0}), one, [SEA])
    by_key = {case["key"]: case for case in _of_winch(work)}
    assert {key for key, case in by_key.items() if case["verdict"] == "not-assessed"} == SENSORS
    for key in SENSORS:
        why = _why(by_key[key])
        assert why.startswith("not simulated: No compiler is installed.")
        assert "sensors with faults" in why
        assert why.endswith('pip install "stillhook[compiler]".')
        assert "\n" not in why
    reasons = dict(_of_assessments({"failures": {"cases": list(by_key.values())}}))
    assert reasons["failure-not-assessed"].startswith("4 failure cases not assessed: Motion unit frozen, ")


def test_a_run_that_fails_is_never_ok(runs, lift):
    request = Request("ahc-trip", "landing, held", SEA)
    numbers = {name: values.copy() for name, values in of(runs, "ahc-trip").items()}
    numbers["duration"][3] = np.nan
    top = worst(used(lift, request, numbers))
    assert (top.rule, top.used, top.run) == ("run-failed", math.inf, 3)


def test_a_plan_without_compensation_has_no_trip(lift):
    manual = [p.model_copy(update={"mode": WinchMode.MANUAL}) for p in lift.phases]
    work = Work(None, None, FailureRuns(Cells(replace(lift, phases=tuple(manual)), Execution()), Alternative.SSC), [])
    trip, blackout = (next(f for f in FAILURES if f.key == key) for key in ("ahc-trip", "blackout"))
    assert not work.places_of(trip)
    assert {p.name for p, _ in work.places_of(blackout)} >= {"splash zone", "upper water", "landing"}


def test_a_case_that_fails_in_a_calm_fails_from_any_height_on_and_one_that_never_does_from_none():
    assert _from({"verdict": "not-ok", "Hs_from": None}) == "any"
    assert _from({"verdict": "ok", "Hs_from": None}) == EMPTY
    assert _from({"verdict": "not-ok", "Hs_from": 1.7}) == "1.70 m"
