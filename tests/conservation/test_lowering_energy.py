"""Joules through winch, wire, load and water in a lowering, and the snap that stored energy makes of a fall."""

import math

import pytest

from stillhook import load_crane
from stillhook.engine.lowering.summary import LoweringRun
from stillhook.engine.simulate import run_cases, simulate, unchanged
from stillhook.physics.scalar import G
from stillhook.sea.motion.motion import Motion, Profile, Sine, Still
from stillhook.spec.lift.lowering import Lowering, Rigging
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase

AUDIT = 1e-3
"""Asked of the issue: energy found again within 0.1 %; measured 2e-5."""
ROUNDING = 1e-11
"""The midpoint rule keeps energy exactly: what is left over thousands of steps is rounding."""
SNAP = 0.05
"""Drag while the wire stretches and the winch giving way, both left out of the closed form."""

HOLDING = (Phase(mode="manual", time="9000 s"),)


def box(mass: str = "100 t", V: float = 10.0, A33: float = 40.0, A_p: float = 20.0) -> Payload:
    levels = tuple(
        {"h": f"{h} m", "V": f"{V * h / 5!r} m^3", "A33": f"{A33 * h / 5!r} t", "A_p": f"{A_p!r} m^2"}
        for h in (0.0, 5.0)
    )
    return Payload(name="box", mass=mass, height="5 m", C_D=2.0, levels=levels)


def lift(
    tip: Motion,
    programme: tuple[Phase, ...],
    *,
    start_depth: str = "-2 m",
    depth: str = "60 m",
    duration: str = "330 s",
    load: Payload | None = None,
) -> Lowering:
    return Lowering(
        payload=load or box(),
        tip=tip,
        h_tip="20 m",
        depth=depth,
        start_depth=start_depth,
        programme=programme,
        duration=duration,
        rigging=Rigging(zeta=0.0),
    )


LANDING = (
    Phase(mode="splash", speed="15 m/min", depth="12 m"),
    Phase(mode="ahc", speed="30 m/min", depth="56 m"),
    Phase(mode="landing", speed="6 m/min", tension="200 kN", time="15 s"),
)
DEEP = (Phase(mode="ahc", speed="40 m/min", wire="1000 m"),)


def through_the_wire(r: LoweringRun) -> tuple[float, float]:
    """What is missing of the energy through wire, load and water, and how much went through [J]."""
    W = r.hang.works
    water = W.buoyancy + W.inertia + W.drag + W.slam + W.bottom
    missing = W.top + W.relay + water - W.damping - W.gravity - (r.hang.E - r.hang.E_0)
    return missing, abs(W.top) + abs(W.gravity) + abs(water)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["nov-250t", pytest.param("nov-100t-pure-active", marks=pytest.mark.thorough)])
@pytest.mark.parametrize(
    "case",
    [
        lift(Sine(amplitude="1 m", period="8 s"), LANDING),
        lift(Sine(amplitude="1 m", period="8 s"), DEEP, start_depth="100 m", depth="2000 m", load=box("80 t")),
    ],
)
def test_every_joule_of_a_lowering_is_found_again(name: str, case: Lowering) -> None:
    crane = load_crane(name)
    r = run_cases(crane, [case], step=2, lanes=1, keep=unchanged)[0]
    missing, through = through_the_wire(r)
    assert abs(missing) < ROUNDING * through
    assert abs(r.energy_unaccounted) < AUDIT


@pytest.mark.slow
def test_wire_brings_along_from_the_drum_what_its_strain_holds() -> None:
    """Relaying the elements as wire is paid out adds the kinetic energy of the new wire, and takes the strain it did not have: both small."""
    r = run_cases(
        load_crane("nov-250t"),
        [lift(Still(), DEEP, start_depth="100 m", depth="2000 m", duration="1200 s")],
        step=2,
        lanes=1,
        every=0,
        keep=unchanged,
    )[0]
    tension = (100e3 - 1025.0 * 10.0 + 3e3 + 0.5 * 32.0 * 1000.0) * G
    strain = 0.5 * tension**2 / 836e6 * 900.0
    assert -2.0 * strain < r.hang.works.relay < 0.0
    assert abs(r.hang.works.relay) < 1e-3 * abs(r.hang.works.gravity)


@pytest.mark.slow
def test_buoyancy_carries_what_the_displaced_water_weighs() -> None:
    """rho g V times the way of the covered box, half of that over its height."""
    run = simulate(
        load_crane("nov-250t"), lift(Still(), (Phase(mode="manual", speed="15 m/min", depth="30 m"),), duration="200 s")
    )
    way = -float(run.z_load_end) - 5.0 + 2.5
    assert float(run.work_buoyancy) == pytest.approx(-1025.0 * G * 10.0 * way, rel=1e-4)


def test_still_water_takes_energy_and_gives_none() -> None:
    run = simulate(
        load_crane("nov-250t"),
        lift(Sine(amplitude="1.5 m", period="7 s"), HOLDING, start_depth="0 m", duration="120 s"),
    )
    assert float(run.work_drag) < 0.0
    assert float(run.work_slam) < 0.0
    assert float(run.work_inertia) + float(run.work_slam) < 0.0  # the added mass gives back, the spray does not


def test_snap_is_that_of_a_fall_at_terminal_speed() -> None:
    """The tip drops from under the load, stops, and waits: T = W + sqrt(W^2 + K M v^2), v the speed of free fall in water."""
    mass, V, A33, A_p = 50e3, 5.0, 60e3, 60.0
    tip = Profile.from_si([0.0, 1.5, 3.5, 4.0], [0.0, -5.0, -5.0, 0.0])
    load = Payload(
        name="plate",
        mass="50 t",
        height="5 m",
        C_D=2.0,
        levels=tuple({"h": f"{h} m", "V": "5 m^3", "A33": "60 t", "A_p": "60 m^2"} for h in (0.0, 5.0)),
    )
    crane = load_crane("nov-250t")
    crane = crane.model_copy(
        update={"inertia": crane.inertia.model_copy(update={"J_gear": 1.0e6})}
    )  # a winch that does not move
    case = lift(tip, HOLDING, start_depth="20 m", duration="30 s", load=load).model_copy(update={"ramp": 0.0})
    run = simulate(crane, case, every="10 ms", step="1 ms")
    W = (mass - 1025.0 * V) * G
    assert float(run.sling_slack_time) > 1.0
    v = math.sqrt(2.0 * W / (1025.0 * 2.0 * A_p))
    assert float(run.v_load_min) == pytest.approx(-v, rel=0.02)
    K = 1.0 / (1.0 / 50e6 + (float(run.s_w[0]) + crane.wire.L_0) / 836e6)
    assert float(run.snap) == pytest.approx(W + math.sqrt(W**2 + K * (mass + A33) * v**2), rel=SNAP)
