"""What stops a winch at one load on one layer, in one direction: the speed that each limit alone would allow.

The pumps' flow, the pressure of the relief valves, the power of the hydraulic power units, the torque that must stay in
reserve, and the speed limits of active and passive motors, all for the complete plant
(`stillhook.analysis.steady.operating_point`) while it compensates: the tip moves, the load is at rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from enum import StrEnum
from functools import cache, cached_property
from typing import NamedTuple

import scipy

from stillhook.analysis.steady.operating_point import NoSteadyOperation, OperatingPoint, operate, winch_at
from stillhook.analysis.steady.steady_state import settled
from stillhook.control.commands import displacement_min
from stillhook.control.registry import MANUAL_MODE
from stillhook.engine.pack.winch import gains, motor_law, pack, plc_record, power_most, wire_speed_max
from stillhook.engine.scenario.checks import check
from stillhook.errors import SpecError
from stillhook.physics.load_path.drum import K_wire
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Scenario
from stillhook.winches.interface import Carried

RESERVE = 0.30
"""Part of the static load for which the active motors must have torque to spare: friction and acceleration. Source:
paper C."""
BREAK_AWAY = 1e-6
"""Wire speed at which the winch breaks away [m/s]: friction is at its highest."""
V_BEYOND = 1.5
"""How far limits are looked for, over the speed of full pumps and the smallest displacement without leakage."""
BEYOND = 10.0
"""Values used for pumps and pressure where no steady operation exists, over their limits."""
LEAST_POWER = 1.0
"""Power that units which take nothing back are judged by [W]."""
V_EXACT, ALPHA_EXACT = 1e-9, 1e-6
"""What speeds [m/s] and the best displacement [-] are solved to."""
POWER_GRID = 9
"""Displacements at which the best one under the power limit is looked for first [-]."""


class Limit(StrEnum):
    """Governing limit."""

    PUMP = "pump flow"
    PRESSURE = "relief pressure"
    RESERVE = "torque reserve"
    POWER = "hydraulic power"
    MOTOR = "active motors' speed"
    PASSIVE = "passive motors' speed"
    LOAD = "load of the mode"


class Direction(StrEnum):
    """Direction of the wire."""

    HOISTING = "hoisting"
    LOWERING = "lowering"

    @property
    def sign(self) -> float:
        """1 hoisting, -1 lowering."""
        return 1.0 if self is Direction.HOISTING else -1.0


class Top(NamedTuple):
    """Highest wire speed v_w, without sign [m/s]; NaN where the mode may not be used at this load. binds: the limit
    that stops it. limits: speed that each limit alone would allow [m/s], inf where it allows every speed, NaN where it
    allows none. point: operation at v_w, None without one."""

    v_w: float
    binds: Limit
    limits: Mapping[Limit, float]
    point: OperatingPoint | None


Displacement = Callable[[float], float]
"""Motors' displacement [-] at a wire speed without sign [m/s]."""


