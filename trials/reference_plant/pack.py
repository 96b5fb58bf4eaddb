"""Crane, scenario and reference crane as records of the reference plant, and runs with it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from stillhook.engine.arguments import RK4_LIMIT, SERIES_STEP, check_step, steps_per_cycle
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.pack.winch import Packed, pack
from stillhook.engine.scenario.checks import check
from stillhook.engine.scenario.run import Ready, ScenarioBlock
from stillhook.engine.simulate import dataset_of, raise_failures
from stillhook.errors import SpecError
from stillhook.kernels.build import PLANTS
from stillhook.physics.hydraulics.swash import Servo
from stillhook.physics.load_path.drum import wire_damping
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.spec.lift.payload import RHO_STEEL
from stillhook.spec.scenario import RHO_SEA, Scenario
from stillhook.winches.circuits.active import ActiveCircuit
from stillhook.winches.circuits.passive import PassiveCircuit
from stillhook.winches.load_path.load import Hoist
from trials.reference_plant import plant
from trials.reference_plant.drum import TrueDrum
from trials.reference_plant.laws import Lines, Oil
from trials.reference_plant.parameters import (
    ReferenceCrane,
    active_leak,
    reference_friction,
    reference_passive,
)
from trials.reference_plant.rope import Rope

if TYPE_CHECKING:
    import xarray

PLANTS[plant.NAME] = plant

SLIP_PRESSURE = 250e5
"""Pressure at which, with full flow, the electric motors have the slip that `ReferenceCrane.slip` names [Pa]."""
STRAIN = 1.3e-3
"""Strain at which the wire has the twin's stiffness [-]: that of half the SWL on the library's cranes."""


def pack_reference(crane: Crane, case: Scenario, reference: ReferenceCrane) -> Packed:
    """Records of the reference plant for one run. Errors: SpecError where the crane has no passive circuit."""
    if crane.plant != plant.OF:
        raise SpecError(
            f'"{crane.name}" is {crane.plant}: the reference plant is an active/passive winch. Choose such a crane.'
        )
    if case.gas_held:
        raise SpecError('gas = "held": the reference plant has its own gas. Leave it out.')
    twin = pack(crane, case)
    p, t_cycle = twin.params, crane.control.t_cycle
    active = _active(p.active, reference)
    hoist = _hoist(p.hoist, reference)
    passive = _passive(p.passive, reference)
    more = active.motors.count / p.active.motors.count
    gains = p.plc.gains
    params = plant.Params(
        active=active,
        passive=passive,
        hoist=hoist,
        plc=p.plc._replace(
            gains=gains._replace(K_1=more * reference.K_1 * gains.K_1, K_2=more * gains.K_2)
        ),  # the PLC has the parameters of its own motors
        sensors=p.sensors,
        extra=plant.Extra(
            lines=_lines(active, reference),
            oil=_oil(case.duration, reference),
            friction=reference_friction(crane, reference).friction,
            rope=_rope(hoist, case, reference),
            drum=_drum(hoist, reference),
            leak=active_leak(crane, reference),
            passive=reference_passive(crane, passive, reference),
            slip=reference.slip / (active.pumps.D_max * active.pumps.omega_p * SLIP_PRESSURE),
            late=min(reference.pump_late / t_cycle, 1.0),
            u_limit=reference.pump_limit,
            i_tau_cell=1.0 / reference.tau_cell,
            cell_gain=reference.cell_gain,
            cell_zero=reference.cell_zero,
            dac=2.0 ** (1.0 - reference.dac_bits),
        ),
    )
    return Packed(plant, plant.NAME, params, twin.memory._replace(p_mean=passive.settings.p_set), *twin[4:])


def _active(a: ActiveCircuit, reference: ReferenceCrane) -> ActiveCircuit:
    m, boost = a.motors, reference.boost * a.boost.p
    return a._replace(
        pumps=a.pumps._replace(omega_p=reference.pump_speed * a.pumps.omega_p),
        pump_servo=_servo(a.pump_servo, reference.pump_omega, reference.pump_zeta),
        motors=m._replace(count=m.count + reference.active_more, D_max=reference.motor_D * m.D_max),
        motor_servo=_servo(a.motor_servo, reference.motor_omega, reference.motor_zeta),
        control=a.control._replace(
            offset=reference.motor_offset, half_width=0.5 * reference.motor_hysteresis, feedback=1.0
        ),
        i_C_h=a.i_C_h / reference.capacitance,
        boost=a.boost._replace(p=boost),
        flushing=a.flushing._replace(p=a.flushing.p + boost - a.boost.p),
    )


def _passive(c: PassiveCircuit, reference: ReferenceCrane) -> PassiveCircuit:
    """The PLC's settings of its passive circuit: its number of motors, its set pressure."""
    count = c.motors.count + reference.passive_more
    ratio = count / c.motors.count
    s = c.settings
    return c._replace(
        motors=c.motors._replace(count=count),
        settings=s._replace(D_m_max=ratio * s.D_m_max, p_set=reference.precharge * s.p_set),
    )


