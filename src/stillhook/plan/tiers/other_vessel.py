"""A lift from the deck of another vessel, which moves on its own, or onto one or onto a fixed platform: what that adds
to the lift-off and the set-down.

Source: EN 13852-1 as publicly quoted (B.4); the standard itself was not seen. EN 13852-1:2004 excludes subsea lifts:
the formulas are of the lift-off in air. Where the plan has the other vessel's transfer functions, the speed of the hook
against the deck follows from both vessels in the same waves as well, and the larger of the two counts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.physics.scalar import G
from stillhook.plan.definition.capacities import in_boom, jerk, off_other_vessel, places, springs
from stillhook.plan.definition.lift_plan import Environment, LiftPlan, remembered
from stillhook.plan.definition.load_chart import SWING_DAMPING
from stillhook.plan.definition.rules import Seas
from stillhook.plan.tiers.frequency import forcing_at
from stillhook.plan.tiers.sideways import in_air
from stillhook.response.forcing import OMEGA, STEP, Forcing, forcing_of_seas
from stillhook.sea.vessel.relative import sideways
from stillhook.spec.lift.phase import APART, OFF_DECK, Phase
from stillhook.spec.lift.simplified import taken_up
from stillhook.statistics.extremes import most_probable_maximum, zero_crossing_period


def deck_speed(Hs: ArrayLike) -> FloatArray:
    r"""Vertical speed of another vessel's deck [m/s], :math:`V_D = 6 H_s/(H_s + 8)`. Hs [m]."""
    H = np.asarray(Hs, dtype=np.float64)
    return np.asarray(6.0 * H / (H + 8.0))


def relative_speed(Hs: ArrayLike, V_C: ArrayLike) -> FloatArray:
    r"""Speed of the hook against the deck [m/s], :math:`\sqrt{V_D^2 + V_C^2}`, of which a hoisting speed must be K_H at
    the least. Hs [m]; V_C speed of the crane tip [m/s]."""
    return np.asarray(np.hypot(deck_speed(Hs), np.asarray(V_C)))


def lead(Hs: ArrayLike, L: float, share: float = 1.0) -> FloatArray:
    r"""Angle of the wire [rad], :math:`\arctan((2.5 + 1.5 H_s)/L)` in the plane of the boom: the deck is off by so many
    metres; of share 0.5 across it. Hs [m]; L from the tip to the payload [m]."""
    return np.asarray(np.arctan(share * (2.5 + 1.5 * np.asarray(Hs, dtype=np.float64)) / L))


def come_back(eta: ArrayLike, omega: ArrayLike, V: ArrayLike) -> FloatArray:
    r"""How far a deck comes back against a hook that hoists at V, both apart by eta sin(omega t), from the worst
    instant of lifting off [m]: the second hit, 0 from V = eta omega on.

    .. math:: 2\eta\left(\sqrt{1 - r^2} - r\arccos r\right), \quad r = \frac{V}{\eta\omega}
    """
    eta, omega, V = (np.asarray(x, dtype=np.float64) for x in (eta, omega, V))
    v = eta * omega
    r = np.divide(np.minimum(V, v), v, out=np.ones(np.broadcast(v, V).shape), where=v > 0.0)
    return np.asarray(2.0 * eta * (np.sqrt(1.0 - r**2) - r * np.arccos(r)))


@remembered
def against_deck(plan: LiftPlan, seas: Seas, x: float, y: float, left: float = 1.0) -> Forcing:
    """What seas (n,) do to the height of a crane tip over (x, y) [m] against the other vessel's deck; left of the
    tip's motion, 0 for the deck alone."""
    assert plan.against is not None
    each = [plan.environment.sea(*(float(v) for v in row)) for row in zip(seas.Hs, seas.Tp, seas.beta, strict=True)]
    return forcing_of_seas(each, replace(plan.against, left=left), x, y)


def _sigmas(forcing: Forcing) -> FloatArray:
    """Deviations of height [m], speed and acceleration, (3, n)."""
    return np.array([forcing.deviation(order) for order in range(3)])


