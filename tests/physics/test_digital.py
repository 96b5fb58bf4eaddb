"""Digital displacement: an independent machine, cylinder by cylinder, has the lag, the mean and the pattern of the twin's
averaged units; idle cylinders neither leak nor rub under pressure."""

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from tests.physics.test_secondary import BASE, STEADY

from stillhook import Scenario, Session, load_crane, simulate
from stillhook.engine.pack.winch import pack
from stillhook.engine.scenario.checks import foresee
from stillhook.errors import StillhookError
from stillhook.kernels.lanes import VL
from stillhook.library import changed
from stillhook.physics.hydraulics.digital import enabled, setting_acceleration, torque_of_pattern
from stillhook.physics.hydraulics.motor import motor_leakage
from stillhook.physics.hydraulics.motor_laws import motors_dry, motors_moving
from stillhook.physics.hydraulics.motor_losses import MU_OIL, RHO_OIL
from stillhook.physics.hydraulics.swash import Servo
from stillhook.spec.scenario import Operator
from stillhook.winches.types import digital

NAME = "nov-250t-digital"
STROKES_ALONE = Servo(0.0, 0.0, -1.0, 1.0, 1e30, 1e30)
"""No partial strokes: what follows at standstill is nothing."""
MOMENTS = 2e-3
"""Lag and spread of the response, relative: steps of a thousandth of a revolution."""
FOLLOWS = 0.093
"""Largest distance of the two step responses, (1 - cos theta)/2 over half a revolution and the averaged one, of the step
[-]: two moments are the same, not the end of the half sine."""


def cylinders(u: np.ndarray, theta: np.ndarray, N: int) -> np.ndarray:
    """Torque over that of full setting of N cylinders evenly on a shaft at angles theta [rad]: each turn of a piston
    takes a decision of a first-order sigma-delta, and an enabled one gives half a sine over half a revolution."""
    out, debt = np.zeros_like(theta), 0.0
    for k in range(math.ceil(theta[-1] * N / (2.0 * math.pi))):
        at = 2.0 * math.pi * k / N
        debt += float(np.interp(at, theta, u))
        fires = debt >= 0.5
        debt -= fires
        if fires:
            since = theta - at
            out += np.where((since >= 0.0) & (since < math.pi), np.sin(np.clip(since, 0.0, math.pi)), 0.0) * math.pi / N
    return out


def averaged(u: np.ndarray, omega: float, t: np.ndarray, servo: Servo = STROKES_ALONE) -> np.ndarray:
    """Setting of the twin's units at a steady speed."""
    alpha, alpha_dot, out = 0.0, 0.0, []
    for now, h in zip(u, np.diff(t, append=t[-1]), strict=True):
        out.append(alpha)
        alpha_dot += h * setting_acceleration(alpha, alpha_dot, float(now), omega, servo)
        alpha += h * alpha_dot
    return np.array(out)


@pytest.mark.parametrize("omega", [20.0, 105.0])
def test_the_setting_lags_by_a_quarter_of_a_revolution_and_spreads_as_half_a_sine_does(omega):
    """Moments of the impulse response, against those of the pulse of one cylinder: at 1000 rev/min 15 ms."""
    t = np.linspace(0.0, 40.0 / omega, 40000)
    rest = 1.0 - averaged(np.ones_like(t), omega, t)
    h = t[1] - t[0]
    mean, square = rest.sum() * h * omega, 2.0 * (rest * t).sum() * h * omega**2
    angle = np.linspace(0.0, math.pi, 20001)
    pulse = np.sin(angle) / np.sin(angle).sum()
    assert mean == pytest.approx((pulse * angle).sum(), rel=MOMENTS)
    assert square - mean**2 == pytest.approx((pulse * angle**2).sum() - (pulse * angle).sum() ** 2, rel=4.0 * MOMENTS)


@pytest.mark.parametrize(("low", "high"), [(0.2, 0.7), (0.9, 0.35), (0.0, 1.0)])
def test_the_averaged_units_follow_a_step_as_156_cylinders_do(low, high):
    theta = np.linspace(0.0, 8.0 * math.pi, 8001)
    u = np.where(theta < 4.0 * math.pi, low, high)
    apart = averaged(u, 1.0, theta) - cylinders(u, theta, 156)
    late = theta > 3.0 * math.pi
    assert np.max(np.abs(apart[late])) < FOLLOWS * abs(high - low) + math.pi / 156
    assert abs(apart[theta > 7.0 * math.pi].mean()) < 1e-3


@pytest.mark.long
@pytest.mark.parametrize("N", [12, 37, 156])
def test_no_pattern_of_strokes_passes_the_bound_and_some_come_near(N):
    """Torque and energy of the pattern, over settings that beat with the number of cylinders and that do not."""
    theta = np.linspace(0.0, 60.0 * math.pi, 30001)
    bound = torque_of_pattern(1.0, 1.0, N)
    torques, energies = [], []
    for u in (0.5 / N, 1.0 / N, 0.11, 0.3333, 0.5, 0.5 + 0.3 / N, 0.87):
        pattern = (cylinders(np.full_like(theta, u), theta, N) - u)[theta > 4.0 * math.pi]
        energy = np.cumsum(pattern) * (theta[1] - theta[0])
        torques.append(np.max(np.abs(pattern)))
        energies.append(np.max(np.abs(energy - 0.5 * (energy.max() + energy.min()))))
    assert 0.5 * bound < max(torques) <= bound * (1.0 + 1e-9)
    assert 0.5 * bound < max(energies) <= bound * (1.0 + 1e-2)


