"""The only place where a crane and a scenario become records that the compiled kernels read."""

import functools
import math
from collections.abc import Iterable, Sequence
from types import ModuleType
from typing import Any, NamedTuple, Protocol

from stillhook.base.kept.identity import remembered
from stillhook.control.commands import AhcGains, BrakeSettings, Loop, MotorSettings, PassiveSettings, PowerLimit
from stillhook.control.plant import PlantParameters
from stillhook.control.plc import Memory, Plc
from stillhook.control.registry import CONTROLLERS, Mode, code_of
from stillhook.engine.pack.displacement import displacement_limits
from stillhook.engine.pack.gas import accumulator_record, charged, gas_record
from stillhook.engine.pack.prediction import predicting
from stillhook.engine.pack.shaft import shaft_friction, wire_EA
from stillhook.kernels.build import Setup
from stillhook.kernels.control_laws import controllers_of_winch
from stillhook.library.leakage import leak_law
from stillhook.physics.friction import Bristle, SystemFriction
from stillhook.physics.hydraulics.lines import capacitance
from stillhook.physics.hydraulics.motor import Motors
from stillhook.physics.hydraulics.motor_laws import FITTED
from stillhook.physics.hydraulics.pump import Pumps
from stillhook.physics.hydraulics.swash import MotorControl
from stillhook.physics.load_path.drum import (
    Drum,
    Inertia,
    K_wire,
    Load,
    Wire,
    layer_diameter,
    layers_filled,
    suspended_load,
)
from stillhook.physics.records import other_classes
from stillhook.physics.scalar import G
from stillhook.spec import crane as spec
from stillhook.spec.control import own_settings
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import FrictionModel, Operator, Scenario
from stillhook.spec.sensors import error_settings
from stillhook.spec.settings import sensor_settings
from stillhook.winches.circuits import tables as circuits
from stillhook.winches.circuits.active import ActiveCircuit
from stillhook.winches.circuits.passive import PassiveCircuit
from stillhook.winches.interface import Parts
from stillhook.winches.load_path.load import Hoist
from stillhook.winches.records import Sensors

FILL_RATE = 15.0
"""Rate at which the pumps bring the motors to the load's torque behind the closed brake [rad/s]: half of what their
displacement controls follow. Assumed."""
FILL_MOST, BOOST_SHARE = 0.3, 0.5
"""Largest pump command against the closed brake [-], and largest part of the boost flow that filling a line may take
[-]: what goes into one line the other must get from the boost pump. Assumed."""
PROVED = 1.0e6
"""Pressure by which the motors' torque may be off when the brake opens [Pa]: 10 bar, a twentieth of what a full load
needs. Assumed."""


class Packed(NamedTuple):
    """A crane and a scenario as the kernels read them: plant module, its Params, the PLC's memory, which
    `memory_before` completes, the controllers that not every kernel holds, the own settings of controllers and sensors
    that have some, by name, and what its kernel runs besides the winch type."""

    plant: ModuleType
    name: str
    params: Any
    memory: Memory
    s_w: float
    extra_controllers: tuple[str, ...]
    settings: dict[str, Any]
    setup: Setup


def kernel_of(crane: Crane, errors: Sequence[str] = (), losses: tuple[tuple[str, str], ...] | None = None) -> Setup:
    """`Packed.setup` of a crane with these sensors of a scenario; losses: `losses_of` it, where they are known."""
    on, late = crane.control.guard is not None, any(crane.plant.type.dead_times(crane).values())
    sensors, known = (*sensor_settings(crane.sensors), *errors), losses_of(crane) if losses is None else losses
    return Setup(
        guarded=on,
        sensors=sensors,
        losses=known,
        ports=has_ports(crane),
        checks=on,
        late=late,
        predicts=crane.control.prediction is not None,
    )


def has_ports(crane: Crane) -> bool:
    """Whether the pressures at the ports of pumps and motors differ from those of the lines."""
    return getattr(crane.circuits.get("active"), "lines", None) is not None


def losses_of(crane: Crane) -> tuple[tuple[str, str], ...]:
    """The torque losses by other models than MJ4, as the key of a kernel names them."""
    if all(getattr(motors, "loss_model", None) is None for motors in crane.motors):
        return ()
    return pack(crane, Scenario(load="0 kg", s_w="0 m", mode=crane.plant.type.default_mode)).setup.losses