def _servo(servo: Servo, omega: float, zeta: float) -> Servo:
    return servo._replace(omega_n=omega * servo.omega_n, zeta=zeta * servo.zeta)


def _hoist(h: Hoist, reference: ReferenceCrane) -> Hoist:
    """Gear, inertia, wire on the drum and bristle; weight on the wire and friction of the twin remain, unused."""
    J, f = h.inertia, reference.inertia
    return h._replace(
        i_i=h.i_i / reference.gear,
        inertia=J._replace(
            J_motor=f * J.J_motor, J_gear=f * J.J_gear, J_drum=f * J.J_drum, i_i2=J.i_i2 / reference.gear**2
        ),
        drum=h.drum._replace(L_full=h.drum.L_full - reference.wire_short, m_wire=f * h.drum.m_wire),
        bristle=h.bristle._replace(
            sigma_0=reference.bristle * h.bristle.sigma_0, sigma_1=math.sqrt(reference.bristle) * h.bristle.sigma_1
        ),
    )


def _lines(a: ActiveCircuit, reference: ReferenceCrane) -> Lines:
    """Both ends make up the line's capacitance; the inertance follows from the frequency at which they swing against
    each other."""
    i_C_p, i_C_m = a.i_C_h / reference.line_split, a.i_C_h / (1.0 - reference.line_split)
    return Lines(
        i_C_p, i_C_m, reference.line_omega**2 / (i_C_p + i_C_m), reference.line_drop / (a.pumps.D_max * a.pumps.omega_p)
    )


def _oil(duration: float, reference: ReferenceCrane) -> Oil:
    """One full swing of the temperature a run, so that its mean is nominal."""
    omega, phase = 2.0 * math.pi / duration, reference.oil_phase
    return Oil(
        omega, reference.oil_swing * math.sin(phase), omega * reference.oil_swing * math.cos(phase), reference.oil_thin
    )


def _drum(h: Hoist, reference: ReferenceCrane) -> TrueDrum:
    """The drum of the crane file, its layers pressed together."""
    d, J = h.drum, h.inertia
    pitch = (1.0 - reference.wire_pressed) * d.d_wire
    return TrueDrum(
        d=d.d,
        pitch=pitch,
        turns=d.turns,
        L_full=d.L_full,
        m_wire=d.m_wire,
        J_shaft=J.J_motor + J.J_gear,
        J_drum=J.J_drum,
        i_i=h.i_i,
    )


