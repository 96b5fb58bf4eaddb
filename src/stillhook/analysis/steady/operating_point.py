"""Steady operation of the complete plant at a constant wire speed: leakage, friction, both lines, passive circuit and
wire as they are.

`stillhook.analysis.steady.steady_state` is the ideal machine of the published figures; here the equations are those of
`stillhook.winches`, which a run integrates, in steady state.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple

import scipy

from stillhook.analysis.steady.steady_state import check_displacement
from stillhook.control.registry import MANUAL_MODE
from stillhook.engine.pack.winch import pack
from stillhook.engine.scenario.checks import check
from stillhook.errors import SpecError, StillhookError
from stillhook.kernels.build import Setup, driver
from stillhook.kernels.drivers.winch import Driver
from stillhook.physics.load_path.drum import drag_force, wire_stiffness
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Operator, Scenario, Water
from stillhook.units import show
from stillhook.winches.circuits.active import ActiveFlows, active_flows
from stillhook.winches.records import Geometry, Tick, Tip

DP_MOST = 1.0e8
"""Pressure difference beyond which no steady operation is looked for [Pa]: 1000 bar, far above every relief valve."""
DP_NEAR, P_NEAR, P_NEXT = 2.0e7, 1.0e5, 1.0e3
"""Where pressures are looked for first [Pa]: a difference around nothing, the low side around the boost, and around its
last value."""
STOP_FREE = 100.0
"""Stroke of the pumps while their setting is sought, so that a setting beyond their stop can be reported [-]."""
P_EXACT, ALPHA_EXACT = 1e-6, 1e-13
"""What pressures [Pa] and pump setting [-] are solved to."""
MOST_TURNS = 100
_STILL = Tick(*(0.0,) * len(Tick._fields))


class NoSteadyOperation(StillhookError):
    """No pressure up to DP_MOST turns the shaft at this speed, turbulence and friction take more than the motors give;
    or the boost pump does not keep the lines filled."""


class Winch(NamedTuple):
    """A crane with a load and a wire paid out, ready for many operating points: module of its winch type, driver, its
    Params with the pumps' stops free, the drum there, and the wire paid out [m]."""

    name: str
    plant: ModuleType
    driver: Driver
    params: Any
    geometry: Geometry
    s_w: float


class OperatingPoint(NamedTuple):
    """The complete plant at a constant wire speed. SI; hoisting positive.

    alpha_p pump setting that it takes [-], u_p the same as a command; beyond 1 it cannot be reached (`reachable`).
    alpha_m, u_m motors [-]; v_w wire [m/s]; v_tip tip [m/s]; omega_m motors [rad/s]; F_w wire tension [N]; p_a, p_b
    lines [Pa]; T_f friction against hoisting [N m]; z bristle [rad]. Passive circuit: alpha_pm motors, alpha_pp pumps
    [-], p_hp high side [Pa] (0 without one). flows of the active circuit [m^3/s]. relief_open: a relief valve of the
    active circuit lets oil go. plant, driver, state (of winch and load path), command, geometry, tip, params: the
    plant's own records, at which every rate is zero but those of the wire paid out, of the oil in the accumulator and
    of the load's height. Where the point is not reachable, params has pumps with longer strokes.
    """

    alpha_p: float
    u_p: float
    alpha_m: float
    u_m: float
    v_w: float
    v_tip: float
    omega_m: float
    F_w: float
    p_a: float
    p_b: float
    T_f: float
    z: float
    alpha_pm: float
    alpha_pp: float
    p_hp: float
    flows: ActiveFlows
    reachable: bool
    relief_open: bool
    plant: ModuleType
    driver: Driver
    state: Any
    command: Any
    geometry: Geometry
    tip: Tip
    params: Any

    @property
    def dp_m(self) -> float:
        """Pressure drop over the active motors p_a - p_b [Pa]."""
        return self.p_a - self.p_b


