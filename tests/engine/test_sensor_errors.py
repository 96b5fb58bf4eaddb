"""Every sensor of a scenario is late, off, drifting, noisy, stepped or at fault as its table says, in every way to run."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import stillhook
from stillhook.control import sensor_errors
from stillhook.control.interface import QUANTITIES
from stillhook.control.sensor_errors import NO_FAULT, RING, Fault, begin, normal, reading
from stillhook.errors import ScenarioError, StillhookError
from stillhook.spec.scenario import Scenario, Sensors

H = 0.01
CRANE = "nov-100t-pure-active"
PLAIN = {"load": "50 t", "s_w": "100 m", "tip": "sine 1 m 9 s", "mode": "ssc", "duration": "20 s", "warm_up": "5 s"}
ROUNDING = 1e-9


def errors(seed: int = 1, faults: tuple[Fault, ...] = (), **values: float) -> sensor_errors.Settings:
    given_values = dict.fromkeys(("offset", "drift", "noise", "step", "delay"), 0.0) | values
    padded = (*faults, *[NO_FAULT] * (sensor_errors.FAULTS - len(faults)))
    return sensor_errors.Settings(**given_values, seed=float(seed), **{f"fault_{i}": f for i, f in enumerate(padded)})


def signal(true: list[float], s: sensor_errors.Settings, at_rest: float | None = None) -> list[float]:
    m, out = begin(true[0] if at_rest is None else at_rest, s), []
    for x in true:
        read, m = reading(x, H, s, m)
        out.append(read)
    return out


# --- one sensor -----------------------------------------------------------------------------------------------------


@given(st.lists(st.floats(-1e9, 1e9), min_size=1, max_size=60))
def test_a_sensor_without_errors_reads_what_is_true(true):
    assert signal(true, errors()) == true


@settings(deadline=None)
@given(st.lists(st.floats(-1e6, 1e6), min_size=RING + 2, max_size=60), st.integers(0, RING))
def test_a_late_signal_is_that_of_so_many_cycles_ago(true, cycles):
    late = signal(true, errors(delay=cycles * H))
    for k in range(len(true)):
        assert late[k] == pytest.approx(true[max(k - cycles, 0)], abs=1e-6)


def test_a_delay_of_part_of_a_cycle_lies_between_the_two():
    true = [math.sin(0.1 * k) for k in range(100)]
    late = signal(true, errors(delay=3.25 * H))
    wanted = [0.75 * true[k - 3] + 0.25 * true[k - 4] for k in range(4, 100)]
    assert late[4:] == pytest.approx(wanted, abs=1e-12)


def test_offset_and_drift_add_and_a_drift_is_what_comes_in_an_hour():
    read = signal([5.0] * 1001, errors(offset=2.0, drift=3.6))
    assert read[0] == 7.0
    assert read[1000] == pytest.approx(7.0 + 3.6 * 10.0 / 3600.0)


@given(st.floats(-1e3, 1e3), st.floats(1e-3, 10.0))
def test_a_step_is_kept_and_never_off_by_more_than_half(true, step):
    (read,) = signal([true], errors(step=step))
    assert abs(read - true) <= 0.5 * step * (1.0 + ROUNDING) + ROUNDING
    assert read / step == pytest.approx(round(read / step), abs=1e-6)


def test_a_frozen_signal_stands_at_what_was_read_last_and_a_value_is_that_value():
    true = [float(k) for k in range(60)]
    faults = (Fault(0.1, 0.2, 1.0, 0.0), Fault(0.3, 0.4, 0.0, -7.0), Fault(0.35, 0.5, 1.0, 0.0))
    read = signal(true, errors(faults=faults))
    assert read[:10] == true[:10]
    assert set(read[10:20]) == {9.0}
    assert read[20:30] == true[20:30]
    assert set(read[30:35]) == {-7.0}
    assert set(read[35:50]) == {-7.0}  # frozen at what was read last, which the earlier fault made
    assert read[50:] == true[50:]


def test_noise_is_white_normal_and_of_the_deviation_that_is_given():
    """100,000 numbers: mean, deviation, skewness, kurtosis (2.9 of a sum of twelve) and neighbours within 4 sd."""
    n = 100_000
    state, values = 12345.0, np.empty(n)
    for i in range(n):
        values[i], state = normal(state)
    assert abs(values.mean()) < 4.0 / math.sqrt(n)
    assert abs(values.std() - 1.0) < 4.0 / math.sqrt(2.0 * n)
    assert abs((values**3).mean()) < 4.0 * math.sqrt(15.0 / n)
    assert abs((values**4).mean() - 2.9) < 4.0 * math.sqrt(96.0 / n)
    for lag in (1, 2, 7, 100):
        assert abs((values[lag:] * values[:-lag]).mean()) < 4.0 / math.sqrt(n)
    assert np.abs(values).max() < 6.0
    read = np.array(signal([3.0] * 4000, errors(seed=77, noise=0.5)))
    assert abs(read.std() - 0.5) < 4.0 * 0.5 / math.sqrt(8000.0)


def test_states_of_the_noise_stay_whole_numbers_within_their_range():
    x = sensor_errors.MODULUS - 1.0
    for _ in range(2000):
        wanted = int(x) * 16807 % 2147483647
        x = sensor_errors.following(x)
        assert x == wanted


# --- runs -----------------------------------------------------------------------------------------------------------


@functools.cache
def crane(name: str = CRANE) -> stillhook.Crane:
    return stillhook.load_crane(name)


def run(sensors: dict[str, object], name: str = CRANE, **more: object):
    return stillhook.simulate(crane(name), Scenario(**(PLAIN | more), sensors=sensors), series=True)


OFFSETS = {
    "s_tip": ("20 mm", 0.02),
    "v_tip": ("1 mm/s", 1e-3),
    "a_tip": ("0.01 m/s^2", 0.01),
    "s_w": ("30 mm", 0.03),
    "F": ("5 kN", 5e3),
    "alpha_m": (-0.01, -0.01),
    "omega_m": ("1 rpm", 2.0 * math.pi / 60.0),
    "p_a": ("2 bar", 2e5),
    "p_b": ("1 bar", 1e5),
    "p_hp": ("3 bar", 3e5),
}


PISTON = 0.5e5
"""What the resistance of the accumulator's piston leaves of its pressure over some waves [Pa]."""