def wire_speed_max(crane: Crane, alpha_m: float = 1.0, d: float | None = None) -> float:
    """Wire speed with the pumps full and no leakage [m/s], on diameter d [m] (default: the published outer one)."""
    direct: float | None = crane.plant.type.full_wire_speed(crane)
    if direct is not None:
        return direct
    return motor_speed_max(crane, alpha_m) / crane.i_hD * (crane.drum.d_max if d is None else d) / 2.0


def motor_speed_max(crane: Crane, alpha_m: float = 1.0) -> float:
    """Motor speed at full command and without leakage [rad/s]."""
    return float(crane.plant.type.full_speed(crane, alpha_m))


def gains(crane: Crane) -> AhcGains:
    """K_1 = 1 / v_w(alpha_p = 1, alpha_m = 1) on the largest diameter, K_2 = K_1 2 zeta_p / omega_np, unless the file
    gives them.

    Differs from print: paper E's K_1 = 0.68 s/m contradicts the speed of its own table 2 (0.8279 s/m).
    """
    c = crane.control
    K_1 = c.K_1 if c.K_1 is not None else 1.0 / wire_speed_max(crane)
    K_2 = c.K_2 if c.K_2 is not None else K_1 * crane.plant.type.lag(crane)
    return AhcGains(K_1=K_1, K_2=K_2, K_p=c.K_p)


def loop_record(crane: Crane, alpha_m: float = 1.0, K_wire: float = 1.0) -> Loop:
    """The position loop of paper E: one line holds its pressure, B_v stands for all friction, J is that of the full
    drum.

    alpha_m displacement of the active motors [-]; K_wire published outer diameter over the one in use [-].
    """
    a, J, B_v, servo = crane.active, crane.inertia.J_m_eff, crane.control.B_v, crane.active.pump.servo
    C_h, D_m = capacitance(a.line.V, a.line.bulk_modulus), a.motor.D_total * alpha_m
    r_eff = wire_speed_max(crane, alpha_m) * D_m / K_wire  # D_p omega_p d / (2 i_hD)
    return Loop(
        a_0=(D_m * D_m + B_v * a.C_leak) / (J * C_h),
        a_1=B_v / J + a.C_leak / C_h,
        b_0=servo.omega_n**2,
        b_1=2.0 * servo.zeta * servo.omega_n,
        g=D_m * r_eff / (J * C_h),
    )


def _pumps(circuit: circuits.ActiveCircuit | circuits.PassiveCircuit) -> Pumps:
    pump = circuit.pump
    return Pumps(D_max=pump.D_total, omega_p=pump.omega_p, leak=leak_law(circuit).pumps)


def _motors(circuit: circuits.ActiveCircuit | circuits.PassiveCircuit) -> Motors:
    leak = leak_law(circuit)
    return circuits.motors_record(circuit.motor, leak.C_1, leak.C_2)


def _motor_control(motor: circuits.MotorSet) -> MotorControl:
    if motor.variant is circuits.ServoVariant.CLOSED_LOOP:
        return MotorControl(offset=0.0, half_width=0.0, feedback=1.0)
    feedback = 1.0 if motor.variant is circuits.ServoVariant.OPEN_LOOP_FEEDBACK else 0.0
    return MotorControl(offset=motor.offset, half_width=0.5 * motor.hysteresis, feedback=feedback)


def active_record(crane: Crane) -> ActiveCircuit:
    a = crane.active
    n_full, n_max = a.motor.speed_ends(crane.n_gear)
    return ActiveCircuit(
        pumps=_pumps(a),
        pump_servo=circuits.servo_record(a.pump.servo),
        motors=_motors(a),
        motor_servo=circuits.servo_record(a.motor.servo, a.motor.alpha_min),
        control=_motor_control(a.motor),
        i_C_h=1.0 / capacitance(a.line.V, a.line.bulk_modulus),
        i_beta=1.0 / a.line.bulk_modulus,
        lines=circuits.restriction(a),
        internal=circuits.internal_share(a),
        boost=circuits.boost_record(a.boost),
        relief=circuits.relief_record(a.relief),
        flushing=circuits.flushing_record(a.flushing, a.boost),
        n_full=n_full,
        n_max=n_max,
        P_back=circuits.power_back(crane),
    )


