"""A passive heave compensator between hook and payload, in the running lowering, against what is known of a gas spring.

The motion of the hook is what the unit is moved by: winch and wire give way a little, and do not enter the closed
forms.
"""

import math

import numpy as np
import pytest

from stillhook import cranes, load_crane, read_compensator
from stillhook.base.arrays import FloatArray
from stillhook.engine.lowering.summary import LoweringRun, status
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.errors import StillhookError
from stillhook.kernels.build import Setup, driver
from stillhook.kernels.c99.library import Entry
from stillhook.kernels.c99.source import Translator, entry_types
from stillhook.physics.load_path.compensator import gas_force, gas_slope, gas_work, place_of
from stillhook.physics.scalar import G
from stillhook.sea.motion.motion import Motion, Profile, Sine, Still
from stillhook.spec.lift.lowering import Lowering, Rigging, WinchSettings
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase
from stillhook.spec.scenario import Mode
from stillhook.winches.load_path.gas_spring import Compensator, _coefficients, notes

TRANSFER = 1e-3
"""Asked of the issue at small amplitudes; measured 3e-5, which is the bend of the gas over 5 mm and the fit."""
SHIFT = 1e-3
"""Of a frequency by first-order perturbation at an amplitude of a third of the gas column (the issue asks 1 %): terms
of the fourth order are left out. The shift itself is 1 to 3 %."""
AT_REST = 1e-3
"""A unit that hangs still hangs still [m]: the winch settles by some tenths of a millimetre."""
SERIES = 5e-3
"""Integrals over rows 10 ms apart, of what the steps of 5 ms did."""
AUDIT = 1e-3
"""Asked of the issue: energy found again within 0.1 %."""
ROUNDING = 1e-11
"""The midpoint rule keeps energy exactly: what is left over thousands of steps is rounding."""
STEP = 5e-3
"""How far a time of an end stop may move with half the step [s]: it is that of the step."""

HOLD = (Phase(mode="manual", time="9000 s"),)
UNIT = {
    "stroke": "4 m",
    "area": "0.09 m^2",
    "p_0": "95 bar",
    "V_0": "1.35 m^3",
    "length": "7 m",
    "mass_cylinder": "8 t",
    "mass_rod": "2 t",
}
MASS = 102e3
"""Payload and rod [kg]."""


def unit(**changes: object) -> Compensator:
    return Compensator(**{**UNIT, **changes})


def box(mass: str = "100 t", V: float = 10.0) -> Payload:
    levels = tuple(
        {"h": f"{h} m", "V": f"{v} m^3", "A33": f"{A} t", "A_p": f"{S} m^2"}
        for h, v, A, S in ((0, 0, 0, 0), (5, V, 40, 20))
    )
    return Payload(name="box", mass=mass, height="5 m", C_D=2.0, levels=levels)


def lift(tip: Motion, link: Compensator | None, **changes: object) -> Lowering:
    given = {
        "payload": box(),
        "start_depth": "-8 m",
        "depth": "600 m",
        "programme": HOLD,
        "duration": "300 s",
        "ramp": "60 s",
    } | changes
    return Lowering(tip=tip, h_tip="40 m", rigging=Rigging(zeta=0.0), compensator=link, **given)


def run(case: Lowering, *, lanes: int = 1, every: int = 1, n_sub: int = 2) -> LoweringRun:
    return run_cases(load_crane("nov-250t"), [case], step=n_sub, lanes=lanes, every=every, keep=unchanged)[0]


def column(r: LoweringRun, name: str, last: float = math.inf) -> FloatArray:
    assert r.series is not None
    rows = r.series if math.isinf(last) else r.series[-round(last / r.dt) :]
    return np.asarray(rows[:, r.signals.index(name)])


def amplitudes(y: FloatArray, dt: float, omegas: list[float]) -> list[float]:
    """Amplitudes of sines of these frequencies in a signal, beside a mean and a drift."""
    t = dt * np.arange(len(y))
    waves = [f(w * t) for w in omegas for f in (np.cos, np.sin)]
    x = np.linalg.lstsq(np.stack([np.ones_like(t), t, *waves], axis=1), y, rcond=None)[0]
    return [math.hypot(x[2 + 2 * i], x[3 + 2 * i]) for i in range(len(omegas))]


