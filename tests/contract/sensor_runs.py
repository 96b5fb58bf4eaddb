"""Runs with sensors, in a process that knows the one of the how-to page and one that multiplies: `test_sensors.py` starts
`python -m pytest tests/contract/sensor_runs.py` with both."""

from __future__ import annotations

import numpy as np
import pytest
from tests.export.conftest import compiled  # noqa: F401, a fixture
from tests.export.twin.host import OK, Host
from tests.export.twin.test_core import TIP, case_of, hosted, rows, series

import stillhook
from stillhook.control.interface import QUANTITIES
from stillhook.export.twin import export
from stillhook.library import changed, cranes

SLIP = 0.02
QUICK = ("nov-100t-pure-active",)


def with_sensors(crane: str = "nov-100t-pure-active", **tables: object) -> stillhook.Crane:
    return changed(stillhook.load_crane(crane), {"sensors": tables})


def wheel(**settings: object) -> stillhook.Crane:
    """A wheel beside a cell that reads what is true: one machine code serves both."""
    return with_sensors(measuring_wheel=settings or {"slip": SLIP, "tau": "30 ms"}, cell={"k": 1.0})


def with_cell(k: float) -> stillhook.Crane:
    """A cell beside a wheel that reads what is true, to a micrometre."""
    return with_sensors(measuring_wheel={"tau": "0 s", "count": "0.001 mm"}, cell={"k": k})


SHORT = {"load": "50 t", "s_w": "100 m", "duration": "30 s", "warm_up": "5 s"}
LOWERED = {"profile": [("2 s", "0 m/min"), ("3 s", "-20 m/min"), ("18 s", "-20 m/min"), ("19 s", "0 m/min")]}
CASE = stillhook.Scenario(
    load="50 t", s_w="100 m", tip="sine 1 m 10 s", mode="ssc", duration="30 s", warm_up="5 s", operator=LOWERED
)


@pytest.mark.parametrize("name", [c if c in QUICK else pytest.param(c, marks=pytest.mark.thorough) for c in cranes()])
def test_sensors_that_read_what_is_true_leave_every_bit_as_it_was(name: str) -> None:
    """All quantities of the PLC through a sensor each, by a factor of 1."""
    crane = stillhook.load_crane(name)
    case = CASE.with_mode(crane.plant.type.default_mode).model_copy(update={"load": min(50e3, 0.3 * crane.SWL)})
    plain, read = (stillhook.simulate(c, case, series=True) for c in (crane, with_sensors(name, factor={"k": 1.0})))
    assert len(QUANTITIES) == 11
    for signal in plain.data_vars:
        if plain[signal].dtype.kind == "f":
            assert np.array_equal(plain[signal].values, read[signal].values, equal_nan=True), signal


@pytest.mark.parametrize("name", [c if c in QUICK else pytest.param(c, marks=pytest.mark.thorough) for c in cranes()])
def test_motor_speed_and_line_pressures_are_those_of_the_winch(name: str) -> None:
    """A cylinder winch has the speed of its drum's motors; one without lines A and B reads 0."""
    crane = with_sensors(name, factor={"k": 1.0})
    case = CASE.with_mode(crane.plant.type.default_mode).model_copy(update={"load": min(50e3, 0.3 * crane.SWL)})
    run = stillhook.simulate(crane, case, series=True)
    dp = np.asarray(run.dp_measured)
    if "p_a" in run:
        assert np.array_equal(run.p_a_measured, run.p_a)
        assert np.array_equal(run.p_b_measured, run.p_b)
        assert np.array_equal(dp, run.p_a - run.p_b)
    else:
        assert not np.any(run.p_a_measured)
        assert not np.any(run.p_b_measured)
    if "omega_m" in run:
        assert np.array_equal(run.omega_m_measured, run.omega_m)
    else:
        radius = run.v_drum / run.omega_m_measured * crane.i_hD
        turning = np.abs(run.v_drum) > 1e-3
        assert turning.any()
        assert np.all(
            (radius[turning] >= 0.5 * crane.drum.d) & (radius[turning] <= 0.5 * crane.drum.d_max + crane.wire.d)
        )


def test_a_transmitter_that_reads_more_on_line_a_changes_the_difference_that_the_plc_uses() -> None:
    run = stillhook.simulate(with_sensors(gauge={"k": 1.2}), CASE, series=True)
    assert np.allclose(run.p_a_measured, 1.2 * run.p_a, rtol=1e-12)
    both = stillhook.simulate(with_sensors(gauge={"k": 1.2}, difference={"k": 0.5}), CASE, series=True)
    assert np.allclose(both.dp_measured, 0.5 * (1.2 * both.p_a - both.p_b), rtol=1e-9, atol=1.0)
    limited = stillhook.simulate(with_sensors(difference={"k": 0.5}), CASE, series=True)
    assert np.allclose(limited.dp_measured, 0.5 * (limited.p_a - limited.p_b), rtol=1e-12)


def test_what_a_scenario_adds_comes_behind_the_sensor_of_the_crane() -> None:
    """The wheel slips, and the scenario's offset is added to what it reads."""
    off = CASE.model_copy(update={"sensors": stillhook.Scenario(**SHORT, sensors={"s_w": {"offset": "50 mm"}}).sensors})
    run = series(wheel(slip=SLIP, count="0.001 mm"), off)
    assert np.allclose(run.s_w_measured[1:], 100.05 + (1.0 + SLIP) * (run.s_w[1:] - 100.0), atol=2e-6)