@pytest.mark.slow
def test_every_quantity_is_read_with_its_own_error() -> None:
    series = run({name: {"offset": text} for name, (text, _) in OFFSETS.items()}, "nov-250t", load="80 t")
    true = {"F": series.F_w} | {name: series[name] for name in OFFSETS if name != "F"}
    for name, (_, offset) in OFFSETS.items():
        off = np.asarray(series[f"{name}_measured"] - true[name])
        if name == "p_hp":  # read at the gas: between it and the motors is the piston's resistance, either way
            assert abs(off.mean() - offset) < PISTON
            continue
        assert np.allclose(off[1:], offset, rtol=1e-6, atol=1e-3 * abs(offset)), name
    assert set(OFFSETS) | {"dp"} == set(QUANTITIES)


def test_a_pressure_that_is_read_wrong_changes_the_difference_that_the_plc_uses() -> None:
    series = run({"p_a": {"offset": "4 bar"}, "dp": {"offset": "1 bar"}})
    assert np.allclose(series.dp_measured - (series.p_a - series.p_b), 5e5, rtol=1e-9)


def test_a_table_without_errors_leaves_every_bit_as_it_was() -> None:
    plain, read = run({}), run({"p_a": {}, "s_w": {}})
    for name in plain.data_vars:
        if plain[name].dtype.kind == "f":
            assert np.array_equal(plain[name], read[name], equal_nan=True), name


def test_an_encoder_that_freezes_moves_the_load() -> None:
    fault = {"time": "10 s", "until": "12 s", "kind": "frozen"}
    plain, frozen = run({}), run({"s_w": {"faults": [fault]}})
    t = frozen.time.values
    held = frozen.s_w_measured.values[(t > 10.02) & (t < 11.98)]
    assert np.ptp(held) < ROUNDING
    moved = np.abs(frozen.e_c - plain.e_c).values
    assert moved[t < 10.0].max() == 0.0
    assert moved[(t > 10.0) & (t < 12.5)].max() > 0.05


def test_noise_follows_the_seed_and_each_quantity_has_its_own() -> None:
    def noise(seed: int):
        series = run({"p_a": {"noise": "1 bar"}, "p_b": {"noise": "1 bar"}, "seed": seed})
        return [np.asarray(series[f"{p}_measured"] - series[p])[1:] for p in ("p_a", "p_b")]

    (a, b), (again, _), (other, _) = noise(3), noise(3), noise(4)
    assert np.array_equal(a, again)
    for x in (b, other):
        assert abs(np.corrcoef(a, x)[0, 1]) < 4.0 / math.sqrt(len(a))
    assert a.std() == pytest.approx(1e5, rel=0.25)


def test_cases_with_and_without_errors_run_side_by_side_as_alone() -> None:
    noisy = Scenario(**PLAIN, sensors={"s_w": {"noise": "1 mm", "delay": "25 ms"}})
    cases = [noisy, Scenario(**PLAIN)] * 9
    many = stillhook.simulate(crane(), cases, step="5 ms").e_c_mean.values
    alone = [float(stillhook.simulate(crane(), case, step="5 ms").e_c_mean) for case in cases[:2]]
    assert set(many[::2]) == {alone[0]}
    assert set(many[1::2]) == {alone[1]}
    assert alone[0] != alone[1]