def hook_on_deck(plan: LiftPlan, phase: Phase, seas: Seas, left: float = 1.0) -> FloatArray:
    """Deviations of the hook's height over the deck [m], of its speed and acceleration, (3, n), with what the winch
    leaves, from 1 (all): of the relative motion where it follows the deck, else of the tip's. What it leaves has an
    unknown phase, and is added to the deck's own motion as if both peaked together, as what a heave filter loses is."""
    at, plan = plan.tip_of(phase), plan.of_high
    forcing = forcing_at(plan, seas, at.x, at.y)
    tip, lost = _sigmas(forcing), 0.0 if forcing.lost is None else (1.0 - left) * _sigmas(forcing.lost)
    if not (phase.on_other_vessel or off_other_vessel(plan, phase)):
        return np.asarray(left * tip + lost)
    both = _sigmas(against_deck(plan, seas, at.x, at.y))
    if left == 1.0 or phase.follows_deck:
        return np.asarray(left * both + lost)
    deck = _sigmas(against_deck(plan, seas, at.x, at.y, 0.0))
    return np.minimum(left * tip + deck, both + (1.0 - left) * tip) + lost


def hook_in_air(plan: LiftPlan, phase: Phase, seas: Seas, left: float) -> FloatArray:
    """As `hook_on_deck`, against the earth, of a winch that follows the deck: a payload that hangs moves with it."""
    at = plan.tip_of(phase)
    deck = _sigmas(against_deck(plan.of_high, seas, at.x, at.y, 0.0))
    return np.asarray(deck + hook_on_deck(plan, phase, seas, left))


def largest(sigmas: FloatArray, duration: float) -> tuple[FloatArray, FloatArray]:
    """Most probable largest height [m] and speed [m/s] over a duration [s], of deviations (3, n)."""
    z, v, a = sigmas
    T_z, T_v = zero_crossing_period(z, v), zero_crossing_period(v, a)
    return most_probable_maximum(z, T_z, duration), most_probable_maximum(v, T_v, duration)


def speed_against_deck(plan: LiftPlan, phase: Phase, seas: Seas, duration: float, left: float = 1.0) -> FloatArray:
    """Most probable largest vertical speed of the hook against the deck (n,) [m/s] over a duration [s], by the
    transfer functions of both vessels."""
    return largest(hook_on_deck(plan, phase, seas, left), duration)[1]


Transfer = Callable[[FloatArray, FloatArray], Mapping[str, ComplexArray]]
"""Motions by name per metre of wave (j, k) at frequencies (k,) [rad/s] and headings (j,) [rad]."""


