"""Synthetic validation campaigns: what a PLC would log of the reference crane, marked everywhere, and each defect alone."""

import tomllib
from dataclasses import fields, replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from trials.campaigns import Defect, Plan, WrittenCampaign, sea_trials, write_campaign
from trials.campaigns.defects import DEFECTS, STATED_DELAY, Setting, setting, with_defect
from trials.campaigns.plc_log import (
    AHC_COLUMNS,
    Calibration,
    Clock,
    Sensor,
    ahc_sensors,
    filtered,
    logged,
    unit_factor,
)
from trials.campaigns.schedule import PlannedTest, Sea, beyond, irregular

from stillhook import load_crane
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import SimulationError, ValidateError
from stillhook.library.examples import MARK
from stillhook.physics.load_path.drum import layers_filled
from stillhook.physics.scalar import G
from stillhook.spec.scenario import Mode
from stillhook.validate import load_campaign
from stillhook.validate.data_set.campaign import Kind

pytestmark = pytest.mark.slow

CRANE = load_crane("nov-250t")
LEVER = 0.5 / CRANE.i_hD
SHORT = Plan(
    "short",
    CRANE,
    "nov-250t",
    (
        PlannedTest("1", Kind.AHC, 94e3, 487.0, 40.0, Mode.NS, Sea(1.8, 2.0, 8.0)),
        PlannedTest("limits", Kind.LIMITS, 82e3, 500.0, 20.0, Mode.MANUAL, None, beyond(2.8)),
    ),
    "made up",
)
"""Two tests that show every defect."""
LOGGER = {
    Defect.PRESSURE_LINES: {"PT A", "PT B"},
    Defect.LOAD_CELL: {"Load cell"},
    Defect.SENSOR_A: {"PT A"},
    Defect.CLOCK: {"Time"},
}
"""Defects of the log alone, and the columns that they touch."""


@pytest.fixture(scope="module")
def write(tmp_path_factory: pytest.TempPathFactory):
    """Campaigns of the short plan, each written once."""

    @cache
    def written(defect: Defect | None = None, seed: int = 3, apart: bool = False) -> WrittenCampaign:
        return write_campaign(
            tmp_path_factory.mktemp("truth") / "campaign", plan=SHORT, seed=seed, defect=defect, apart=apart, threads=1
        )

    return written


def table(written: WrittenCampaign, test: int = 0) -> pd.DataFrame:
    return pd.read_csv(written.logs[test], comment="#", float_precision="round_trip")


def column(written: WrittenCampaign, name: str, test: int = 0) -> np.ndarray:
    """A column of a log in SI, by our name."""
    c = next(c for c in AHC_COLUMNS if c.name == name)
    return table(written, test)[c.heading].to_numpy() * unit_factor(c)


# What is written


def test_everything_is_marked_and_the_campaign_does_not_tell_the_truth(write):
    made = write(Defect.LEAKAGE)
    for log in made.logs:
        assert log.read_text().startswith(f"# {MARK}\n")
    text = made.campaign.read_text()
    assert text.startswith(f"# {MARK}")
    assert "leak" not in text
    assert "truth" not in text
    campaign = load_campaign(made.campaign)
    assert campaign.synthetic
    assert campaign.title.startswith("SYNTHETIC")
    assert made.reference.read_text().startswith(f"# {MARK}")


def test_the_campaign_file_says_what_a_test_engineer_knows(write):
    campaign = load_campaign(write().campaign)
    assert (campaign.crane_name, campaign.delay, [t.kind for t in campaign.tests]) == (
        "nov-250t",
        STATED_DELAY,
        [Kind.AHC, Kind.LIMITS],
    )
    test, planned = campaign.tests[0], SHORT.tests[0]
    assert (test.load, test.water) == (planned.load, planned.water)
    assert test.water is not None
    assert set(test.mapping or ()) == {"time", *(c.name for c in AHC_COLUMNS)}