@cache
def crane(name: str = NAME) -> Any:
    return load_crane(name)


def params(**case: Any) -> Any:
    return pack(crane(), Scenario(**(BASE | case))).params


def test_at_standstill_the_setting_follows_by_partial_strokes_alone():
    servo = params().rail.motor_servo
    t = np.linspace(0.0, 40.0 / servo.omega_n, 40000)
    lag = (1.0 - averaged(np.ones_like(t), 0.0, t, servo)).sum() * (t[1] - t[0])
    assert lag == pytest.approx(2.0 * servo.zeta / servo.omega_n, rel=MOMENTS)


def test_idle_cylinders_neither_leak_nor_rub_under_pressure_and_full_units_are_as_swash_plates():
    p = params()
    motors, idle = p.rail.motors, p.idle
    none, every = enabled(motors, 0.0, idle), enabled(motors, 1.0, idle)
    assert motor_leakage(100.0, none) == 0.0
    assert motors_dry(100.0, 0.0, 3e7, none) == pytest.approx(idle * motors_dry(100.0, 0.0, 0.0, motors))
    assert motors_moving(100.0, 1.0, 0.0, none) == pytest.approx(idle * motors_moving(100.0, 1.0, 0.0, motors))
    assert motors_dry(100.0, 1.0, 3e7, every) == motors_dry(100.0, 1.0, 3e7, motors)
    assert motors_moving(100.0, 1.0, 0.0, every) == motors_moving(100.0, 1.0, 0.0, motors)
    assert motor_leakage(100.0, every) == motor_leakage(100.0, motors)


def test_without_idle_loss_the_efficiency_does_not_depend_on_the_setting():
    """Each enabled stroke loses what it loses at full setting."""
    motors, dp, omega = params().rail.motors, 2.5e7, 100.0

    def efficiency(alpha: float, idle: float) -> float:
        now = enabled(motors, alpha, idle)
        D = motors.count * motors.D_max * alpha
        lost = motors_dry(omega, alpha, dp, now) + motors_moving(omega, 1.0, dp, now)
        return (1.0 - lost / (D * dp)) / (1.0 + motor_leakage(omega, now) * dp / (D * omega))

    assert efficiency(0.1, 0.0) == pytest.approx(efficiency(1.0, 0.0), rel=1e-12)
    assert efficiency(0.1, 0.1) < efficiency(0.3, 0.1) < efficiency(1.0, 0.1)


def test_a_rail_of_digital_units_takes_less_power_than_one_of_swash_plates():
    """The same swell on the same rail: light loads save more."""
    saved = []
    for load in ("30 t", "125 t"):
        case = Scenario(**(BASE | {"load": load, "duration": "120 s"}))
        powers = []
        for name in (NAME, "nov-250t-secondary"):
            run = simulate(crane(name), case)
            assert run.status.item() == "ok"
            assert abs(float(run.energy_unaccounted)) < 1e-3
            powers.append(float(run.P_hpu.values[run.time.values > 40.0].mean()))
        saved.append(1.0 - powers[0] / powers[1])
    assert saved[0] > saved[1] > 0.0


def test_the_steady_speed_limit_is_where_a_run_passes_the_power_units():
    p = params(load="200 t", mode="manual", tip="still")
    geo = digital.geometry(380.0, p)
    omega, cause = digital.speed_limit(p, geo, p.hoist.load.W)
    assert cause == "power"
    assert digital.steady_torque(p, geo, p.hoist.load.W, omega) > p.hoist.load.W * geo.r_eff
    P = digital.steady_flow(p, digital.steady_torque(p, geo, p.hoist.load.W, omega), omega)
    assert P * (p.rail.settings.p_set - p.rail.settings.p_lp) == pytest.approx(p.plc.power.P_max, rel=1e-6)


def test_few_cylinders_on_a_light_hook_are_told_with_what_their_pattern_moves():
    few = changed(crane(), {"digital": {"cylinders": 1}})
    case = Scenario(**(BASE | {"load": "30 t"}))
    assert "strokes of 13 cylinders are averaged: their pattern adds at most" in simulate(few, case).notes.item()
    assert "cylinders are averaged" not in simulate(crane(), Scenario(**BASE)).notes.item()


def test_a_map_that_ends_below_the_full_displacement_of_the_units_is_noted():
    words = "a unit loses at 355 cm^3/rev, and its map ends at 215 cm^3/rev: the loss is held there, and too small"
    case = Scenario(**(BASE | {"duration": "2 s", "warm_up": "0 s"}))
    small = {"secondary": {"unit": {"loss_model": {"law": "map", "map": "motor-map"}, "D_max": "215 cm^3/rev"}}}
    assert any(words in note for note in foresee(with_model({"law": "map", "map": "motor-map"}), case).notes)
    assert not any("its map ends" in note for note in foresee(changed(crane(), small), case).notes)


