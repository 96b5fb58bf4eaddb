"""Synthetic friction tests: what a crane's PLC would log, and how far the logs can be trusted as measurements of a known truth."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from trials.campaigns.__main__ import main
from trials.campaigns.friction import (
    CAMPAIGNS,
    HOLD,
    PAUSE,
    RAMP,
    PlannedTest,
    TestPlan,
    campaign_plan,
    closed_circuit,
    crane_of,
    outermost_layer,
    staircase,
    write_campaign,
)
from trials.campaigns.plc_log import COLUMNS, Calibration, Instruments, Noise, Sensor, logged, noise_of

from stillhook import load_crane
from stillhook.engine.pack.winch import active_record, friction_record
from stillhook.errors import StillhookError
from stillhook.library import changed, crane_from_toml, load_friction
from stillhook.library.examples import MARK
from stillhook.physics.friction import system_friction
from stillhook.physics.hydraulics.motor import torque_loss
from stillhook.physics.scalar import G
from stillhook.units import parse

pytestmark = pytest.mark.slow

BAR, RPM = 1e5, np.pi / 30.0
BALANCE = 1e-3
"""Relative to the friction: the steady balance of torques. The wire's stretch and the drum's inertia still change a little."""
SETTLED = 0.5 * RPM
"""A winch whose speed changes less than this over the window runs steadily; others creep or stick and slip [rad/s]."""
NONE = Instruments(noise=Noise.NONE)


def plan(crane: str = "nov-150t", motors: int = 11, rows=((2365.0, 77.0), (1800.0, 0.0))) -> TestPlan:
    tests = tuple(
        PlannedTest(str(i + 1), parse(f"{D} cm^3/rev", "displacement") / motors, 1e3 * t)
        for i, (D, t) in enumerate(rows)
    )
    return TestPlan("small", "small campaign", crane, motors, tests, "made up")


def signals(path: Path) -> dict[str, np.ndarray]:
    """The log's columns by our names, in SI."""
    assert path.open(encoding="utf-8").readline() == f"# {MARK}\n"
    table = pd.read_csv(path, comment="#", float_precision="round_trip")
    unit = {"bar": BAR, "rev/min": RPM, "kN": 1e3, "m": 1.0, "1": 1.0}
    return {"time": table["Time"].to_numpy()} | {c.name: table[c.heading].to_numpy() * unit[c.unit] for c in COLUMNS}


def windows(log: dict[str, np.ndarray], pairs: int):
    """Means over the last three seconds of every step, hoisting and lowering in turn, and how much the speed still changed."""
    for k in range(2 * pairs):
        end = PAUSE + k * (2.0 * RAMP + HOLD) + RAMP + HOLD
        inside = (log["time"] >= end - 3.0) & (log["time"] < end - 1e-6)
        means = {name: float(values[inside].mean()) for name, values in log.items()}
        yield means, float(np.ptp(log["omega_m"][inside]))


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory):
    """Of a crane whose load does not ring on its wire and whose brake stays open: every step is steady, and its command constant."""
    small = plan(rows=((2365.0, 107.0), (1800.0, 77.0), (1120.0, 0.0)))
    truth = changed(load_crane("nov-150t"), {"wire": {"zeta": 0.95, "zeta_low": 0.95, "zeta_high": 0.95}}).model_copy(
        update={"brake": None}
    )
    return small, write_campaign(
        small, tmp_path_factory.mktemp("clean") / "tests", instruments=NONE, duration="6 min", reference=truth
    )


# The machine and its operator


def test_for_friction_tests_all_motors_and_pumps_of_an_active_passive_crane_work_in_one_circuit():
    crane, one = load_crane("nov-150t"), closed_circuit(load_crane("nov-150t"))
    assert one.passive is None
    assert one.active.motor.count == 11
    assert one.active.motor.D_total == pytest.approx(parse("2365 cm^3/rev", "displacement"))
    assert one.active.pump.D_total == pytest.approx(crane.active.pump.D_total + crane.passive.pump.D_total)
    assert one.active.line.V == pytest.approx(crane.active.line.V * 11 / 3)
    assert one.inertia == crane.inertia
    assert one.sources["active.line.V"].kind == "assumed"
    assert closed_circuit(load_crane("nov-100t-pure-active")) == load_crane("nov-100t-pure-active")