def test_the_truth_lies_beside_it_with_a_source_for_every_number(write):
    told_, made = tomllib.loads(write(Defect.GEAR).reference.read_text()), with_defect(setting(3), CRANE, Defect.GEAR)
    assert told_["defect"] == "gear: gear ratio motor to drum +2.0% against the twin's"
    assert {k: v["value"] for k, v in told_["crane"].items()} == {
        f.name: getattr(made.reference, f.name) for f in fields(made.reference)
    }
    assert all(v["kind"] == "assumed" and v["source"] for v in told_["crane"].values())
    line = CRANE.active.line
    assert told_["follows"]["C_h"] == pytest.approx(made.reference.capacitance * line.V / line.bulk_modulus)
    assert told_["log"]["delay"] == made.delay


def test_the_same_seed_gives_the_same_bytes_whatever_the_threads(write, tmp_path):
    one, again = write(), write_campaign(tmp_path / "again", plan=SHORT, seed=3, threads=2)
    for a, b in zip(
        (*one.logs, one.campaign, one.reference), (*again.logs, again.campaign, again.reference), strict=True
    ):
        assert a.read_bytes() == b.read_bytes()


def test_a_crane_of_your_own_lies_beside_its_campaign(tmp_path):
    made = write_campaign(tmp_path / "c", plan=replace(SHORT, crane_name="", tests=SHORT.tests[1:]))
    assert load_campaign(made.campaign).crane.active == CRANE.active


# The log as a PLC writes it


def test_stamps_jitter_and_drift_as_the_truth_says(write):
    made, clock = write(), setting(3).clock
    t = column_time(made)
    late = t / (1.0 + clock.drift) - 0.01 * np.arange(len(t))
    assert 0.5 * clock.jitter < np.ptp(late) <= clock.jitter + 2e-4  # stamps have four decimals
    assert (np.diff(t) > 0.0).all()


def column_time(written: WrittenCampaign, test: int = 0) -> np.ndarray:
    return table(written, test)["Time"].to_numpy()


def test_the_tip_in_the_log_is_the_one_that_the_plc_got(write):
    """Its own error follows from it: the PLC's error moves with the logged tip less the wire, within noise and steps."""
    made = write()
    s_tip, s_w, e = (column(made, n) for n in ("s_tip", "s_w", "e_c_measured"))
    assert np.std(np.diff(s_tip - s_w - e)) < 1e-3


def test_signals_have_the_steps_and_ranges_of_their_sensors(write):
    made = write()
    for name, step in (("p_a", 400e5 / 4096), ("s_w", 1e-3), ("u_p", 1e-4)):
        values = column(made, name) / step
        assert abs(values - np.round(values)).max() < 0.02, name
    assert column(made, "p_b").min() >= 0.0


def test_a_clock_stamps_late_and_fast():
    t = 0.01 * np.arange(1000)
    stamps = Clock(drift=0.01, jitter=2e-3).stamps(t, np.random.default_rng(1))
    late = stamps / 1.01 - t
    assert stamps[0] == 0.0
    assert np.ptp(late) == pytest.approx(2e-3, rel=0.05)
    assert np.array_equal(Clock().stamps(t, np.random.default_rng(1)), t)


def test_a_filter_lags_by_its_time_constant():
    t = 0.01 * np.arange(4000)
    assert filtered(t, 0.01 / 0.1)[-1] == pytest.approx(t[-1] - 0.1, abs=0.01)
    assert np.array_equal(filtered(np.full(9, 5.0), 0.1), np.full(9, 5.0))


def test_a_stale_sample_is_that_of_the_cycle_before():
    x = np.arange(10000.0)
    y = logged(x, Sensor(stale=0.01), 0.01, np.random.default_rng(2))
    assert set(np.unique(x - y)) == {0.0, 1.0}
    assert np.mean(x != y) == pytest.approx(0.01, rel=0.3)


def test_a_calibration_goes_to_its_own_sensor():
    true, off = (ahc_sensors(CRANE, 300.0, c) for c in ({}, {"p_a": Calibration(1.01, 2e5)}))
    assert {n for n in true if true[n] != off[n]} == {"p_a"}


# Plan and sea