def _rope(h: Hoist, case: Scenario, reference: ReferenceCrane) -> Rope:
    """Half of the wire's mass in its middle, the rest of the moving mass below. Weight and mass add up to the twin's:
    the load that tests name is what the winch carries, wire and all (paper F table 3, "winch load"). Its tangent
    stiffness at STRAIN is the twin's.
    """
    m_mid = min(0.5 * h.drum.m_wire / reference.inertia * (h.wire.L_0 + case.s_w), reference.wire_mass * h.load.m)
    W_mid = m_mid * G * (1.0 - (RHO_SEA / RHO_STEEL if case.water is not None else 0.0))
    m_low = h.load.m - m_mid
    c = float(wire_damping(case.s_w, h.load.m, h.wire))
    k = h.wire.EA / (h.wire.L_0 + case.s_w)
    EA = h.wire.EA / (1.0 + 2.0 * reference.wire_beta * STRAIN)
    return Rope(
        EA=EA,
        beta=reference.wire_beta,
        L_0=h.wire.L_0,
        c=2.0 * reference.wire_zeta * c,
        strands=reference.wire_strands,
        i_tau=math.sqrt(k / h.load.m),
        W_mid=W_mid,
        m_mid=m_mid,
        i_m_mid=1.0 / m_mid,
        W_load=h.load.W - W_mid,
        m_load=m_low,
        i_m_load=1.0 / m_low,
        b=h.load.b,
    )


def fastest_rates(packed: Packed) -> dict[str, float]:
    """Upper bounds of the fast modes that the twin does not have [1/s]; the others are those of
    `stillhook.engine.arguments`."""
    p = packed.params
    e, h, a, acc = p.extra, p.hoist, p.active, p.extra.passive.acc
    strain = 2.0 * (e.rope.W_mid + e.rope.W_load) / e.rope.EA
    k = 2.0 * e.rope.EA * (1.0 + 2.0 * e.rope.beta * strain + e.rope.strands) / (e.rope.L_0 + h.s_w_0)
    i_m = 2.0 * e.rope.i_m_mid + e.rope.i_m_load
    J = h.inertia.J_motor + h.inertia.J_gear + h.inertia.J_drum * h.inertia.i_i2
    return {
        "wire with its mass": e.rope.c * i_m + math.sqrt(k * i_m),
        "oil between both ends of a line": (
            math.sqrt(e.lines.i_I * (e.lines.i_C_p + e.lines.i_C_m)) + e.lines.R * e.lines.i_I
        ),
        "boost valve against the oil at the pumps": max(a.boost.G, a.relief.G, a.flushing.G) * e.lines.i_C_p,
        "motors against the oil at the motors": a.motors.count * a.motors.D_max * math.sqrt(2.0 * e.lines.i_C_m / J),
        "friction of the accumulator's piston": (
            e.passive.D_m**2 * (acc.p_dry * acc.i_Q_dry + acc.R + e.passive.R_lp) / J
        ),
        "strands of the wire": e.rope.i_tau,
        "lag of friction": e.friction.i_tau,
        "load cell's filter": e.i_tau_cell,
    }


def simulate_reference(
    crane: Crane,
    case: Scenario,
    reference: ReferenceCrane,
    *,
    step: str | None = None,
) -> xarray.Dataset:
    """Run the reference plant; the Dataset is that of `stillhook.engine.simulate.simulate` with a row every PLC cycle.

    step: by default SERIES_STEP, or shorter where the reference plant's fastest mode requires it.

    Errors: ScenarioError, SpecError (step too long; no passive circuit), SimulationError.
    """
    check(crane, case)
    packed, drive = pack_reference(crane, case, reference), CycleInputs(crane, case)
    n_sub = steps_per_cycle(crane, step, SERIES_STEP)
    name, rate = max(fastest_rates(packed).items(), key=lambda i: i[1])
    if step is None:
        n_sub = max(n_sub, math.ceil(rate * drive.t_cycle / RK4_LIMIT))
    h = drive.t_cycle / n_sub
    check_step(packed, h)
    if rate * h > RK4_LIMIT:
        raise SpecError(
            f"step {h * 1e3:.3g} ms is too long for this reference crane: {name} has {rate:.0f} 1/s (allowed"
            f" {RK4_LIMIT / h:.0f})."
        )
    block = ScenarioBlock([Ready(crane, case, packed, drive)], lanes=1, n_sub=n_sub, every=1)
    for _ in block.steps():
        pass
    runs = block.results()
    raise_failures([run.row for run in runs])
    return dataset_of(runs)