def test_motors_that_differ_make_no_one_circuit():
    crane = changed(load_crane("nov-150t"), {"passive": {"motor": {"C_1": "0.05 L/min/bar"}}})
    with pytest.raises(StillhookError, match="they make no one circuit"):
        closed_circuit(crane)


@pytest.mark.parametrize("name", sorted(CAMPAIGNS))
def test_every_published_test_is_one_that_its_crane_can_run(name):
    campaign = CAMPAIGNS[name]
    crane = crane_of(campaign)
    layer = outermost_layer(crane, campaign.tests)
    for test in campaign.tests:
        stairs = staircase(crane, test, layer=layer)
        assert stairs.notes == ()
        assert np.all(np.diff(stairs.speeds) > 0.0)
        assert stairs.speeds[0] < 25.0 * RPM
        assert np.sum(stairs.speeds < 200.0 * RPM) >= 8  # dense where break-away friction fades
        assert len(stairs.speeds) >= 30


def test_published_tables_are_as_printed():
    total = {
        n: [(round(t.D_m * p.motors / parse("1 cm^3/rev", "displacement"), 6), t.load / 1e3) for t in p.tests]
        for n, p in CAMPAIGNS.items()
    }
    assert total["L4593"][4] == (720.0, 55.0)
    assert total["L4593"][8] == (1120.0, 100.0)
    assert total["crane-2"][6] == (2200.0, 0.0)
    assert total["crane-2-extended"][:7] == total["crane-2"]
    assert total["crane-2-extended"][9] == (1320.0, 77.0)
    assert [t.name for t in CAMPAIGNS["L4593"].tests if t.hold_out] == ["1", "2", "3"]
    assert [t.name for t in CAMPAIGNS["crane-2-extended"].tests if t.hold_out] == ["8", "9", "10", "11", "12"]
    assert not any(t.hold_out for t in CAMPAIGNS["crane-2"].tests)


# The logs are right


@pytest.mark.long
def test_steady_pressures_show_the_load_and_the_friction_that_the_crane_has(clean):
    """Torque balance of every steady step: displacement times pressure is load torque plus (hoisting) or less (lowering) all friction."""
    small, written = clean
    crane = crane_from_toml((written.folder / "reference.toml").read_text(encoding="utf-8"), "reference.toml")
    n, friction, fit = crane.active.motor.count, friction_record(crane.friction.system), active_record(crane).motors.fit
    for test, path in zip(small.tests, written.logs, strict=True):
        stairs, checked = staircase(crane, test, layer=written.layer, duration=360.0), []
        W = (test.load + crane.hook_mass) * G
        for mean, change in windows(signals(path), len(stairs.speeds)):
            omega, dp, T_d = mean["omega_m"], mean["p_a"] - mean["p_b"], W * stairs.d / 2.0
            if change > SETTLED or abs(omega) < 2.0 * RPM:
                continue
            T_f = system_friction(abs(omega), T_d, friction) + torque_loss(omega, stairs.D_m, dp, fit)
            found = np.sign(omega) * (n * stairs.D_m * dp - T_d / crane.i_hD) / n
            assert found == pytest.approx(T_f, rel=BALANCE)
            assert mean["F_w"] == pytest.approx(W, rel=0.01)
            checked.append(omega)
        assert len(checked) > 1.4 * len(stairs.speeds)
        assert min(checked) < -500.0 * RPM
        assert max(checked) > 500.0 * RPM


def test_under_load_the_leakage_makes_hoisting_and_lowering_speeds_differ(clean):
    _, written = clean
    means = [m for m, _ in windows(signals(written.logs[0]), 5)]
    up, down = (np.array([m["omega_m"] for m in means[i::2]]) for i in (0, 1))
    assert np.all(up > 0.0)
    assert np.all(up + down > 3.0 * RPM)
    command = [m["u_p"] for m in means]
    assert np.all(np.array(command[0::2]) > -np.array(command[1::2]))  # the operator leans against the leakage


def test_displacement_and_command_are_held_within_a_step_and_the_wire_stays_on_its_layer(clean):
    small, written = clean
    for test, path in zip(small.tests, written.logs, strict=True):
        log = signals(path)
        assert np.ptp(log["alpha_m"]) == 0.0
        assert log["alpha_m"][0] == pytest.approx(test.D_m / parse("215 cm^3/rev", "displacement"))
        inside = (log["time"] > PAUSE + RAMP) & (log["time"] < PAUSE + RAMP + HOLD)
        assert np.ptp(log["u_p"][inside]) < 1e-12
    assert written.notes == ()