def test_the_plan_is_that_of_paper_f():
    rows = [(t.load, t.s_w, t.duration) for t in sea_trials().tests if t.kind is Kind.AHC]
    assert rows == [(82e3, 487.0, 200.0), (94e3, 487.0, 1500.0), (164e3, 2314.0, 200.0), (162e3, 2281.0, 300.0)]


def test_a_sea_has_the_height_that_was_asked_for_and_never_comes_round():
    motion = irregular(10.0, 1500.0, 10.0, 2.2, np.random.default_rng(5))
    s = motion.sample(np.arange(20.0, 1500.0, 0.2))[0]
    windows = np.lib.stride_tricks.sliding_window_view(s, 151)
    assert (windows.max(axis=1) - windows.min(axis=1)).max() == pytest.approx(2.2, rel=1e-3)
    s = s - s.mean()
    later = [abs(float(np.mean(s[k:] * s[:-k]) / np.mean(s * s))) for k in range(1500, len(s) - 1500)]
    assert max(later) < 0.6


# Scatter


def test_truths_of_many_seeds_scatter_evenly_around_the_twin():
    truths = [setting(s).reference for s in range(200)]
    for name, half in (
        ("capacitance", 0.03),
        ("leakage", 0.05),
        ("inertia", 0.03),
        ("friction", 0.05),
        ("gas_volume", 0.05),
        ("precharge", 0.01),
    ):
        x = np.array([getattr(t, name) for t in truths])
        assert x.mean() == pytest.approx(1.0, abs=0.01)
        assert abs(x - 1.0).max() <= half
        assert x.std() > 0.4 * half
    assert {getattr(t, n) for t in truths for n in ("gear", "K_1", "pump_limit")} == {1.0}


def test_a_truth_apart_lies_ten_to_thirty_per_cent_off_and_else_where_it_was():
    near, far = setting(7), setting(7, apart=True)
    moved = {
        f.name for f in fields(near.reference) if getattr(near.reference, f.name) != getattr(far.reference, f.name)
    }
    assert moved == {"capacitance", "leakage", "inertia"}
    assert all(0.1 <= abs(getattr(far.reference, n) - 1.0) <= 0.3 for n in moved)
    assert replace(far, reference=near.reference) == near


# Defects


def changes(defect: Defect) -> set[str]:
    """What of the setting a defect changes."""

    def flat(s: Setting) -> dict[str, object]:
        parts = {"reference": s.reference, "clock": s.clock, "faults": s.faults}
        inside = {f"{part}.{f.name}": getattr(of, f.name) for part, of in parts.items() for f in fields(of)}
        return inside | {f.name: getattr(s, f.name) for f in fields(Setting) if f.name not in parts}

    a, b = flat(setting(3)), flat(with_defect(setting(3), CRANE, defect))
    return {name for name in a if a[name] != b[name]}


def test_every_defect_changes_one_number_and_nothing_else():
    touched = {d: changes(d) for d in Defect}
    assert all(len(names) == 1 for names in touched.values()), touched
    assert len({next(iter(names)) for names in touched.values()}) == len(set(DEFECTS)) == len(Defect)


@pytest.mark.parametrize("defect", LOGGER)
def test_a_defect_of_the_log_touches_its_own_columns_alone(write, defect):
    for i in range(len(SHORT.tests)):
        plain, wrong = table(write(), i), table(write(defect), i)
        assert {c for c in plain.columns if not plain[c].equals(wrong[c])} == LOGGER[defect]


def test_a_gap_takes_rows_of_the_longest_log_alone(write):
    plain, wrong = write(), write(Defect.GAP)
    t = column_time(wrong)
    assert np.diff(t).max() == pytest.approx(DEFECTS[Defect.GAP].size, abs=0.05)
    assert table(plain).query("Time in @t").reset_index(drop=True).equals(table(wrong))
    assert table(plain, 1).equals(table(wrong, 1))


def test_swapped_lines_and_a_wrong_unit_are_what_they_say(write):
    plain, swapped, unit = write(), write(Defect.PRESSURE_LINES), write(Defect.LOAD_CELL)
    assert np.array_equal(column(swapped, "p_a"), column(plain, "p_b"))
    assert np.allclose(G * column(unit, "F_w"), column(plain, "F_w"), atol=0.1 * 1e3)