def natural(link: Compensator, W: float = MASS * G, mass: float = MASS) -> float:
    """sqrt(n p A^2 / (V m)) where the gas carries W, in air [rad/s]."""
    A, p = link.area, W / link.area
    V = link.V_0 * (link.p_0 / p) ** (1.0 / link.n)
    return math.sqrt(link.n * p * A**2 / V / mass)


@pytest.mark.slow
@pytest.mark.parametrize("period", [3.0, 9.0])
@pytest.mark.parametrize("n", [1.0, 1.4])
def test_payload_follows_hook_as_a_mass_on_a_spring_does(period: float, n: float) -> None:
    """|y|/H = 1/|(omega/omega_n)^2 - 1| with k = n p A^2/V, and a stroke of H (1 + |y|/H) above the natural
    frequency."""
    link = unit(n=n)
    omega, omega_n = 2.0 * math.pi / period, natural(link)
    r = run(lift(Sine(amplitude="5 mm", period=f"{period} s"), link, duration="250 s"))
    hook, load, stroke = (
        amplitudes(column(r, name, 150.0), r.dt, [omega, omega_n])[0] for name in ("s_hook", "s_load", "s_c")
    )
    ratio = 1.0 / abs((omega / omega_n) ** 2 - 1.0)
    assert load / hook == pytest.approx(ratio, rel=TRANSFER)
    assert stroke / hook == pytest.approx(1.0 + ratio if omega > omega_n else ratio - 1.0, rel=2.0 * TRANSFER)


def swings(link: Compensator, step: float) -> tuple[float, float]:
    """Frequency [rad/s] and amplitude [m] of the rod after the hook has gone up by a step [m]."""
    v = f"{step / 0.3} m/s"
    points = [("0 s", "0 m/s"), ("0.1 s", v), ("0.3 s", v), ("0.4 s", "0 m/s"), ("2000 s", "0 m/s")]
    r = run(lift(Profile(points=points), link, ramp="0 s", duration="60 s", payload=box("18 t")))
    assert r.total.link is not None
    assert r.total.link.out + r.total.link.inside == 0.0
    y = column(r, "s_c", 50.0) - np.mean(column(r, "s_c", 50.0))
    rises = np.flatnonzero((y[:-1] < 0.0) & (y[1:] >= 0.0))
    times = r.dt * (rises - y[rises] / (y[rises + 1] - y[rises]))
    omega = 2.0 * math.pi * (len(times) - 1) / (times[-1] - times[0])
    return omega, amplitudes(y, r.dt, [omega, 2.0 * omega, 3.0 * omega])[0]


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.6, 0.9])
def test_frequency_falls_with_amplitude_as_perturbation_says(step: float) -> None:
    """omega = omega_n (1 + (n + 1)(1 - 2 n)/48 (a A/V)^2), from the second and third derivative of p V^n = const
    (Lindstedt), against the frequency of small swings: winch and wire give way by half a per cent of the stroke in
    both."""
    link = unit(stroke="3.2 m", V_0="0.081 m^3", area="0.018 m^2", n=1.67, p_0="55.4 bar")
    small, _ = swings(link, 0.02)
    omega, a = swings(link, step)
    V = link.V_0 * (link.p_0 * link.area / (20e3 * G)) ** (1.0 / link.n)
    assert small == pytest.approx(math.sqrt(link.n * link.area * G / V), rel=0.01)
    shift = (link.n + 1.0) * (1.0 - 2.0 * link.n) / 48.0 * (a * link.area / V) ** 2
    assert shift < -4.0 * SHIFT
    assert omega / small == pytest.approx(1.0 + shift, abs=SHIFT)


@pytest.mark.slow
@pytest.mark.parametrize("depth", [20.0, 200.0])
def test_the_sea_presses_the_rod_in(depth: float) -> None:
    """p A = W - rho g A_rod d at rest, d the depth of the cylinder's lower end: the unit hangs there, and stays."""
    link = unit(rod_area="0.01 m^2", p_0="80 bar")
    r = run(lift(Still(), link, start_depth=f"{depth + 15.0} m", duration="20 s"))
    s = column(r, "s_c")
    d = -(column(r, "z_load")[0] + 5.0 + 10.0 + s[0])
    W = (MASS - 1025.0 * 10.0) * G
    assert column(r, "p_c")[0] * link.area == pytest.approx(W - 1025.0 * G * 0.01 * d, rel=1e-5)
    assert np.ptp(s) < AT_REST