def test_a_winch_without_lines_has_no_difference_that_follows_them() -> None:
    """Secondary control reads by dp whether its units carry the load, whatever a transmitter of line A says."""
    name = next(c for c in cranes() if stillhook.load_crane(c).plant.type.name == "secondary")
    case = CASE.with_mode("position")
    plain, read = (stillhook.simulate(with_sensors(name, **t), case) for t in ({}, {"gauge": {"k": 5.0}}))
    assert float(plain.e_c_pp) == float(read.e_c_pp)


def test_a_load_cell_that_reads_more_makes_the_motors_keep_more_displacement() -> None:
    """Under a fast tip semi-secondary control takes the motors down to what the load needs: 1.5 times the load, as it
    reads, is more."""
    fast = stillhook.Scenario(
        load="80 t", s_w="100 m", tip="sine 3.5 m 10 s", mode="ssc", duration="60 s", warm_up="30 s"
    )
    least = [float(stillhook.simulate(crane, fast).alpha_m_min) for crane in (with_sensors(), with_cell(k=1.5))]
    assert least[1] > 1.2 * least[0]


def test_a_session_and_many_lanes_read_as_a_run_does() -> None:
    crane = wheel()
    run = series(crane, CASE)
    session = stillhook.Session(crane, CASE)
    session.step(cycles=1000)
    kept = session.save()
    session.step(cycles=1000)
    after = session.get("s_w"), session.get("e_c_measured")
    session.restore(kept)
    session.step(cycles=1000)
    assert after == (session.get("s_w"), session.get("e_c_measured"))
    assert after[0] == float(run.s_w.sel(time=20.0, method="nearest"))
    many = stillhook.simulate(crane, [CASE] * 17, step="5 ms")
    single = stillhook.simulate(crane, CASE, step="5 ms")
    assert set(many.e_c_mean.values.tolist()) == {float(single.e_c_mean)}


def test_what_the_wheel_slips_is_what_the_winch_is_off() -> None:
    """Only the way since it was set counts."""
    run = series(wheel(slip=SLIP, count="0.001 mm"), CASE)
    assert np.allclose(run.s_w_measured, run.s_w + run.e_c - run.e_c_measured, atol=1e-9)
    assert np.allclose(run.s_w_measured, 100.0 + (1.0 + SLIP) * (run.s_w - 100.0), atol=2e-6)


def test_a_winch_on_a_host_s_wire_reads_by_its_sensors() -> None:
    session = stillhook.Session(wheel(slip=SLIP, count="0.001 mm"), CASE, coupling="wire")
    start = session.get("s_w")
    session.step(cycles=1800)
    travel = session.get("s_w") - start
    assert travel > 1.0
    assert session.get("e_c") - session.get("e_c_measured") == pytest.approx(SLIP * travel, abs=1e-5)


def test_an_export_reads_by_the_sensors_of_its_crane(compiled) -> None:  # noqa: F811
    crane = wheel()
    case = case_of(crane)
    made, run = export(crane, case), series(crane, case)
    assert {"measuring-wheel.slip", "measuring-wheel.tau", "measuring-wheel.count"} <= {p.name for p in made.ports}
    names = ("s_w", "s_w_measured", "e_c", "e_c_measured", "u_p")
    host, signals = hosted(made, compiled, rows(crane, case), names)
    for signal, values in zip(names, signals, strict=True):
        assert np.abs(values - run[signal].values).max() < 1e-9, signal
    assert host.get("measuring-wheel.slip") == SLIP


def test_a_plant_alone_gives_what_its_sensors_read(compiled) -> None:  # noqa: F811
    crane = wheel(slip=SLIP, count="0.001 mm")
    made = export(crane, case_of(crane), contents="plant")
    host = Host(made, compiled)
    host.set(**dict.fromkeys(TIP, 0.0), u_p=-0.3)
    assert host.start() == OK
    start = host.get("s_w")
    for k in range(500):
        assert host.step(k * made.t_cycle, made.t_cycle) == OK
    travel = host.get("s_w") - start
    assert travel > 0.3
    assert host.get("sensed_s_w") - host.get("s_w") == pytest.approx(SLIP * travel, abs=1e-5)


def test_a_lowering_comes_to_the_depth_that_its_wheel_reads() -> None:
    """The supervisor stops where the wire out that it reads is that of the phase."""
    lift = stillhook.Lowering(
        payload=stillhook.read_payload("template-120t"),
        h_tip="36 m",
        depth="300 m",
        start_depth="100 m",
        programme=[{"mode": "ahc", "speed": "30 m/min", "depth": "120 m"}, {"mode": "ahc", "time": "20 s"}],
        duration="90 s",
    )
    plain, slipping = (
        stillhook.simulate(
            with_sensors("nov-250t", measuring_wheel={"slip": s, "count": "0.001 mm"}), lift, series=True
        )
        for s in (0.0, SLIP)
    )
    travel = float(plain.s_w[-1] - plain.s_w[0])
    assert travel > 15.0
    assert float(plain.s_w[-1] - slipping.s_w[-1]) / travel == pytest.approx(SLIP / (1.0 + SLIP), rel=0.1)