def test_the_librarys_load_rings_about_the_same_pressures_and_its_start_from_the_brake_fades(clean, tmp_path):
    """What rings averages out over three seconds: the balance of the clean tests holds to a per cent of the friction and of the weight."""
    one = plan(rows=((2365.0, 107.0),))
    rings = signals(write_campaign(one, tmp_path / "tests", instruments=NONE, duration="6 min").logs[0])
    steady = signals(clean[1].logs[0])
    for (a, change), (b, _) in zip(windows(rings, 10), windows(steady, 10), strict=True):
        assert change < 0.2 * abs(a["omega_m"]) + SETTLED  # it never stops
        assert a["omega_m"] == pytest.approx(b["omega_m"], rel=0.01, abs=0.1 * RPM)
        assert a["p_a"] - a["p_b"] == pytest.approx(b["p_a"] - b["p_b"], rel=0.01)
    ends = [
        float(np.ptp(rings["u_p"][(rings["time"] > t) & (rings["time"] < t + 1.0)]))
        for t in (PAUSE + RAMP, PAUSE + RAMP + HOLD - 1.0)
    ]
    assert 1e-4 < ends[0]
    assert ends[1] < 0.02 * ends[0]  # eleven seconds at the bumpless 2 s leave 0.4 %


def test_a_log_has_a_row_every_plc_cycle_and_the_test_its_length(clean):
    log = signals(clean[1].logs[0])
    assert np.allclose(np.diff(log["time"]), 0.01, atol=1e-9)
    assert log["time"][-1] == 360.0


# What the files say


def test_the_campaign_file_has_crane_signals_and_tests_and_says_that_it_is_synthetic(clean):
    small, written = clean
    text = written.campaign.read_text(encoding="utf-8")
    table = tomllib.loads(text)
    assert table["title"].startswith("SYNTHETIC")
    assert MARK in text.splitlines()[0]
    assert (table["crane"], table["motors"], table["motor"]) == ("nov-150t", 11, "A6VM215")
    assert table["signals"]["p_a"] == {"column": "PT A", "unit": "bar"}
    assert [t["name"] for t in table["test"]] == ["1", "2", "3"]
    for row, test in zip(table["test"], small.tests, strict=True):
        assert parse(row["D_m"], "displacement") == pytest.approx(test.D_m, rel=1e-11)
        assert parse(row["load"], "mass") == pytest.approx(test.load)
        assert row["layer"] == written.layer
        assert (written.folder / row["log"]).is_file()


def test_the_truth_may_differ_from_what_the_campaign_says(tmp_path):
    loss = {"motor": {"loss": {"X_4": "20 N m"}}}
    truth = changed(load_crane("nov-150t"), {"friction": {"library": "crane-1"}, "active": loss, "passive": loss})
    one = plan(rows=((2365.0, 77.0),))
    same, blind = (
        write_campaign(one, tmp_path / n, instruments=NONE, duration="3 min", reference=t)
        for n, t in (("same", None), ("blind", truth))
    )
    assert same.campaign.read_text(encoding="utf-8") == blind.campaign.read_text(encoding="utf-8")
    crane = load_crane(blind.folder / "reference.toml")
    assert crane.friction.system == load_friction("crane-1").system
    assert crane.active.motor.loss.X_4 == 20.0
    a, b = (np.array([m["p_a"] - m["p_b"] for m, _ in windows(signals(w.logs[0]), 3)]) for w in (same, blind))
    assert np.max(np.abs(a - b)) > 0.5 * BAR


# Sensors