@pytest.mark.slow
def test_stroke_shifts_as_it_is_lowered() -> None:
    """Over 100 m of depth the rod goes in by what the gas gives for rho g A_rod 100 m."""
    link = unit(rod_area="0.01 m^2", p_0="80 bar")
    down = (Phase(mode="manual", speed="30 m/min", depth="150 m"), Phase(mode="manual", time="9000 s"))
    slowly = WinchSettings(ramp="0.01 m/s^2")  # so that nothing swings
    r = run(lift(Still(), link, start_depth="50 m", programme=down, duration="400 s", winch=slowly))
    p, d = column(r, "p_c") * link.area, -column(r, "z_load") - column(r, "s_c")
    assert d[-1] - d[0] > 95.0
    assert np.mean(p[-2000:]) - p[0] == pytest.approx(-1025.0 * G * 0.01 * (d[-1] - d[0]), rel=0.02)


@pytest.mark.slow
def test_seals_take_their_force_times_the_way_and_the_orifice_the_cube_of_the_speed() -> None:
    tip = Sine(amplitude="0.5 m", period="8 s")
    for link, power in (
        (unit(friction="20 kN", v_friction="0.1 mm/s"), lambda v: 20e3 * np.abs(v)),
        (unit(orifice="100 kN s^2/m^2"), lambda v: 100e3 * np.abs(v) ** 3),
    ):
        r = run(lift(tip, link, ramp="10 s", duration="120 s"))
        lost = float(np.sum(power(column(r, "v_c"))) * r.dt)
        assert r.hang.works.damping == pytest.approx(lost, rel=SERIES)


@pytest.mark.slow
def test_seals_that_hold_more_than_the_swing_hold_the_rod() -> None:
    """Below their friction the payload is as if it hung on slings alone: the thesis calls that the main problem."""
    r = run(
        lift(Sine(amplitude="20 mm", period="8 s"), unit(friction="20 kN", v_friction="0.1 mm/s"), duration="120 s")
    )
    assert np.ptp(column(r, "s_c")) < AT_REST
    load, hook = (np.ptp(column(r, name, 30.0)) for name in ("s_load", "s_hook"))
    assert load == pytest.approx(hook, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("p_0", "end"), [("76 bar", "extended"), ("114 bar", "retracted")])
def test_an_end_of_the_stroke_is_a_limit_with_its_name_and_time(p_0: str, end: str) -> None:
    case = lift(Sine(amplitude="0.8 m", period="6 s"), unit(p_0=p_0), ramp="10 s", duration="60 s")
    r = run(case)
    link, s = r.total.link, column(r, "s_c")
    assert link is not None
    at_end = s >= 4.0 if end == "extended" else s <= 0.0
    first = r.dt * int(np.argmax(at_end))
    t, other = (link.t_out, link.t_in) if end == "extended" else (link.t_in, link.t_out)
    assert at_end.any()
    assert t == pytest.approx(first, abs=r.dt)
    assert other > 1e6
    assert "compensator stroke" in status(r)
    assert notes(link)[0].startswith(f"compensator fully {end} first after ")
    finer = run(case, n_sub=8).total.link
    assert finer is not None
    assert (finer.t_out if end == "extended" else finer.t_in) == pytest.approx(t, abs=STEP)