def test_half_the_step_gives_the_same():
    case = Scenario(**(BASE | {"tip": "sine 2 m 8 s", "duration": "60 s"}))
    one, half = (simulate(crane(), case, step=step) for step in ("2 ms", "1 ms"))
    assert np.max(np.abs(one.e_c.values - half.e_c.values)) < 1e-4


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"digital": {"cylinders": 0}}, "digital.cylinders = 0"),
        ({"digital": {"cylinder": 3}}, "unknown field"),
        ({"digital": {"idle": 1.5}}, "digital.idle = 1.5"),
        ({"secondary": {"drive": {"K": "60 1/s"}}}, "drive.K 60 1/s makes the speed control unstable"),
    ],
)
def test_a_table_that_cannot_be_is_refused_in_one_line(changes, words):
    with pytest.raises(StillhookError) as refused:
        changed(crane(), changes)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


LOSS = {"law": "mj3", "C": [9.0, 2.1e-6, 1.3, 5.1e7]}
"""A model that knows no displacement in its dry terms, which of digital units is that of an enabled cylinder."""


def with_model(model: dict[str, Any]) -> Any:
    return changed(crane(), {"secondary": {"unit": {"loss_model": model}}})


def mj6_of(loss: Any) -> dict[str, Any]:
    """The MJ4 of a crane file as an MJ6 without loss at the notches."""
    return {"law": "mj6", "C": [loss.X_4, loss.X_3, loss.X_1 / MU_OIL, loss.X_5, loss.X_2 / RHO_OIL, 0.0]}


def test_a_winch_with_another_model_that_is_mj4_runs_as_with_mj4():
    """Two ways to the same units: MJ4 by its terms, and any other model as enabled and idle cylinders."""
    case = Scenario(**(BASE | {"load": "60 t", "duration": "60 s"}))
    own, other = (simulate(c, case) for c in (crane(), with_model(mj6_of(crane().secondary.unit.loss))))
    for name in ("p_r", "alpha_s", "omega_m", "T_f", "e_c"):
        apart, size = np.max(np.abs(own[name].values - other[name].values)), np.max(np.abs(own[name].values))
        assert apart < 1e-12 * size, name


def test_a_session_and_sixteen_lanes_have_the_bits_of_a_run_with_another_model():
    machine, case = with_model(LOSS), Scenario(**(BASE | {"duration": "4 s", "warm_up": "0 s"}))
    run = simulate(machine, case, step="2 ms", every="10 ms")
    many = simulate(machine, [case] * VL, step="2 ms")
    assert many.e_c_pp.values.tolist() == [run.e_c_pp.item()] * VL
    session = Session(machine, case, step="2 ms")
    pressures = {}
    while session.time < 3.9:
        session.step()
        pressures[round(session.time, 6)] = session.get("p_r")
    same = [
        pressures[t] == p
        for t, p in zip(run.time.values.round(6).tolist(), run.p_r.values, strict=True)
        if t in pressures
    ]
    assert len(same) > 300
    assert all(same)


def test_at_a_steady_speed_the_units_lose_what_their_model_says_of_enabled_and_idle_cylinders():
    """Of the record of a run, without the twin's functions: torque balance, and the rail's oil by what the units take."""
    case = Scenario(
        **(BASE | {"load": "60 t", "mode": "manual", "tip": "still", "duration": "12 s", "warm_up": "0 s"}),
        operator=Operator(profile=(("0 s", "0 m/min"), ("2 s", "12 m/min"), ("12 s", "12 m/min"))),
    )
    machine = with_model(LOSS)
    run = simulate(machine, case).isel(time=-1)
    unit, table, friction = machine.secondary.unit, machine.secondary, machine.friction.system
    alpha, omega, dp = float(run.alpha_s), float(run.omega_m), float(run.p_r) - table.p_lp
    C_e, C_f, C_g, C_i = LOSS["C"]
    speed = C_g * MU_OIL * omega + C_i * RHO_OIL * omega**2 * unit.D_max**3
    enabled_cylinders, idle_cylinders = C_e + C_f * dp + speed, machine.digital.idle * (C_e + speed)
    T_units = unit.count * (alpha * enabled_cylinders + (1.0 - alpha) * idle_cylinders)
    T_w = float(run.F_w) * float(run.v_w) / omega
    T_d = T_w * machine.i_hD
    fading = (friction.Y_1 * T_d + friction.Y_3) * math.exp(-omega / friction.Y_4)
    T_shaft = unit.count * (fading + friction.Y_2 + friction.Y_5 * omega + friction.Y_6 * T_d)
    assert float(run.T_f) == pytest.approx(T_units + T_shaft, rel=STEADY)
    assert 0.15 * T_shaft < T_units
    assert unit.count * unit.D_max * alpha * dp == pytest.approx(T_w + float(run.T_f), rel=STEADY)
