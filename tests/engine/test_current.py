"""A current past a payload: its part in the vertical drag, in lowerings and on a wire alone."""

import math

import numpy as np
import pytest
from scipy.optimize import curve_fit
from tests.conservation.test_lowering_energy import LANDING, ROUNDING, through_the_wire
from tests.conservation.test_lowering_energy import lift as landing
from tests.engine.lifts import RAO, X, Y, sea
from tests.engine.test_lowering import TRANSFER, box, deep, exact, harmonic, stiff, still_winch

from stillhook import load_crane
from stillhook.engine.pack.winch import pack
from stillhook.engine.simulate import run_cases, simulate, unchanged
from stillhook.errors import LiftError
from stillhook.formats.lift_file import load_lift
from stillhook.formats.lift_writer import Run, write_lift
from stillhook.formats.results import load_run, rerun, save_run
from stillhook.physics.load_path.drum import wire_stiffness
from stillhook.physics.scalar import G
from stillhook.response.suspended_load import (
    drag_of_gaussian,
    mean_drag,
    natural_periods,
    suspended_load,
    transfers,
)
from stillhook.sea.motion.motion import Profile, Sine, Still
from stillhook.sea.steady_flow import Current
from stillhook.spec.lift.lowering import InSea
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase
from stillhook.spec.scenario import Scenario, Water

CRANE = load_crane("nov-250t")
LINEAR = 1e-3
"""The drag of a harmonic motion is that of 1 + 3/8 (v/U)^2 times the linear damping; here v < 0.04 U."""
HALVES = 1e-3
"""Of a mean over 64 points."""


def current(*U: float, bottom: float = 4000.0) -> Current:
    depth = np.linspace(0.0, bottom, len(U)) if len(U) > 1 else [0.0]
    flow = {"speed": [f"{u} m/s" for u in U], "depth": [f"{h} m" for h in depth]}
    return Current.model_validate(flow | {"direction": "30 deg", "sense": "coming-from"})


def test_near_resonance_a_load_in_a_current_moves_as_the_exact_rod_with_linear_drag_says():
    """Of a motion far slower than the current: 1/2 rho C_D A U. In still water the load moves several times as far."""
    load = box(A33=50.0, A_p=30.0)
    calm = still_winch("1500 m", Sine(amplitude="2 cm", period="4 s"), load=load, duration="400 s")
    T = float(natural_periods(*exact(deep(0.01), calm))[0])
    calm = calm.model_copy(update={"tip": Sine(amplitude="4 mm", period=f"{T} s")})
    U, omega = 1.5, 2.0 * math.pi / T
    answers = []
    for case in (calm, calm.model_copy(update={"current": current(U)})):
        run = simulate(deep(0.01), case, every="50 ms")
        late = run.time.values > 320.0
        t = run.time.values[late]
        u, q = (harmonic(t, y.values[late], omega) for y in (run.s_tip - (run.s_w - run.s_w[0]), run.s_load))
        answers.append(q / u)
    drag = 0.5 * calm.rho * load.C_D * 30.0 * U
    wanted = transfers(np.array([omega]), *exact(deep(0.01), calm), drag=drag).load_u[0]
    assert abs(answers[1] / wanted - 1.0) < TRANSFER + LINEAR
    assert abs(answers[0]) > 2.0 * abs(answers[1])


def test_an_oscillation_in_a_current_decays_by_half_its_linear_drag_over_the_mass_of_the_mode():
    """c / (2 M), M the mass of the exact rod's first mode as the payload moves by 1."""
    case = still_winch("1500 m", Profile.from_si([0.0, 0.5, 1.0], [0.0, 0.01, 0.0]), load=box(A33=50.0, A_p=30.0))
    run = simulate(
        stiff(), case.model_copy(update={"current": current(1.5), "duration": 30.0}), every="10 ms", step="2 ms"
    )
    rod, end = exact(stiff(), case)
    omega = 2.0 * math.pi / natural_periods(rod, end)[0]
    a, s = omega * math.sqrt(rod.mu / rod.EA), np.linspace(0.0, rod.L, 2001)
    shape = np.cos(a * s) + rod.k_top / (rod.EA * a) * np.sin(a * s)
    load = shape[-1] / (1.0 - omega**2 * end.moving / end.k_s)
    M = end.moving + (end.m_h * shape[-1] ** 2 + np.mean(rod.mu * shape**2) * rod.L) / load**2
    t, q = (x[run.time.values > 3.0] for x in (run.time.values, run.s_load.values))

    def decaying(t, A, rate, w, phase, C, D):
        return A * np.exp(-rate * t) * np.cos(w * t + phase) + C + D * t

    fit = curve_fit(decaying, t, q, p0=(0.005, 0.1, omega, 0.0, q[-1], 0.0))[0]
    assert fit[1] == pytest.approx(0.5 * case.rho * 2.0 * 30.0 * 1.5 / (2.0 * M), rel=TRANSFER)