def slope(y: np.ndarray, x: np.ndarray) -> float:
    """Slope of y over x through zero."""
    return float(np.sum(y * x) / np.sum(x * x))


def wire_per_turn(w: WrittenCampaign) -> float:
    """Wire speed over motor speed while the winch runs fast [m/rad]."""
    v, omega = column(w, "v_w", 1), column(w, "omega_m", 1)
    fast = abs(omega) > 200.0
    return slope(v[fast], omega[fast])


def plateau(w: WrittenCampaign, name: str) -> float:
    """Mean of a signal while the winch hoists at its limit."""
    return float(column(w, name, 1)[900:1600].mean())


def stroke_per_flow(w: WrittenCampaign) -> float:
    """Stroke of the pumps over speed and displacement of the motors."""
    return slope(column(w, "alpha_p"), column(w, "omega_m") * column(w, "alpha_m"))


def gas_stiffness(w: WrittenCampaign) -> float:
    """Swing of the pressure over that of the oil that the motors took."""
    V = np.cumsum(column(w, "omega_m") * column(w, "alpha_pm"))[1000:]
    return float(np.polyfit(V, column(w, "p_hp")[1000:], 1)[0])


def starting_command(w: WrittenCampaign) -> float:
    """Pump command over joystick as it leaves its middle, with the motors at full displacement."""
    start = slice(210, 260)
    return float(column(w, "u_p", 1)[start].mean() / column(w, "v_op", 1)[start].mean())


def low_side(w: WrittenCampaign) -> float:
    return float(np.percentile(np.minimum(column(w, "p_a"), column(w, "p_b")), 20))


def mean_of(w: WrittenCampaign, name: str) -> float:
    return float(column(w, name).mean())


RATIOS = [
    (Defect.CLOCK, lambda w: column_time(w)[-1], 1.005, 2e-5),
    (Defect.GEAR, wire_per_turn, 1.0 / 1.02, 2e-3),
    (Defect.FRICTION, lambda w: plateau(w, "p_a") - plateau(w, "p_b"), 1.4, 0.03),  # motors lose more with pressure too
    (Defect.K_1, starting_command, 0.9, 5e-3),  # what the pumps gave behind the brake fades meanwhile
    (Defect.PRECHARGE, lambda w: mean_of(w, "p_hp"), 1.0 + DEFECTS[Defect.PRECHARGE].size, 3e-3),
    (Defect.GAS_VOLUME, gas_stiffness, 1.0 / (1.0 + DEFECTS[Defect.GAS_VOLUME].size), 0.1),  # without the make-up
    (Defect.MOTOR_COUNT, lambda w: mean_of(w, "alpha_pm"), 16.0 / 14.0, 0.01),
    (Defect.ACTIVE_COUNT, stroke_per_flow, 0.8, 5e-3),
    (Defect.DISPLACEMENT, stroke_per_flow, 1.05, 5e-3),
    (Defect.BOOST, low_side, 0.8, 0.03),
]
"""Defect, what shows it in the log, and how that changes."""


@pytest.mark.parametrize(("defect", "shown", "ratio", "within"), RATIOS, ids=lambda x: getattr(x, "__name__", str(x)))
def test_a_defect_shows_in_the_log_by_its_size(write, defect, shown, ratio, within):
    assert shown(write(defect)) / shown(write()) == pytest.approx(ratio, rel=within)


def test_a_drum_with_a_layer_less_has_the_diameter_of_the_layer_below(write):
    drum, pressed = drum_record(CRANE), 1.0 - setting(3).reference.wire_pressed
    layer = np.ceil(layers_filled(drum.L_full - 490.0, drum))
    d = [drum.d + (2.0 * n - 1.0) * pressed * drum.d_wire for n in (layer, layer - 1.0)]
    assert wire_per_turn(write()) == pytest.approx(d[0] * LEVER, rel=2e-3)
    assert wire_per_turn(write(Defect.LAYER)) == pytest.approx(d[1] * LEVER, rel=2e-3)


