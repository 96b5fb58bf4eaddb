"""An emergency stop of the winch: pumps to neutral and the brake closed at once, with power and without."""

import math

import numpy as np
import pytest

from stillhook import load_crane
from stillhook.engine.pack.programme import hanging, wire_strength
from stillhook.engine.simulate import simulate
from stillhook.errors import ScenarioError
from stillhook.spec.lift.lowering import Lowering, Rigging
from stillhook.spec.lift.payload import Level, Payload
from stillhook.spec.lift.phase import Phase

pytestmark = pytest.mark.slow

SPEED, MOVES = 0.3, 30.0
"""Wire speed before the stop [m/s], and for how long [s]."""
SLENDER = Payload(
    name="slender",
    mass="120 t",
    height="4 m",
    C_D=0.1,
    levels=(Level(h="0 m", V="0 L", A33="0 t", A_p="0 m^2"), Level(h="4 m", V="15000 L", A33="300 t", A_p="10 m^2")),
)
"""Hardly any drag, so that the closed form without damping holds."""
STANDS = 0.05
"""Wire that moves behind a closed brake, whose friction gives way like a spring [m]."""
CRANES = ("nov-250t", "nov-100t-pure-active", "nov-100t-electric", "nov-250t-secondary", "nov-100t-cylinder")
LIGHT = SLENDER.model_copy(update={"mass": 40e3})


def stopped(mode: str, crane: str = "nov-250t", payload: Payload = SLENDER, depth: float = 300.0) -> Lowering:
    return Lowering(
        payload=payload,
        rigging=Rigging(height="10 m", stiffness="500 MN/m"),
        h_tip="30 m",
        depth="2000 m",
        start_depth=f"{depth} m",
        duration="65 s",
        programme=(
            Phase(mode="manual", speed=f"{SPEED} m/s", time=f"{MOVES} s"),
            Phase(mode=mode, time="30 s"),
        ),
        controller=load_crane(crane).plant.type.default_mode,
    )


def run(mode: str, crane: str = "nov-250t", payload: Payload = SLENDER):
    return simulate(load_crane(crane), stopped(mode, crane, payload), series=True, every="20 ms")


def jump(crane, lift, M: float, v: float) -> float:
    """sqrt(K M) v of a mass on a spring whose upper end is stopped at v."""
    EA, _ = wire_strength(crane)
    K = 1.0 / (
        (hanging(crane, lift, lift.z_0 - SPEED * MOVES).s_w + crane.wire.L_0) / EA + 1.0 / lift.rigging.stiffness
    )
    return math.sqrt(K * M) * v


ROD = 0.12
"""Part by which a heavy wire and a brake that takes three tenths of a second make the jump another one than that of a
mass on a spring, stopped at once: the wire weighs a twentieth of what it carries."""


def test_the_jump_of_a_stop_is_that_of_a_mass_on_a_spring():
    crane, lift = load_crane("nov-250t"), stopped("emergency-stop")
    data = run("emergency-stop")
    F, t = data.F_w.values, data.time.values
    rest = hanging(crane, lift, lift.z_0 - SPEED * MOVES).F_tip
    M = 420e3 + crane.hook_mass + crane.wire.mass_per_length * 310.0 / 3.0
    expected = jump(crane, lift, M, SPEED)
    assert F[t > MOVES].max() - rest == pytest.approx(expected, rel=ROD)
    assert rest - F[t > MOVES].min() == pytest.approx(expected, rel=ROD)


def test_the_jump_of_the_requirement_is_212_kN():
    # 1 MN/m, 500 t, 0.3 m/s (LIFTPLAN 9): the scaling by which the run above is judged
    data, crane = run("emergency-stop"), load_crane("nov-250t")
    lift = stopped("emergency-stop")
    rest = hanging(crane, lift, lift.z_0 - SPEED * MOVES).F_tip
    seen = float(data.F_w.values[data.time.values > MOVES].max()) - rest
    M = 420e3 + crane.hook_mass + crane.wire.mass_per_length * 310.0 / 3.0
    K = (jump(crane, lift, M, SPEED) / SPEED) ** 2 / M
    assert seen * math.sqrt(1e6 * 500e3 / (K * M)) == pytest.approx(212e3, rel=ROD)


@pytest.mark.parametrize("crane", CRANES)
@pytest.mark.parametrize("mode", ["emergency-stop", "blackout"])
def test_every_winch_stands_within_a_second(crane, mode):
    data = run(mode, crane, LIGHT)
    late = data.sel(time=slice(MOVES + 1.0, None))
    assert "diverged" not in str(data.status.values)
    assert float(np.ptp(late.s_w.values)) < STANDS


def test_a_stop_keeps_the_energy_that_it_is_given():
    data = run("emergency-stop")
    assert abs(float(data.energy_unaccounted)) < 1e-3


def test_a_stop_leaves_what_was_before_it_to_the_bit():
    before = {mode: run(mode).sel(time=slice(0.0, MOVES - 0.1)) for mode in ("emergency-stop", "blackout")}
    for name in ("F_w", "v_w", "s_w"):
        assert np.array_equal(before["emergency-stop"][name].values, before["blackout"][name].values)


def test_a_stop_is_harder_than_releasing_the_joystick():
    hard, soft = run("emergency-stop"), run("manual")
    assert float(hard.F_w_max) > float(soft.F_w_max)


@pytest.mark.parametrize("fields", [{"time": "5 s", "speed": "0.1 m/s"}, {"wire": "100 m"}, {"depth": "100 m"}])
def test_a_stop_that_moves_is_refused(fields):
    with pytest.raises(ScenarioError) as error:
        Phase(mode="emergency-stop", **fields)
    assert "Give time alone" in str(error.value)
    assert "\n" not in str(error.value)


def test_no_kind_of_phase_is_a_stop():
    with pytest.raises(ScenarioError, match="deep has one of ahc, manual"):
        Phase(kind="deep", mode="blackout")