def test_a_load_that_falls_free_in_a_current_sinks_at_the_root_of_its_drag_and_weight():
    tip = Profile.from_si([0.0, 1.5, 3.5, 4.0], [0.0, -5.0, -5.0, 0.0])
    levels = tuple({"h": f"{h} m", "V": "5 m^3", "A33": "60 t", "A_p": "60 m^2"} for h in (0.0, 5.0))
    load = Payload(name="plate", mass="50 t", height="5 m", C_D=2.0, levels=levels)
    hold = (Phase(mode="manual", time="9000 s"),)
    case = landing(tip, hold, start_depth="20 m", duration="30 s", load=load)
    B, U = 0.5 * 1025.0 * 2.0 * 60.0, 2.0
    W = (50e3 - 1025.0 * 5.0) * G
    run = simulate(CRANE, case.model_copy(update={"ramp": 0.0, "current": current(U)}), every="10 ms")
    v = math.sqrt(0.5 * (math.sqrt(U**4 + 4.0 * (W / B) ** 2) - U**2))
    assert float(run.sling_slack_time) > 1.0
    assert float(run.v_load_min) == pytest.approx(-v, rel=2e-3)


def test_every_joule_of_a_lowering_in_a_current_is_found_again():
    case = landing(Sine(amplitude="1 m", period="8 s"), LANDING).model_copy(update={"current": current(1.2)})
    calm, r = (
        run_cases(CRANE, [each], step=2, lanes=1, keep=unchanged)[0]
        for each in (case.model_copy(update={"current": None}), case)
    )
    missing, through = through_the_wire(r)
    assert abs(missing) < ROUNDING * through
    assert r.hang.works.drag < 1.2 * calm.hang.works.drag < 0.0


def test_a_profile_acts_with_its_speed_at_the_middle_of_the_payload():
    profile = current(1.0, 0.2, 1.4, bottom=200.0)
    held = still_winch("50 m", Sine(amplitude="30 cm", period="8 s"), load=box(A_p=30.0, A33=20.0), duration="60 s")
    held = held.model_copy(update={"depth": 200.0})
    U = profile.past(-47.5)
    assert U == pytest.approx(0.62)
    runs = [simulate(deep(), held.model_copy(update={"current": each})) for each in (profile, current(U))]
    assert float(runs[0].F_drag_max) == pytest.approx(float(runs[1].F_drag_max), rel=1e-2)  # it moves by 0.3 m
    down = held.model_copy(
        update={"programme": (Phase(mode="manual", speed="60 m/min", depth="150 m"),), "duration": 150.0}
    )
    run = simulate(deep(), down.model_copy(update={"current": profile}))
    past = np.array([profile.past(z + 2.5) for z in run.z_load.values])
    B, v = 0.5 * down.rho * 2.0 * 30.0, run.v_load.values
    assert np.abs(run.F_drag.values / B + v * np.hypot(v, past)).max() < 1e-3
    assert past.min() < 0.25


def test_without_speed_a_current_changes_no_bit_and_lanes_side_by_side_are_those_alone():
    moved = landing(Sine(amplitude="1 m", period="8 s"), LANDING, duration="120 s")
    still = simulate(CRANE, [moved, moved.model_copy(update={"current": current(0.0, 0.0, bottom=60.0)})])
    assert still.F_w_max.values[0] == still.F_w_max.values[1]
    cases = [moved.model_copy(update={"current": current(u, 0.1, bottom=60.0 + u)}) for u in (0.2, 0.5, 1.0)]
    many = simulate(CRANE, [*cases, moved])
    alone = [float(simulate(CRANE, each).F_w_max) for each in (*cases, moved)]
    assert many.F_w_max.values.tolist() == alone
    assert len(set(alone)) == 4