def operating_point(
    crane: Crane,
    v_w: float,
    alpha_m: float,
    *,
    load: float,
    s_w: float,
    v_tip: float = 0.0,
    water: Water | None = None,
    **parts: float,
) -> OperatingPoint:
    r"""Operating point of the complete plant at a constant wire speed, from its own equations with every fast rate at
    zero:

    .. math:: \dot p_a = \dot p_b = \dot\omega_m = \dot z = \dot v_L = 0

    The wire carries the weight and, in water, the drag of a load that moves with v_w + v_tip. The passive motors are
    where the PLC puts them for that tension. Friction is that of the sliding winch; at v_w = 0 the bristle is relaxed
    (z = 0), the middle of the pressures between which a winch at rest stays stuck.

    Parameters: v_w wire speed, hoisting positive [m/s]; alpha_m displacement of the active motors over its maximum,
    above 0 up to 1 [-], below the crane's alpha_min too (its stop is then moved); load payload [kg]; s_w wire paid out
    [m]; v_tip constant speed of the tip, up positive [m/s]: -v_w while compensating (the load is at rest), 0 while the
    operator hoists; water as in a Scenario; parts of a passive circuit: V_o oil in the accumulator [m^3], default mid
    stroke, alpha_pp setting of its pumps [-], default the PLC's command once the mean pressure has settled. Friction is
    LuGre.
    Errors: StillhookError for a number outside its range, a load that the crane does not carry, a wire that goes slack;
    NoSteadyOperation, one of its kind, where no pressure difference up to 1000 bar gives the torque or the boost does
    not suffice.
    Source: the plants of Moslatt 2020 section 2.5 as in `stillhook.winches`. Valid for an instant: the accumulator
    fills or empties. Pump settings beyond 1 are reported, not held; a relief valve that is open counts with its flow.
    """
    if not all(isinstance(y, int | float) and math.isfinite(y) for y in (load, s_w)):
        raise StillhookError(f"load = {load} kg, s_w = {s_w} m: give finite numbers in SI.")
    case = Scenario(
        load=f"{float(load)!r} kg",
        s_w=f"{float(s_w)!r} m",
        water=water,
        mode=MANUAL_MODE,
        operator=Operator(),
    )
    check(crane, case)
    return operate(winch_at(crane, case), v_w, alpha_m, v_tip=v_tip, **parts)


def winch_at(crane: Crane, case: Scenario) -> Winch:
    """The winch with a scenario's load and wire. The scenario must have passed
    `stillhook.engine.scenario.checks.check`."""
    if not crane.plant.type.steady_operation:
        raise SpecError(
            f'"{crane.name}": winch type "{crane.plant}" declares no steady operation, on which this question rests.'
            " Choose another crane, or another question."
        )
    packed = pack(crane, case)
    A = packed.params.active
    free = packed.params._replace(active=A._replace(pump_servo=A.pump_servo._replace(lo=-STOP_FREE, hi=STOP_FREE)))
    from_full = free.hoist.drum.L_full - case.s_w
    if from_full <= 0.0:
        raise StillhookError(f"s_w = {show(case.s_w, 'length')}: no wire is left on the drum. Lower s_w.")
    plant = packed.plant
    return Winch(
        name=crane.name,
        plant=plant,
        driver=driver(packed.name, 1, Setup(losses=packed.setup.losses)),
        params=free,
        geometry=plant.geometry(case.s_w, free),
        s_w=case.s_w,
    )


def operate(winch: Winch, v_w: float, alpha_m: float, *, v_tip: float = 0.0, **parts: float) -> OperatingPoint:
    """The operating point of a prepared winch; parameters and errors as `operating_point`."""
    if not (math.isfinite(v_w) and math.isfinite(v_tip)):
        raise StillhookError(f"v_w = {v_w:g} m/s, v_tip = {v_tip:g} m/s: give finite speeds.")
    check_displacement(alpha_m)
    p, geo, servo = winch.params, winch.geometry, winch.params.active.motor_servo
    if alpha_m < servo.lo:  # the motors' stop is moved
        p = p._replace(active=p.active._replace(motor_servo=servo._replace(lo=alpha_m)))
    tip, omega_m = Tip(0.0, v_tip), v_w / geo.r_eff
    F_w = p.hoist.load.W - drag_force(v_w + v_tip, p.hoist.load)
    if F_w <= 0.0:
        raise StillhookError(
            f"v_w = {show(v_w, 'speed')}: the load sinks slower in water than the wire is paid out; it goes slack. Go"
            " slower."
        )
    x, u = winch.plant.steady(p, geo, F_w, omega_m, v_w + v_tip, alpha_m, **parts)
    path = winch.driver.path.start(winch.s_w, _STILL, p)
    path = path._replace(s_load=-F_w / wire_stiffness(winch.s_w, p.hoist.wire), v_load=v_w + v_tip)
    x = _balanced_torque(winch, winch.driver.State(x, path), u, tip, p)
    wx, flows = _balanced_flows(x.winch, p)
    return _point(winch, x._replace(winch=wx), u._replace(u_p=wx.alpha_p), tip, p, flows, v_w, F_w)


def _sliding(w: Winch, x: Any, u: Any, tip: Tip, p: Any) -> Any:
    """State with the bristle as it is in steady sliding; relaxed at standstill."""
    q = w.driver.path_point(x, w.geometry, tip, p)
    c = w.plant.circuit(x.winch, q, u, w.geometry, p)
    still = x.winch._replace(z=0.0)
    z = w.plant.bristle_after(c, still, p, math.inf) if still.omega_m != 0.0 else 0.0
    return x._replace(winch=still._replace(z=z))