def deviations(environment: Environment, seas: Seas, transfer: Transfer) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Standard deviation of each motion, and of its rate, in seas (n,)."""
    power: dict[tuple[float, float | None], dict[str, FloatArray]] = {}
    moments: dict[str, FloatArray] = {}
    for n, row in enumerate(zip(seas.Hs, seas.Tp, seas.beta, strict=True)):
        for train in environment.sea(*(float(v) for v in row)).trains:
            key = (train.beta, train.spread)
            if key not in power:
                theta, share = train.directions()
                power[key] = {name: share @ np.abs(H) ** 2 for name, H in transfer(OMEGA, theta).items()}
            S = train.spectrum.density(OMEGA) * STEP
            for name, H2 in power[key].items():
                of = moments.setdefault(name, np.zeros((2, len(seas))))
                of[:, n] += np.sum(H2 * S), np.sum(H2 * S * OMEGA**2)
    return {name: (np.sqrt(m[0]), np.sqrt(m[1])) for name, m in moments.items()}


@remembered
def _sideways(plan: LiftPlan, phase: Phase, seas: Seas, duration: float) -> dict[str, FloatArray]:
    """Most probable largest motions (n,) over a duration [s]: of the hook against its place on deck, forward and to
    port of the crane vessel, along and across the boom where the load chart has it (off, side) [m], and roll and pitch
    of the deck [rad]. A payload that is set down hangs as a pendulum."""
    tip, chart, height = plan.tip_of(phase), plan.load_chart, plan.payload.height
    assert tip.z is not None
    off, z = phase.kind in OFF_DECK, phase.z_start if phase.kind in OFF_DECK else phase.z_end
    assert z is not None
    L, zeta = tip.z - z - 0.5 * height, SWING_DAMPING if chart is None else chart.swing_damping
    psi = None if chart is None else chart.direction_of(tip)

    def transfer(omega: FloatArray, beta: FloatArray) -> dict[str, ComplexArray]:
        gain = 1.0 if off else 1.0 + L * in_air(L, zeta, omega).tip
        X, Y = (gain * x for x in sideways(plan.vessel.at(omega, beta), tip.x, tip.y, tip.z or 0.0))
        roll = pitch = 0.0 * X
        if phase.on_other_vessel:
            assert plan.against is not None
            dX, dY, roll, pitch = plan.against.deck(omega, beta, tip.x, tip.y, z)
            X, Y = X - dX, Y - dY
        result = {"forward": X, "port": Y, "roll": roll, "pitch": pitch}
        if psi is not None:
            result |= in_boom(X, Y, psi)
        return result

    each = deviations(plan.environment, seas, transfer)
    return {
        name: most_probable_maximum(sigma, zero_crossing_period(sigma, rate), duration)
        for name, (sigma, rate) in each.items()
    }


def with_deck(
    plan: LiftPlan, phase: Phase, seas: Seas, duration: float, values: Mapping[str, FloatArray], left: float = 1.0
) -> dict[str, FloatArray]:
    """Quantities of a lift-off or set-down as if on the own deck as those of one on a deck that moves otherwise, in
    seas (n,) over a duration [s], with what the winch leaves, from 1 (all): the load is taken up at the hoisting speed
    and that of the hook against the deck; the deck is off by the table's distance. A payload that was set down is taken
    up again as the deck falls away faster than the wire is paid out.

    The speed of the hook against what carries the payload is then `v_carrier`, of the table or, where it is larger, by
    the transfer functions of both vessels, and `v_lift_off` is not determined: its
    rule is of a hook that only moves with its own vessel.
    """
    tip, V, off = plan.tip_of(phase), phase.speed or 0.0, phase.kind in OFF_DECK
    assert tip.z is not None
    Hs = plan.environment.H_m0(seas.Hs)
    result = {name: each for name, each in values.items() if name != "v_lift_off"}
    moves, v = phase.on_other_vessel or off_other_vessel(plan, phase), np.zeros(len(seas))
    if moves:
        follows = phase.follows_deck
        table = relative_speed(Hs, values["v_tip_max"] * (1.0 if follows else left))
        v = left * table if follows else table
    if plan.against is not None or not moves:
        v = np.maximum(v, speed_against_deck(plan, phase, seas, duration, left))
    if off:
        result["v_carrier"], F = v, jerk(plan, phase, 1.0) * v
    else:
        again = max(float(taken_up(0.0, 1.0, K, m)) for K, m in springs(plan, phase))
        result["v_landed"], F = V + v, again * np.maximum(v - V, 0.0)
    result["F_top_max"] = values["F_top_max"] + F
    result["DAF"] = values["DAF"] + F / (plan.of_high.payload.mass * G)
    L = min(tip.z - z for z in places(phase)) - plan.payload.height
    if phase.kind in APART:
        result |= _of_deck(plan, phase, seas, duration, left)
    for name, share in (("off_lead", 1.0), ("side_lead", 0.5)):
        if name in values and off:
            result[name] = np.maximum(values[name], lead(Hs, L, share))
            if phase.kind in APART:
                aside = _sideways(plan.of_high, phase, seas, duration).get(name, np.zeros(len(seas)))
                result[name] = np.maximum(result[name], np.arctan(aside / L))
    if phase.follows_deck:
        z, v = largest(hook_on_deck(plan, phase, seas), duration)
        result |= {"e_c_pp": 2.0 * left * z, "v_w_demand": V + v}
    return result


def _of_deck(plan: LiftPlan, phase: Phase, seas: Seas, duration: float, left: float) -> dict[str, FloatArray]:
    """Motion of the hook against a deck, and what the payload gains on it in one period."""
    sigmas, aside = hook_on_deck(plan, phase, seas, left), _sideways(plan.of_high, phase, seas, duration)
    z = largest(sigmas, duration)[0]
    tilt = plan.gear.tilt + np.hypot(aside["roll"], aside["pitch"])
    values = {"z_rel": z, "x_rel": np.hypot(aside["forward"], aside["port"]), "deck_tilt": tilt}
    if phase.kind in OFF_DECK:
        up = risen(phase, zero_crossing_period(sigmas[0], sigmas[1]))
        values["rise_ratio"] = np.where(z > 0.0, 2.0 * z / up, 0.0)
    return values


def risen(phase: Phase, T: FloatArray) -> FloatArray:
    """Rise of a payload in a period T after it is lifted off [m], no more than the phase's way; that for NaN."""
    assert phase.z_start is not None
    assert phase.z_end is not None
    return np.fmin((phase.speed or 0.0) * T, abs(phase.z_end - phase.z_start))