@pytest.mark.long
def test_a_lowering_in_a_current_is_stored_runs_again_and_is_written_as_a_file(tmp_path):
    case = landing(Sine(amplitude="1 m", period="8 s"), LANDING[:1], duration="60 s")
    case = case.model_copy(update={"current": current(1.0, 0.4, bottom=60.0)})
    run = simulate(CRANE, case)
    save_run(run, tmp_path / "run.nc")
    again = rerun(load_run(tmp_path / "run.nc"))
    assert again.F_drag.values.tolist() == run.F_drag.values.tolist()
    in_sea = InSea(case.model_copy(update={"name": "down", "tip": Still()}), sea(2.0), 1, RAO, X, Y)
    write_lift(Run(CRANE, in_sea, "5 ms"), tmp_path)
    assert load_lift(tmp_path / "lift.toml").lift.current == case.current


@pytest.mark.parametrize(
    ("flow", "text"),
    [
        (
            current(1.0, 0.5, bottom=40.0),
            "current.depth: the profile ends at 40 m, the seabed is at 60 m. Give the speed there.",
        ),
        (current(*np.linspace(1.0, 0.5, 200), bottom=60.0), "current.depth: 200 depths, and a run takes at most 128."),
    ],
)
def test_a_profile_that_a_run_cannot_take_is_refused_in_one_line(flow, text):
    case = landing(Sine(amplitude="1 m", period="8 s"), LANDING).model_copy(update={"current": flow})
    with pytest.raises(LiftError) as refused:
        simulate(CRANE, case)
    assert text in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_load_on_a_wire_alone_moves_near_resonance_as_linear_drag_of_the_current_says():
    """K / (K - m omega^2 + i omega 1/2 rho C_D A U) of the motion of the wire's top end."""
    crane = CRANE.model_copy(update={"wire": CRANE.wire.model_copy(update={"zeta": 0.0})})
    water = {"volume": "10 m^3", "added_mass": "40 t", "C_D": 2.0, "area": "30 m^2", "current": "1.5 m/s"}
    given = {"load": "100 t", "s_w": "1500 m", "mode": "manual", "duration": "300 s", "warm_up": "200 s"}
    hoist = pack(crane, Scenario(**given, water=Water(**water))).params.hoist
    K, m, c = wire_stiffness(1500.0, hoist.wire), hoist.load.m, hoist.load.b * 1.5
    omega = math.sqrt(K / m)
    tip = Sine(amplitude="4 mm", period=f"{2.0 * math.pi / omega} s")
    run = simulate(crane, Scenario(**given, tip=tip, water=Water(**water)), every="20 ms", step="2 ms")
    late = run.time.values > 200.0
    top, t = run.s_tip - (run.s_w - run.s_w[0]), run.time.values[late]
    u, q = (harmonic(t, y.values[late], omega) for y in (top, run.s_load))
    assert abs(q / u * (1j * omega * c) / K - 1.0) < TRANSFER + LINEAR


@pytest.mark.parametrize(("V", "sigma", "U"), [(0.0, 0.5, 0.05), (0.3, 0.2, 1.0), (0.5, 1.0, 0.2)])
def test_the_linear_drag_in_a_current_is_that_of_many_gaussian_speeds(V, sigma, U):
    """The slope with the least square error of v sqrt(v^2 + U^2) over speeds that were drawn."""
    v = V + sigma * np.random.default_rng(1).standard_normal(1_000_000)
    F = v * np.hypot(v, U)
    slope, _ = np.polyfit(v, F, 1)
    assert float(drag_of_gaussian(1.0, sigma, V, U)) == pytest.approx(slope, rel=5e-3)
    assert float(mean_drag(1.0, V, sigma, U)) == pytest.approx(F.mean(), abs=5e-3)
    assert float(drag_of_gaussian(2.0, 1e-3, 0.0, U)) == pytest.approx(2.0 * U, rel=HALVES)


def test_the_frequency_domain_method_has_the_current_at_the_depth_of_the_load():
    case = still_winch("1500 m", Sine(amplitude="2 cm", period="4 s"), load=box(A33=50.0, A_p=30.0))
    wet = suspended_load(deep(), case.model_copy(update={"current": current(1.0, 0.0)}), -1500.0)
    assert wet.U == pytest.approx(1.0 - 1497.5 / 4000.0)
    assert suspended_load(deep(), case, -1500.0).U == 0.0