def passive_record(crane: Crane, gas_held: bool, gas_factor: float = 1.0) -> PassiveCircuit:
    """The passive circuit; gas_held: its accumulator has so large a bank that its pressure is constant; gas_factor: its
    charge over that of the crane file, which is what the PLC holds [-]."""
    p = crane.passive
    assert p is not None
    pump = _pumps(p)
    n_full, n_max = p.motor.speed_ends(crane.n_gear)
    return PassiveCircuit(
        pumps=pump,
        pump_servo=circuits.servo_record(p.pump.servo),
        motors=_motors(p),
        motor_servo=circuits.servo_record(p.motor.servo, p.motor.alpha_min),
        accumulator=accumulator_record(p.accumulator, p.line, gas_held, "passive", gas_factor),
        relief=circuits.relief_record(p.relief),
        internal=circuits.internal_share(p),
        settings=PassiveSettings(
            D_m_max=p.motor.D_total,
            Q_p_max=pump.D_max * pump.omega_p,
            p_lp=p.p_lp,
            p_set=p.accumulator.gas.p_0,
            K_acc=crane.control.K_acc,
            dp_least=circuits.DP_LEAST,
            least=0.0 if p.bank is None else 1.0,
        ),
        n_full=n_full,
        n_max=n_max,
    )


def drum_record(crane: Crane) -> Drum:
    """The drum as the kernels read it; L_full is the wire on the full drum (square stacked)."""
    d, n, d_w = crane.drum.d, crane.drum.layers, crane.wire.d
    L_full = math.pi * crane.drum.turns * (n * d + n * n * d_w)
    return Drum(
        d=d,
        d_wire=d_w,
        turns=float(crane.drum.turns),
        layers=float(n),
        d_max=crane.drum.d_max,
        L_full=L_full,
        m_wire=crane.wire.mass_per_length,
    )


def layer_diameter_at(crane: Crane, s_w: float) -> float:
    """Diameter of the wire centre on the layer in use with s_w paid out [m]."""
    drum = drum_record(crane)
    return float(layer_diameter(layers_filled(drum.L_full - s_w, drum), drum))


def inertia_record(crane: Crane) -> Inertia:
    motors = sum(m.count * m.J for m in crane.motors)
    return Inertia(motors, crane.inertia.J_gear, crane.inertia.J_drum, crane.i_hD**-2)


def load_record(crane: Crane, case: Scenario) -> Load:
    """Hook and payload."""
    return suspended_load(case.load, crane.hook_mass, *water_around(case))


def water_around(case: Scenario) -> tuple[float, float, float, float]:
    """What the water does to a payload: displaced mass [kg], added mass [kg], drag [N s^2/m^2], current across it
    [m/s]; zeros in air."""
    w = case.water
    if w is None:
        return 0.0, 0.0, 0.0, 0.0
    return w.rho * w.volume, w.added_mass, 0.5 * w.rho * w.C_D * w.area, w.current


def friction_record(s: spec.SystemFriction) -> SystemFriction:
    return SystemFriction(Y_1=s.Y_1, Y_2=s.Y_2, Y_3=s.Y_3, i_Y_4=1.0 / s.Y_4, Y_5=s.Y_5, Y_6=s.Y_6)


def _hoist(crane: Crane, case: Scenario) -> Hoist:
    w, f = crane.wire, crane.friction
    load = load_record(crane, case)
    n_motors = sum(m.count for m in crane.motors)
    sigma_1 = f.sigma_1_ratio * math.sqrt(f.sigma_0 * crane.inertia.J_m_eff)
    regular = 1.0 if case.friction is FrictionModel.REGULARISED else 0.0
    return Hoist(
        drum=drum_record(crane),
        inertia=inertia_record(crane),
        wire=Wire(EA=wire_EA(w), L_0=w.L_0, mu=w.mass_per_length, zeta=w.zeta),
        load=load,
        friction=friction_record(f.system),
        bristle=Bristle(
            sigma_0=f.sigma_0,
            sigma_1=sigma_1,
            i_omega_f=1.0 / f.omega_fade,
            regular=regular,
            i_omega_r=1.0 / f.omega_reg,
        ),
        i_i=1.0 / crane.i_hD,
        s_w_0=case.s_w,
        n_motors=float(n_motors),
        T_brake=spec.brake_torque(crane),
    )


