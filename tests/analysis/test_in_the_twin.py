"""Margins in the twin: at a steady speed those of the linearised loop, with gain and with delay; in waves the delay that
the feedforward can have is what its lateness costs."""

from __future__ import annotations

import math

import pytest

from stillhook import Crane, Profile, Scenario, Sine, StillhookError, load_crane
from stillhook.analysis.loop_stability.governing import place_limits
from stillhook.analysis.loop_stability.in_the_twin import GROWS, twin_margins
from stillhook.analysis.loop_stability.places import Place
from stillhook.analysis.loop_stability.stability import full_stability
from stillhook.engine.pack.settings import with_value
from stillhook.library import changed
from stillhook.spec.scenario import Mode, Operator

WITHIN = 0.12
"""How far the factor may be from that of the linear limit [-]: a rung of 5 %, a limit that moves with the wire paid out,
and a disturbance that falls by less than a tenth in 20 s counts as one that stays."""
WITHIN_DELAY = 0.05
"""The same of a delay [-]."""
KICK = 0.05
"""Speed that the step gives the wire over the tip's, about [-]: a motion that the linear model is good for."""
CASES = [
    ("nov-250t", "ssc", 1.0, 300.0, 20.0),
    ("nov-100t-electric", "position", 1.0, 15.0, 2.0),
    ("utility-20t-open-circuit", "position", 1.0, 100.0, 2.0),
    pytest.param("nov-250t", "hs", 0.6, 100.0, 20.0, marks=pytest.mark.slow),
]


def steady(crane: Crane, mode: str, load: float, s_w: float, v: float) -> tuple[Scenario, Place]:
    """A tip of constant speed [m/s], and the place that the winch is at on the mean."""
    time = min(90.0, max(30.0, 5.0 + 25.0 / abs(v)))
    tip = Profile([("0 s", "0 m/s"), ("5 s", f"{v} m/s"), (f"{time} s", f"{v} m/s"), (f"{time + 5.0} s", "0 m/s")])
    case = Scenario(
        load=f"{load!r} kg",
        s_w=f"{s_w!r} m",
        tip=tip,
        mode=mode,
        duration=f"{time} s",
        warm_up="10 s",
        ramp="0 s",
        gas_held=crane.passive is not None,
    )
    return case, Place(load, s_w + 0.5 * v * time, v)


@pytest.mark.long
@pytest.mark.parametrize(("name", "mode", "share", "s_w", "v"), CASES)
def test_at_a_steady_speed_a_disturbance_stays_from_the_linear_limit_on(
    name: str, mode: str, share: float, s_w: float, v: float
) -> None:
    crane = load_crane(name)
    case, place = steady(crane, mode, share * crane.SWL, s_w, v / 60.0)
    (at,) = place_limits(crane, Mode(mode), [place])
    limit, step = at.gains.high, KICK * place.v_tip / at.gains.omega_c
    third, beyond = (with_value(crane, "control.K_p", part * limit) for part in (1.0 / 3.0, 1.3))
    assert twin_margins(third, case, step=step, delays=False).factor.swings == pytest.approx(3.0, rel=WITHIN)
    assert twin_margins(beyond, case, step=step, delays=False).factor.swings == 1.0


def test_at_a_steady_speed_a_disturbance_stays_from_the_delay_margin_on() -> None:
    """Near the gain limit, where the margin is short; the error grows before, as the feedforward is late as well."""
    crane = changed(load_crane("nov-100t-pure-active"), {"control": {"t_cycle": "20 ms"}})
    case, place = steady(crane, "ssc", 0.6 * crane.SWL, 15.0, 5.0 / 60.0)
    (at,) = place_limits(crane, Mode.SSC, [place])
    crane = with_value(crane, "control.K_p", 0.8 * at.gains.high)
    printed, _ = full_stability(crane, load=place.load, s_w=place.s_w, v_tip=place.v_tip)
    found = twin_margins(crane, case, step=KICK * place.v_tip / at.gains.omega_c)
    assert found.delay.swings == pytest.approx(printed.delay_margin_plc, rel=WITHIN_DELAY)
    assert found.delay.error < found.delay.swings
    assert found.factor.swings == pytest.approx(1.25, rel=WITHIN)


@pytest.mark.long
def test_in_waves_the_error_grows_by_half_no_sooner_than_a_late_feedforward_moves_the_wire() -> None:
    """Late by t, a winch of the tip's speed v is at most 2 v t further off, peak to peak, and the loop itself is far
    from its delay margin of seconds."""
    v, period = 1.0, 9.0
    waves = Sine.from_si(v * period / (2.0 * math.pi), period)
    crane = changed(load_crane("nov-250t"), {"control": {"t_lead": "50 ms"}})
    case = Scenario(load="100 t", s_w="487 m", mode="ssc", tip=waves, duration="200 s", warm_up="80 s")
    found = twin_margins(crane, case)
    least = (GROWS - 1.0) * found.e_c_pp / (2.0 * v)
    assert least < found.delay.error < 3.0 * least
    assert math.isinf(found.delay.swings)
    assert 3.0 < min(found.factor) < 12.0


def test_a_drive_whose_commands_have_no_dead_time_has_a_factor_alone() -> None:
    crane = load_crane("nov-100t-electric")
    waves = {"tip": "sine 0.5 m 9 s", "duration": "80 s", "warm_up": "30 s"}
    found = twin_margins(crane, Scenario(load="20 t", s_w="100 m", mode="position", **waves))
    assert all(math.isnan(x) for x in found.delay)
    assert min(found.factor) > 1.5


def test_a_case_with_a_step_of_its_own_is_refused() -> None:
    stepped = Operator(steps=(("50 s", "0.1 m"),))
    with pytest.raises(StillhookError, match="without steps of its reference"):
        twin_margins(load_crane("nov-250t"), Scenario(load="1 t", s_w="50 m", mode="ssc", operator=stepped))