def test_a_session_reads_as_a_run_does_and_goes_on_from_where_it_was_saved() -> None:
    case = Scenario(**PLAIN, sensors={"p_a": {"noise": "1 bar", "drift": "60 bar"}, "s_w": {"delay": "30 ms"}})
    series = stillhook.simulate(crane(), case, series=True)
    session = stillhook.Session(crane(), case)
    session.step(cycles=500)
    kept = session.save()
    session.step(cycles=500)
    after = session.get("s_w"), session.get("p_a_measured")
    assert after[0] == float(series.s_w.sel(time=10.0, method="nearest"))
    session.restore(kept)
    session.step(cycles=500)
    assert after == (session.get("s_w"), session.get("p_a_measured"))


def test_a_lowering_reads_through_the_tables_of_its_lift() -> None:
    lift = stillhook.Lowering(
        payload=stillhook.read_payload("template-120t"),
        h_tip="36 m",
        depth="300 m",
        start_depth="100 m",
        programme=[{"mode": "ahc", "speed": "30 m/min", "depth": "104 m"}],
        duration="20 s",
        sensors={"s_w": {"offset": "0.2 m"}},
    )
    series = stillhook.simulate(crane("nov-250t"), lift, series=True)
    assert np.allclose((series.s_w_measured - series.s_w)[1:], 0.2, atol=1e-3)


def test_a_scenario_with_tables_is_stored_and_read_back() -> None:
    fault = {"time": "10 s", "until": "12 s", "kind": "value", "value": "3 bar"}
    case = Scenario(**PLAIN, sensors={"p_a": {"noise": "0.5 bar", "faults": [fault]}, "alpha_m": {"step": 0.01}})
    assert Scenario.from_dict(case.to_dict()) == case
    assert not set(Scenario(**PLAIN).to_dict()["sensors"]) & set(QUANTITIES)


WHOLE = {"time": "1 s", "until": "2 s", "kind": "frozen"}


@pytest.mark.parametrize(
    ("tables", "line"),
    [
        ({"p_a": {"noise": "1 m"}}, 'Sensors.p_a.noise = "1 m": unit "m" is not one of'),
        ({"p_a": {"noise": 1.0}}, "Sensors.p_a.noise = 1.0: a bare number"),
        ({"p_a": {"noise": "-1 bar"}}, 'Sensors.p_a.noise = "-1 bar": it must be greater than or equal to 0.'),
        ({"p_a": {"noise": "1e6 bar"}}, "Sensors.p_a.noise"),
        ({"p_c": {}}, "Sensors.p_c: unknown field"),
        ({"p_a": {"nois": "1 bar"}}, 'Sensors.p_a.nois: unknown field; did you mean "noise"?'),
        ({"p_a": {"faults": [WHOLE | {"kind": "stuck"}]}}, "Sensors.p_a.faults[0].kind"),
        ({"p_a": {"faults": [WHOLE | {"until": "1 s"}]}}, "until 1 s is not after time 1 s"),
        ({"p_a": {"faults": [WHOLE | {"value": "1 bar"}]}}, 'value belongs to kind = "value"'),
        ({"p_a": {"faults": [WHOLE | {"kind": "value"}]}}, 'value belongs to kind = "value"'),
        ({"p_a": {"faults": [WHOLE] * 5}}, "Sensors.p_a.faults"),
        ({"s_w": {}, "noise_s_w": "1 mm"}, "noise_s_w and the table s_w are both given"),
    ],
)
def test_a_table_that_cannot_be_is_refused_in_one_line(tables, line) -> None:
    with pytest.raises(ScenarioError) as refused:
        Sensors(**tables)
    assert line in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("name", "tables", "line"),
    [
        (CRANE, {"p_a": {"delay": "0.21 s"}}, "sensors.p_a.delay 0.21 s is more than 20 PLC cycles, 0.2 s"),
        ("nov-100t-electric", {"p_b": {}}, 'sensors.p_b: winch type "electric" has no lines A and B'),
        ("nov-100t-electric", {"alpha_m": {}}, 'sensors.alpha_m: winch type "electric" sets no displacement'),
    ],
)
def test_a_table_that_does_not_fit_the_winch_is_refused_in_one_line(name, tables, line) -> None:
    mode = crane(name).plant.type.default_mode
    with pytest.raises(StillhookError) as refused:
        run(tables, name, mode=mode)
    assert line in str(refused.value)
    assert "\n" not in str(refused.value)