def plc_record(crane: Crane, operator: Operator | None = None) -> Plc:
    """The PLC's settings, with the displacement that the operator holds in manual mode."""
    return _plc(crane, (operator.alpha_m or 0.0) if operator is not None else 0.0)


@remembered
def _plc(crane: Crane, alpha_hold: float) -> Plc:
    c = crane.control
    drum = drum_record(crane)
    K_outer = K_wire(layer_diameter(drum.layers, drum), drum)
    F_swl = (crane.SWL + crane.hook_mass) * G
    alpha_swl = c.alpha_ns if c.alpha_swl is None else c.alpha_swl
    settings = MotorSettings(
        alpha_min=crane.plant.type.least_displacement(crane),
        alpha_ns=c.alpha_ns,
        alpha_hs=c.alpha_hs,
        alpha_swl=alpha_swl,
        u_thr=c.u_thr,
        i_F_swl=1.0 / F_swl,
        K_outer=K_outer,
        alpha_hold=alpha_hold,
        limits=displacement_limits(crane, friction_record(crane.friction.system)),
    )
    return Plc(
        gains=gains(crane),
        motors=settings,
        t_cycle=c.t_cycle,
        tau_F=c.tau_F,
        tau_p=c.tau_acc,
        t_bumpless=c.t_bumpless,
        t_lead=c.t_lead or 0.0,
        t_lead_ff=c.feedforward_lead,
        t_compute=c.computing,
        power=PowerLimit(power_most(crane), *crane.plant.type.pump_flows(crane)),
        brake=_brake(crane),
        plant=plant_parameters(crane),
    )


def plant_parameters(crane: Crane) -> PlantParameters:
    """What controllers may know of a crane: its numbers, or those of the crane that its PLC was set up for."""
    if crane.control.known is not None:
        return crane.control.known
    drum, inertia, h = drum_record(crane), inertia_record(crane), crane.plant.type.hydraulics(crane)
    return PlantParameters(
        **{name: float(value) for name, value in h._asdict().items()},
        i_hD=crane.i_hD,
        r_drum=0.5 * drum.d,
        d_max=drum.d_max,
        d_wire=drum.d_wire,
        layers=drum.layers,
        turns=drum.turns,
        m_wire=drum.m_wire,
        EA=wire_EA(crane.wire),
        L_0=crane.wire.L_0,
        SWL=crane.SWL * G,
        m_hook=crane.hook_mass,
        J=inertia.J_motor + inertia.J_gear + inertia.J_drum * inertia.i_i2,
        **shaft_friction(crane, friction_record(crane.friction.system))._asdict(),
    )


def set_up_for(crane: Crane, other: Crane) -> Crane:
    """The crane with a PLC that was set up for another: controllers know the other's numbers, as those of data sheets
    from which a machine differs."""
    known = crane.control.model_copy(update={"known": plant_parameters(other)})
    return crane.model_copy(update={"control": known})


def power_most(crane: Crane) -> float:
    """Largest hydraulic power that all power units give together [W]: the lesser of their power, and of their torque at
    the pumps' speed; circuits.NO_LIMIT where the crane file names none."""
    if crane.hpu is None:
        return circuits.NO_LIMIT
    T, omega = crane.hpu.T_max, crane.plant.type.pump_speed(crane)
    return crane.hpu.P_max if T is None or omega is None else min(crane.hpu.P_max, T * omega)


def torque_limit(crane: Crane) -> float | None:
    """Torque of the power units [N m] where they come to it before they come to their power, the pumps turning at one
    speed; else None."""
    hpu = crane.hpu
    return None if hpu is None or power_most(crane) >= hpu.P_max else hpu.T_max


NO_BRAKE = BrakeSettings(
    fitted=0.0, t_wait=0.0, t_close=0.0, t_open=0.0, t_most=0.0, dp_near=PROVED, K_fill=0.0, K_leak=0.0, u_most=0.0
)
"""Of a winch that is held by its circuits alone."""