def test_an_end_stop_is_the_sling_and_no_force_is_negative() -> None:
    """Beyond the stroke the force rises by the sling's stiffness, and slack slings carry nothing."""
    r = run(lift(Sine(amplitude="2.5 m", period="6 s"), unit(p_0="80 bar"), ramp="10 s", duration="60 s"))
    F, s = column(r, "F_sling"), column(r, "s_c")
    assert F.min() >= 0.0
    assert F[s >= 4.0].max() > 1.5 * unit(p_0="80 bar").force(4.0)
    free = (s > 0.1) & (s < 3.9)
    assert np.allclose(F[free], unit(p_0="80 bar").area * column(r, "p_c")[free], rtol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("link", [unit(friction="20 kN", orifice="50 kN s^2/m^2", rod_area="0.01 m^2"), unit(n=1.0)])
def test_every_joule_of_a_lowering_with_a_compensator_is_found_again(link: Compensator) -> None:
    landing = (
        Phase(mode="splash", speed="15 m/min", depth="12 m"),
        Phase(mode="ahc", speed="30 m/min", depth="56 m"),
        Phase(mode="landing", speed="6 m/min", tension="250 kN", time="15 s"),
    )
    case = lift(Sine(amplitude="1 m", period="8 s"), link, start_depth="-2 m", depth="60 m", programme=landing, ramp="10 s",
                duration="360 s")  # fmt: skip
    r = run(case, every=0)
    W = r.hang.works
    water = W.buoyancy + W.inertia + W.drag + W.slam + W.bottom
    missing = W.top + W.relay + water - W.damping - W.gravity - (r.hang.E - r.hang.E_0)
    assert abs(missing) < ROUNDING * (abs(W.top) + abs(W.gravity) + abs(water))
    assert abs(r.energy_unaccounted) < AUDIT
    assert r.total.lift.t_landed < 1e6


def test_without_losses_the_gas_gives_back_what_it_took() -> None:
    """Damping is what the ends' work leaves of the change of stored energy: with no seal, orifice and stop it is that
    of the wire alone, less than a part in a thousand of what swings, after fifteen swings."""
    r = run(lift(Sine(amplitude="0.2 m", period="8 s"), unit(), ramp="10 s", duration="120 s"))
    swings = 0.5 * MASS * float(np.max(np.abs(column(r, "v_load")))) ** 2
    assert abs(r.hang.works.damping) < 1e-3 * swings


def test_sixteen_lanes_give_the_bits_of_one() -> None:
    case = lift(Sine(amplitude="1.5 m", period="7 s"), unit(friction="20 kN", orifice="50 kN s^2/m^2"), ramp="5 s",
                duration="20 s")  # fmt: skip
    one, many = run(case), run(case, lanes=16)
    assert one.series is not None
    assert many.series is not None
    assert np.array_equal(one.series, many.series)
    assert one.total == many.total


def test_lifts_with_and_without_run_in_one_batch() -> None:
    """Each in its own kernel, the answers in the order of the cases."""
    tip = Sine(amplitude="0.5 m", period="7 s")
    cases = [lift(tip, None, duration="5 s"), lift(tip, unit(), duration="5 s"), lift(tip, None, duration="5 s")]
    results = run_cases(load_crane("nov-250t"), cases, step=2, lanes=1, keep=unchanged)
    assert [r.packed.link is None for r in results] == [True, False, True]
    assert results[0].total == results[2].total


@pytest.mark.parametrize("n", [1.0, 1.4, 1.67])
def test_polynomial_of_the_gas_is_the_gas_law(n: float) -> None:
    """Force, stiffness n p A^2/V and energy along the stroke, and the force as the slope of the energy."""
    link = unit(n=n)
    record = link.pack(50e6, 1025.0, 15.0)
    for s in np.linspace(0.0, 4.0, 9):
        xi = float(place_of(float(s), record))
        assert gas_force(xi, record.gas) == pytest.approx(link.force(float(s)), rel=1e-7)
        assert gas_slope(xi, record.gas) * record.i_half == pytest.approx(link.stiffness(float(s)), rel=1e-5)
        h = 1e-3
        slope = (gas_work(xi + h, record.gas) - gas_work(xi - h, record.gas)) / (2.0 * h)
        assert slope == pytest.approx(gas_force(xi, record.gas), rel=1e-6)


@pytest.mark.parametrize("F", [0.5e6, 0.9e6, 1.0e6, 1.2e6, 3.0e6])
def test_hanging_stroke_carries_the_load(F: float) -> None:
    link = unit()
    s = link.extension(F, 10.0, 1025.0 * G)
    assert link.force(s) == pytest.approx(min(max(F, link.force(0.0)), link.force(4.0)), rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"V_0": "0.3 m^3"}, "the piston sweeps 360 L (area times stroke), and no gas would be left."),
        ({"n": 2.0}, "less than or equal to 1.67"),
        ({"p_0": "90 m"}, 'unit "m" is not one of'),
        ({"p0": "90 bar"}, "unknown field"),
        ({"stroke": "0 m"}, "greater than 0"),
    ],
)
def test_a_wrong_number_is_one_line(changes: dict[str, object], line: str) -> None:
    with pytest.raises(StillhookError) as problem:
        unit(**changes)
    assert line in str(problem.value)
    assert "\n" not in str(problem.value)