class Station:
    """A crane with one load [kg] and s_w of wire paid out [m], moving the wire in one direction.

    reserve: part of the static load kept as torque of the active motors on top of the weight that the passive ones do
    not carry.
    """

    def __init__(self, crane: Crane, load: float, s_w: float, direction: Direction, reserve: float = RESERVE) -> None:
        case = Scenario(load=f"{float(load)!r} kg", s_w=f"{float(s_w)!r} m", mode=MANUAL_MODE)
        check(crane, case)
        self.crane, self.sign, self.reserve = crane, direction.sign, reserve
        self.winch = winch_at(crane, case)
        self.F_w = float(self.winch.params.hoist.load.W)
        self.ratio = float(K_wire(self.winch.geometry.d, self.winch.params.hoist.drum))
        self.v_beyond = V_BEYOND * wire_speed_max(crane, crane.active.motor.alpha_min, self.winch.geometry.d)

    def displacement(self, mode: Mode) -> Displacement:
        """Displacement of the motors at a steady speed in a mode, by the PLC's law."""
        law, K_1 = motor_law(self.crane, mode, self.F_w, self.ratio), gains(self.crane).K_1
        return lambda v: settled(law, K_1 * v * self.ratio)

    @cached_property
    def carried(self) -> Carried:
        """What other motors than the active ones hold."""
        w = self.winch
        held_by_others: Carried = self.crane.plant.type.carried(w.params, w.geometry, self.F_w)
        return held_by_others

    @property
    def alpha_pm(self) -> float:
        """Displacement with which the passive motors hold the load at mid stroke [-]; 0 without them."""
        return self.carried.alpha

    @cached_property
    def T_hold(self) -> float:
        """Torque at the motor shaft that the active motors hold of the load at rest [N m]: what the passive ones do not
        carry."""
        return float(max(self.F_w * self.winch.geometry.r_eff - self.carried.T, 0.0))

    @cached_property
    def alpha_reserve(self) -> float:
        r"""Smallest displacement with which the active motors have the reserve [-]; above 1 they cannot.

        .. math:: \alpha\,D_{m,max} (p_{relief} - p_{boost}) \ge T_{hold} + r\,F_w\,\frac{d}{2 i_{hD}}

        Source: Moslatt 2020 paper C: 30 % of the static load, for friction and acceleration. The pressure that goes
        with it is not printed; here it is the relief pressure less the boost. Passive motors carry the
        weight; without them the active do.
        """
        a = self.crane.active
        T = self.T_hold + self.reserve * self.F_w * self.winch.geometry.r_eff
        return float(T / (a.motor.D_total * (a.relief.p - a.boost.p)))

    @property
    def alpha_least(self) -> float:
        """D_m_min / D_m_max of SSC at this load and layer [-]."""
        return float(displacement_min(self.F_w, self.ratio, plc_record(self.crane).motors))

    def at(self, v: float, alpha_m: float) -> OperatingPoint:
        """Compensating at a wire speed without sign [m/s]: the load is at rest."""
        return operate(self.winch, self.sign * v, alpha_m, v_tip=-self.sign * v)

    def limits(self, alpha_m: Displacement) -> dict[Limit, float]:
        """Speed that each limit alone would allow [m/s]; see `Top`."""
        motor, r_eff, relief = self.crane.active.motor, self.winch.geometry.r_eff, self.crane.active.relief.p
        n_gear = math.inf if self.crane.n_gear is None else self.crane.n_gear

        @cache
        def used(v: float) -> tuple[float, float, float]:
            """Pumps [-], highest pressure over relief pressure [-], hydraulic power over that of the power units [-];
            all beyond 1 where nothing turns the shaft that fast."""
            try:
                o = self.at(v, alpha_m(v))
            except NoSteadyOperation:
                return BEYOND, BEYOND, BEYOND
            return abs(o.alpha_p), max(o.p_a, o.p_b) / relief, self._power(o)

        speeds = {
            Limit.PUMP: self._first(lambda v: 1.0 - used(v)[0]),
            Limit.PRESSURE: self._first(lambda v: 1.0 - used(v)[1]),
            Limit.POWER: self._first(lambda v: 1.0 - used(v)[2]),
            Limit.RESERVE: self._first(lambda v: alpha_m(v) - self.alpha_reserve),
            Limit.MOTOR: self._first(lambda v: min(motor.speed_limit(alpha_m(v)), n_gear) * r_eff - v),
        }
        if math.isfinite(self.carried.n_max):
            speeds[Limit.PASSIVE] = self.carried.n_max * r_eff
        return speeds

    def _power(self, o: OperatingPoint) -> float:
        """Power of the active pumps over the largest that the power units give, or, where the load drives the pumps,
        take back [-]."""
        P, hpu = o.flows.Q_p * o.dp_m, self.crane.hpu
        if hpu is None:
            return 0.0
        return float(P / power_most(self.crane) if P >= 0.0 else -P / max(hpu.P_back, LEAST_POWER))

    def top(self, alpha_m: Displacement) -> Top:
        """Highest speed with the motors at alpha_m(v)."""
        limits = self.limits(alpha_m)
        none = next((k for k, v in limits.items() if math.isnan(v)), None)
        if none is not None:
            return Top(math.nan, none, limits, None)
        binds = min(limits, key=lambda k: limits[k])
        v = limits[binds]
        return Top(v, binds, limits, self.at(v, alpha_m(v)))

    def top_of_mode(self, mode: Mode) -> Top:
        """Highest speed of a mode, up to the part of the SWL that it may carry."""
        if self.F_w > self._weight(mode.law.swl_share * self.crane.SWL) * (1.0 + 1e-9):
            return Top(math.nan, Limit.LOAD, {}, None)
        return self.top(self.displacement(mode))

    def _weight(self, load: float) -> float:
        """Wire tension with a payload [N]."""
        return float(self.F_w * (load + self.crane.hook_mass) / self.winch.params.hoist.load.m)

    def top_of_machine(self) -> Top:
        """Highest speed with the best fixed displacement: what all limits together allow, with any controller.

        Flow and speed limits fall with the displacement, pressure and reserve rise with it: the best one is the
        smallest, or where they meet. Where power binds there, it is the one that a speed takes least power with. Where
        pressure, reserve or power hold the displacement up, they are reported as what binds, though the pumps are full
        as well.
        """
        best = self._without_power
        return self._least_power(best)._replace(binds=Limit.POWER) if self.power_binds else best

    @property
    def power_binds(self) -> bool:
        """Whether power stops the machine, so that the displacement that takes least is searched for."""
        return self._without_power.binds is Limit.POWER

    @cached_property
    def _without_power(self) -> Top:
        """The best displacement where power does not limit; power binds if it allows less speed there."""
        alpha_min = self.crane.active.motor.alpha_min
        best = self._fixed(self._least)
        rising, falling = self._rising_and_falling(best)
        if rising >= falling or self._least == 1.0:
            return best._replace(binds=Limit.RESERVE) if best.binds is Limit.PUMP and self._least > alpha_min else best

        def gap(alpha: float) -> float:
            rising, falling = self._rising_and_falling(self._fixed(alpha))
            return rising - falling

        if gap(1.0) <= 0.0:
            return self._fixed(1.0)
        alpha = float(scipy.optimize.brentq(gap, self._least, 1.0, xtol=ALPHA_EXACT))
        best = max((self._fixed(alpha), self._fixed(min(alpha + ALPHA_EXACT, 1.0))), key=_speed)
        return best if best.binds is Limit.POWER else best._replace(binds=Limit.PRESSURE)

    def _least_power(self, best: Top) -> Top:
        """The best displacement where power binds, among those above the least one; `best` if none is better.

        What a speed takes has no order in the displacement: less of it leaks more by pressure, more of it loses more by
        flow.
        """
        alphas = [self._least + (1.0 - self._least) * i / (POWER_GRID - 1) for i in range(POWER_GRID)]
        tops = [self._fixed(alpha) for alpha in alphas]
        i = max(range(POWER_GRID), key=lambda i: _speed(tops[i]))
        about = (alphas[max(i - 1, 0)], alphas[min(i + 1, POWER_GRID - 1)])
        if about[0] < about[1]:
            exact = {"xatol": ALPHA_EXACT}
            nearest = scipy.optimize.minimize_scalar(
                lambda a: -_speed(self._fixed(float(a))), bounds=about, method="bounded", options=exact
            )
            tops.append(self._fixed(float(nearest.x)))
        return max((best, *tops), key=_speed)

    @property
    def _least(self) -> float:
        """Smallest displacement that the motors' stop and the reserve allow [-]."""
        return max(self.crane.active.motor.alpha_min, min(self.alpha_reserve, 1.0))

    def _fixed(self, alpha: float) -> Top:
        return self.top(lambda v: alpha)

    def _rising_and_falling(self, top: Top) -> tuple[float, float]:
        """Least speed of the limits that rise with the displacement, and of those that fall; no speed counts as 0
        [m/s]."""
        allowed = {k: 0.0 if math.isnan(v) else min(v, self.v_beyond) for k, v in top.limits.items()}
        rising = {Limit.PRESSURE, Limit.RESERVE}
        return min(allowed[k] for k in rising), min(
            v for k, v in allowed.items() if k not in rising and k is not Limit.POWER
        )

    def _first(self, margin: Callable[[float], float]) -> float:
        """Speed at which a margin is used up [m/s]; NaN where there is none at break-away, inf where there is always
        some."""
        if margin(BREAK_AWAY) < 0.0:
            return math.nan
        if margin(self.v_beyond) >= 0.0:
            return math.inf
        return float(scipy.optimize.brentq(margin, BREAK_AWAY, self.v_beyond, xtol=V_EXACT))