def _brake(crane: Crane) -> BrakeSettings:
    """How the holding brake is worked."""
    b = crane.brake
    if b is None:
        return NO_BRAKE
    times = {"t_wait": b.t_wait, "t_close": b.t_close, "t_open": b.t_open, "t_most": b.t_prove}
    brake = NO_BRAKE._replace(fitted=1.0, **times)
    if not crane.circuits:  # nothing to fill before it opens
        return brake
    a = crane.active
    Q = a.pump.D_total * a.pump.omega_p
    K_fill = capacitance(a.line.V, a.line.bulk_modulus) * FILL_RATE / Q
    u_most = FILL_MOST if a.boost.Q_max is None else min(FILL_MOST, BOOST_SHARE * a.boost.Q_max / Q)
    return brake._replace(K_fill=K_fill, K_leak=a.C_leak / Q, u_most=u_most)


def pack(crane: Crane, case: Scenario, *, gas_factor: float = 1.0) -> Packed:
    """Records for one run. The scenario must have passed `stillhook.engine.scenario.checks.check`.

    gas_factor: charge of accumulators over that which the crane was set up with, and which its PLC holds [-].
    """
    hoist = _hoist(crane, case)
    crane = crane.plant.type.prepared(crane, hoist.load.W, layer_diameter_at(crane, case.s_w))
    sensors = Sensors(q_s=case.sensors.step_s_w, q_F=case.sensors.step_F)
    p_0 = crane.plant.type.charge(crane)
    modes = (case.mode, *(mode for _, mode in case.modes))
    mode = code_of(case.mode)
    plc = plc_record(crane, case.operator)
    if case.commands is not None:
        plc = plc._replace(brake=plc.brake._replace(fitted=0.0))  # the record moves the winch, and nothing of the PLC
    memory = Memory(
        mode=mode,
        datum=0.0,
        F=hoist.load.W,
        p_mean=p_0,
        u_p=0.0,
        u_m=1.0,
        b_p=0.0,
        b_m=0.0,
        held=1.0,
        brake=0.0,
        idle=0.0,
        stroke=1.0,
    )
    winch = crane.plant.type
    params = winch.pack(crane, case, parts_of(hoist, plc, sensors, gas_factor=gas_factor))
    extra_controllers, settings = controllers_of(crane, modes)
    errors = error_settings(case.sensors, winch, plc.t_cycle)
    losses = tuple((at, FITTED[of].label) for at, of in other_classes(params, winch.module.Params).items())
    return Packed(
        plant=winch.module,
        name=winch.name,
        params=params,
        memory=memory,
        s_w=case.s_w,
        extra_controllers=extra_controllers,
        settings=settings | sensor_settings(crane.sensors) | errors | predicting(crane),
        setup=kernel_of(crane, tuple(errors), losses),
    )


def parts_of(
    hoist: Hoist | None = None, plc: Plc | None = None, sensors: Sensors | None = None, *, gas_factor: float = 1.0
) -> Parts:
    """What winch types pack their records from; gas_factor as in `pack`."""
    return Parts(
        hoist=hoist,
        plc=plc,
        sensors=sensors,
        active=active_record,
        passive=functools.partial(passive_record, gas_factor=gas_factor),
        gas=lambda table: gas_record(charged(table, gas_factor)),
        accumulator=functools.partial(accumulator_record, gas_factor=gas_factor),
    )


class MotorLaw(Protocol):
    """A controller's command to the motors [-] at a feedforward u_ff and a measured displacement alpha_m [-]."""

    def __call__(self, u_ff: float, alpha_m: float = 1.0) -> float: ...


def motor_law(crane: Crane, mode: Mode, F: float = 0.0, K_wire: float = 1.0, *, plc: Plc | None = None) -> MotorLaw:
    """A controller's command to the motors with F on the load cell [N], on the layer of K_wire [-]. A controller with a
    memory is as at its start.

    plc: default the crane's.
    """
    law, fields = mode.law, own_settings(crane.control, mode.law)
    settings = plc_record(crane) if plc is None else plc

    def displacement(u_ff: float, alpha_m: float = 1.0) -> float:
        return law.displacement(u_ff, F, K_wire, settings, fields, alpha_m)

    return displacement


def controllers_of(crane: Crane, modes: Iterable[str]) -> tuple[tuple[str, ...], dict[str, Any]]:
    """The controllers in this crane's kernels that not every kernel holds, and the own settings of each that has
    some."""
    names = controllers_of_winch(crane.plant.type, modes)
    fields = {name: own_settings(crane.control, CONTROLLERS[name]) for name in names}
    return names, {name: settings for name, settings in fields.items() if settings is not None}