def _balanced_torque(w: Winch, x: Any, u: Any, tip: Tip, p: Any) -> Any:
    """State with the pressure difference that holds the speed; the torque depends on nothing else of the lines."""

    def acceleration(dp: float) -> float:
        y = _sliding(w, x._replace(winch=_pressed(x.winch, dp)), u, tip, p)
        return float(w.driver.rates(y, u, w.geometry, tip, p).winch.omega_m)

    dp = _root(acceleration, 0.0, DP_NEAR, DP_MOST)
    if dp is None:
        raise NoSteadyOperation(
            f'"{w.name}": no pressure up to {show(DP_MOST, "pressure")} holds this load at this speed, motors at'
            f" {x.winch.alpha_m:.3g}. Go slower, lower the load or raise alpha_m."
        )
    return _sliding(w, x._replace(winch=_pressed(x.winch, dp)), u, tip, p)


def _pressed(x: Any, dp: float) -> Any:
    """State with a pressure difference p_a - p_b, neither line below 0: oil carries no tension."""
    return x._replace(p_a=max(dp, 0.0), p_b=max(-dp, 0.0))


def _balanced_flows(x: Any, p: Any) -> tuple[Any, ActiveFlows]:
    """State with the pump setting and the low side's pressure at which both lines hold theirs, p_a - p_b as given, and
    the flows."""
    A, dp = p.active, x.p_a - x.p_b
    D_m, per_alpha = A.motors.count * A.motors.D_max * x.alpha_m, A.pumps.D_max * A.pumps.omega_p
    p_b, near = A.boost.p + max(-dp, 0.0), P_NEAR

    def flows(alpha_p: float, p_b: float) -> Any:
        return active_flows(alpha_p, D_m, x.omega_m, p_b + dp, p_b, 1.0, A)

    def surplus(p_b: float, alpha_p: float) -> float:
        f = flows(alpha_p, p_b)
        return float(f.Q_a + f.Q_b)

    alpha_p = D_m * x.omega_m / per_alpha
    for _ in range(MOST_TURNS):  # the pumps' own leak is a few per cent of their flow: each turn is that much nearer
        root = _root(lambda p, alpha_p=alpha_p: -surplus(p, alpha_p), p_b, near, DP_MOST)  # type: ignore[misc]
        if root is None:
            raise NoSteadyOperation(
                "the boost pump does not compensate what leaks and what the relief valves discharge, p_a - p_b"
                f" {show(dp, 'pressure', 3)}. Go slower, lower the load or raise alpha_m."
            )
        p_b, near = root, P_NEXT
        f = flows(alpha_p, p_b)
        if abs(f.Q_a) <= ALPHA_EXACT * per_alpha:
            return x._replace(alpha_p=alpha_p, p_a=p_b + dp, p_b=p_b), f
        alpha_p -= f.Q_a / per_alpha
    raise StillhookError(
        f"no pump setting holds the pressures: the pumps' leak grows as fast as their flow (alpha_p {alpha_p:.4g})."
    )


def _root(f: Callable[[float], float], near: float, width: float, most: float) -> float | None:
    """Zero of a rising function of a pressure, sought from a guess outwards up to `most`; None where there is
    none."""
    while width <= 2.0 * most:
        if f(near - width) <= 0.0 <= f(near + width):
            return float(scipy.optimize.brentq(f, near - width, near + width, xtol=P_EXACT, rtol=1e-15))
        width *= 10.0
    return None


def _point(w: Winch, x: Any, u: Any, tip: Tip, p: Any, f: ActiveFlows, v_w: float, F_w: float) -> OperatingPoint:
    reachable = abs(x.winch.alpha_p) <= 1.0
    if reachable:
        A = p.active
        p = p._replace(active=A._replace(pump_servo=A.pump_servo._replace(lo=-1.0, hi=1.0)))
    q = w.driver.path_point(x, w.geometry, tip, p)
    c, wx = w.plant.circuit(x.winch, q, u, w.geometry, p), x.winch
    signals = w.plant.signals(c, wx, q, u, w.geometry, p)
    T_f = w.plant.powers(c, wx, q, p).friction / wx.omega_m if wx.omega_m else 0.0
    relief_open = f.Q_relief_a + f.Q_relief_b > 0.0
    return OperatingPoint(
        alpha_p=wx.alpha_p,
        u_p=u.u_p,
        alpha_m=wx.alpha_m,
        u_m=u.u_m,
        v_w=v_w,
        v_tip=tip.v,
        omega_m=wx.omega_m,
        F_w=F_w,
        p_a=wx.p_a,
        p_b=wx.p_b,
        T_f=T_f,
        z=wx.z,
        alpha_pm=getattr(signals, "alpha_pm", 0.0),
        alpha_pp=getattr(signals, "alpha_pp", 0.0),
        p_hp=getattr(signals, "p_hp", 0.0),
        flows=f,
        reachable=reachable,
        relief_open=relief_open,
        plant=w.plant,
        driver=w.driver,
        state=x,
        command=u,
        geometry=w.geometry,
        tip=tip,
        params=p,
    )