class DriveTop(NamedTuple):
    """Highest steady wire speed [m/s] and motor speed [rad/s] of a drive, and the limit that stops it."""

    v_w: float
    omega_m: float
    binds: str


def top_of_drive(crane: Crane, load: float, s_w: float, direction: Direction) -> DriveTop:
    """Highest steady speed of a winch type that states it, with a payload [kg] and wire paid out [m].

    Errors: SpecError for a type that does not.
    """
    winch = crane.plant.type
    if not hasattr(winch.module, "speed_limit"):
        raise SpecError(
            f'"{crane.name}": winch type "{crane.plant}" declares neither steady operation nor a speed limit, on which'
            " this question rests. Choose another crane, or another question."
        )
    case = Scenario(load=f"{float(load)!r} kg", s_w=f"{float(s_w)!r} m", mode=MANUAL_MODE)
    check(crane, case)
    p = pack(crane, case).params
    geo = winch.module.geometry(case.s_w, p)
    omega, binds = winch.module.speed_limit(p, geo, float(p.hoist.load.W), direction is Direction.LOWERING)
    return DriveTop(float(omega * geo.r_eff), float(omega), str(binds))


def _speed(top: Top) -> float:
    """Speed by which tops are compared [m/s]: none is the least."""
    return -math.inf if math.isnan(top.v_w) else top.v_w