def test_a_unit_that_sweeps_nearly_all_of_its_gas_is_refused() -> None:
    with pytest.raises(StillhookError, match=r"the piston sweeps 97\.3 % of it"):
        unit(V_0="0.37 m^3").pack(50e6, 1025.0, 15.0)


@pytest.mark.parametrize(("name", "load"), [("phc-150t", 106e3), ("phc-60t", 53e3), ("phc-25t-shallow", 22e3)])
def test_units_of_the_library_hold_what_they_say_and_every_number_has_a_source(name: str, load: float) -> None:
    link = read_compensator(name)
    assert 0.25 < link.extension(load * G, 0.0, 0.0) / link.stroke < 0.5
    assert set(link.sources) == set(Compensator.model_fields) - {"type", "name", "title", "source", "sources"}


@pytest.mark.thorough
@pytest.mark.parametrize("name", cranes())
def test_it_works_below_every_winch_of_the_library(name: str) -> None:
    """Small swings below a winch that stands, whatever it is made of: only the hook's motion counts."""
    link = unit(area="0.009 m^2", V_0="0.135 m^3", mass_cylinder="0.5 t", mass_rod="0.2 t")
    crane, mass = load_crane(name), 10.2e3
    takes = next(mode for mode in ("ssc", "position") if not crane.plant.type.mode_refusal(Mode(mode)))
    omega_n, omega = natural(link, mass * G, mass), 2.0 * math.pi / 4.0
    tip = Sine(amplitude="5 mm", period="4 s")
    case = lift(tip, link, duration="120 s", ramp="30 s", payload=box("10 t", 1.0), controller=takes)
    r = run_cases(crane, [case], step=4, lanes=1, every=1, keep=unchanged)[0]
    hook, load = (amplitudes(column(r, each, 80.0), r.dt, [omega, omega_n])[0] for each in ("s_hook", "s_load"))
    assert load / hook == pytest.approx(1.0 / abs((omega / omega_n) ** 2 - 1.0), rel=10.0 * TRANSFER)


@pytest.mark.long
@pytest.mark.parametrize("joint", ["slings", "gas-spring"])
def test_kernels_of_lowerings_are_translated_to_c(joint: str) -> None:
    """Else they would run by Numba alone, and not where only a C compiler is installed."""
    run_of = driver("pure-active", 1, Setup(("wire", joint, "payload"))).run
    if not isinstance(run_of, Entry):
        pytest.skip("kernels are compiled by Numba here")
    for kernel in run_of.library.entries.values():
        t = Translator()
        t.function(kernel, entry_types(kernel), export="kernel")
        assert "kernel" in t.source()


def test_a_force_that_is_accepted_follows_the_gas_law_to_a_hundred_thousandth_over_all_of_the_stroke():
    """However much of the gas the piston sweeps; a step of 0.2 % of it changes the error by some 5 %."""
    accepted, refused = [], []
    for swept in np.arange(0.6, 0.95, 0.002).round(3).tolist():
        try:
            c = _coefficients(swept, 1.4, 1.0)
        except StillhookError:
            refused.append(swept)
            continue
        accepted.append(swept)
        x = np.linspace(-1.0, 1.0, 2001)
        gas = (1.0 - 0.5 * swept * (1.0 + x)) ** -1.4
        assert np.abs(np.polyval(c[::-1], x) / gas - 1.0).max() <= 1.02e-5, (
            swept
        )  # between the places that are looked at
    assert max(accepted) < min(refused)
    assert min(refused) > 0.77