def test_typical_sensors_add_the_noise_and_the_steps_that_they_state(tmp_path):
    one = plan(rows=((2365.0, 77.0),))
    clean, noisy = (
        write_campaign(one, tmp_path / n.value, instruments=Instruments(noise=n), duration="3 min") for n in Noise
    )
    a, b = (signals(w.logs[0]) for w in (clean, noisy))
    error = b["p_a"] - a["p_a"]
    assert np.std(error) == pytest.approx(0.5 * BAR, rel=0.05)
    assert abs(np.mean(error)) < 0.02 * BAR
    step = 400.0 / 2**12
    assert np.allclose(b["p_a"] / BAR / step, np.round(b["p_a"] / BAR / step), atol=1e-2)
    hold = (a["time"] > PAUSE + 5 * (2.0 * RAMP + HOLD) - 6.0) & (a["time"] < PAUSE + 5 * (2.0 * RAMP + HOLD) - 3.0)
    assert np.mean(b["omega_m"][hold]) == pytest.approx(np.mean(a["omega_m"][hold]), abs=1.0 * RPM)
    mapping = tomllib.loads(noisy.campaign.read_text(encoding="utf-8"))
    assert mapping["signals"]["p_a"]["range"] == ["0 bar", "400 bar"]
    assert (
        "accuracy" not in mapping
    )  # half a bar of noise carries a stretch over many steps of 0.1 bar: their mean has no step left


def test_a_sensor_is_late_out_of_calibration_and_held_in_its_range():
    truth = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    rng = np.random.default_rng(0)
    assert logged(truth, Sensor(delay=0.02), 0.01, rng).tolist() == [1.0, 1.0, 1.0, 2.0, 3.0]
    assert logged(truth, Sensor(delay=1.0), 0.01, rng).tolist() == [1.0] * 5
    assert logged(truth, Sensor(gain=2.0, offset=-1.0), 0.01, rng).tolist() == [1.0, 3.0, 5.0, 7.0, 9.0]
    assert logged(truth, Sensor(lo=2.0, hi=4.0), 0.01, rng).tolist() == [2.0, 2.0, 3.0, 4.0, 4.0]
    assert logged(truth, Sensor(step=2.0), 0.01, rng).tolist() == [0.0, 2.0, 4.0, 4.0, 4.0]


# Refusals


@pytest.mark.parametrize(
    ("of", "options", "says"),
    [
        ({}, {"duration": "1 min"}, "duration = 60 s: a staircase takes 106 s to 86400 s."),
        ({}, {"duration": 20.0}, "duration = 20.0: a bare number"),
        ({}, {"layer": 12}, 'layer = 12: the drum of "nov-150t-closed-circuit" has layers 1 to 11.'),
        ({}, {"layer": 0}, "layer = 0: "),
        ({"rows": ((3300.0, 1.0),)}, {}, "D_m 300 cm^3/rev: the motors"),
        ({"rows": ((500.0, 150.0),)}, {}, "lifts 150 t on no layer without its relief valves"),
        ({"motors": 8}, {}, 'campaign "small": 8 motors, and'),
        ({}, {"instruments": Instruments(calibration={"p_c": Calibration()})}, 'calibration: "p_c" is not logged'),
    ],
)
def test_what_cannot_be_tested_is_refused_and_leaves_nothing_behind(tmp_path, of, options, says):
    with pytest.raises(StillhookError, match=re.escape(says)):
        write_campaign(plan(**of), tmp_path / "out", **options)
    assert not (tmp_path / "out").exists()


def test_names_that_there_are_not_and_a_folder_with_logs_are_refused(tmp_path):
    (tmp_path / "logs").mkdir()
    for refused, says in (
        (lambda: campaign_plan("crane-9"), '"crane-9": not one of L4593, crane-2, crane-2-extended.'),
        (lambda: noise_of("much"), '"much": not one of none, typical.'),
        (lambda: write_campaign(plan(), tmp_path), "there are logs already. Choose another folder."),
    ):
        with pytest.raises(StillhookError, match=re.escape(says)):
            refused()


@pytest.mark.thorough
def test_the_command_writes_a_campaign_of_another_crane_than_it_names(tmp_path, capsys):
    words = ("friction-tests", str(tmp_path / "c"), "--plan", "crane-2", "--duration", "2 min", "--noise", "none")
    assert main([*words, "--reference", "crane-1", "--reference", "A6VM215-crane-2-second-loop"]) == 0
    assert str(tmp_path / "c" / "campaign.toml") in capsys.readouterr().out
    crane = load_crane(tmp_path / "c" / "reference.toml")
    assert crane.friction.system == load_friction("crane-1").system
    assert crane.active.motor.loss.X_3 == 0.012
    assert 'crane = "nov-150t"' in (tmp_path / "c" / "campaign.toml").read_text(encoding="utf-8")