def test_more_leakage_takes_speed(write):
    """Half of the leak on top; slip and tolerances make up the rest of what is lost."""
    flow = [plateau(w, "omega_m") * plateau(w, "alpha_m") for w in (write(), write(Defect.LEAKAGE))]
    pumps, motors = CRANE.active.pump, CRANE.active.motor
    lost = 1.0 - flow[0] * motors.D_total / (pumps.D_total * pumps.omega_p)
    assert 0.2 * lost < 1.0 - flow[1] / flow[0] < 0.6 * lost


def test_offsets_of_motors_and_transmitter_are_seen(write):
    motors = [
        float((column(w, "alpha_m") - column(w, "u_m"))[1000:].mean()) for w in (write(), write(Defect.MOTOR_OFFSET))
    ]
    assert motors == pytest.approx([0.0, 0.1], abs=0.01)
    d = column(write(Defect.SENSOR_A), "p_a") - column(write(), "p_a")
    assert float(np.median(d)) == pytest.approx(6e5, abs=400e5 / 4096)


def test_a_late_motion_unit_shows_the_same_tip_later(write):
    t, one, late = 0.01 * np.arange(4001), column(write(), "s_tip"), column(write(Defect.MRU_DELAY), "s_tip")
    lags = np.arange(0.0, 0.4, 0.005)
    scatter = [float(np.std((np.interp(t - lag, t, one) - late)[100:])) for lag in lags]
    expected = STATED_DELAY + DEFECTS[Defect.MRU_DELAY].size - setting(3).delay
    assert lags[int(np.argmin(scatter))] == pytest.approx(expected, abs=5e-3)


def test_a_saturation_that_the_twin_has_not_holds_the_command_below_one(write):
    assert abs(column(write(), "u_p", 1)).max() == 1.0
    assert abs(column(write(Defect.SATURATION), "u_p", 1)).max() == pytest.approx(DEFECTS[Defect.SATURATION].size)


def test_dead_motors_leave_their_torque_to_the_active_circuit_and_known_ones_do_not(write):
    def carried(written: WrittenCampaign) -> float:
        """Part of the weight that the pressure of the active circuit carries, hoisting and lowering evened out."""
        T = CRANE.active.motor.D_total * column(written, "alpha_m") * (column(written, "p_a") - column(written, "p_b"))
        w = column(written, "omega_m")
        both = 0.5 * float(T[w > 30.0].mean() + T[w < -30.0].mean())
        return both / (mean_of(written, "F_w") * wire_per_turn(written))

    plain, dead, fewer = (carried(write(d)) for d in (None, Defect.PASSIVE_MOTORS, Defect.MOTOR_COUNT))
    assert dead - plain == pytest.approx(2.0 / 16.0, abs=0.02)
    assert abs(fewer - plain) < 0.02


@pytest.mark.parametrize("defect", Defect)
def test_every_size_of_a_ladder_can_be_made_and_the_usual_one_is_on_it(defect):
    change = DEFECTS[defect]
    assert all(with_defect(setting(0), CRANE, defect, size) != setting(0) for size in change.ladder)
    assert change.size in change.ladder


# Errors


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"defect": "leak"}, r'"leak". Choose one of leakage, friction, layer'),
        ({"seed": -1}, r"seed = -1: .* 0 or more"),
        ({"size": 2}, r"size = 2: .* needs a defect"),
        ({"defect": "gear", "size": float("nan")}, r"size = nan: .* -0.3 to 0.3"),
    ],
)
def test_what_cannot_be_written_is_refused_before_anything_is(tmp_path, options, says):
    with pytest.raises(ValidateError, match=says):
        write_campaign(tmp_path / "c", plan=SHORT, **options)
    assert not (tmp_path / "c").exists()


def test_a_folder_with_logs_is_left_as_it_is(write):
    made = write()
    before = {p: p.read_bytes() for p in made.folder.rglob("*.*")}
    with pytest.raises(SimulationError, match="there are logs already"):
        write_campaign(made.folder, plan=SHORT)
    assert {p: p.read_bytes() for p in made.folder.rglob("*.*")} == before
