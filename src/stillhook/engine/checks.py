"""What can be said before a run: refusals (ScenarioError) and limits that the run will meet (notes)."""

import math

from stillhook.control.plc import Sensed, motor_demand
from stillhook.crane import Crane, Plant
from stillhook.engine.pack import MODE_CODE, drum_record, load_record, motor_speed_max, plc_record, wire_speed_max
from stillhook.errors import ScenarioError
from stillhook.physics.drum import layer_diameter, layers_filled
from stillhook.scenario import Scenario
from stillhook.units import show

LAST_TURNS = 3.0
"""Turns of wire that must stay on the drum (usual practice)."""


def check(crane: Crane, case: Scenario) -> None:
    """Refuse what no crane of this kind can be asked. Errors: ScenarioError, one line."""
    _check_load(crane, case)
    wire = drum_record(crane).L_full - LAST_TURNS * math.pi * crane.drum.d
    if case.s_w > wire:
        raise ScenarioError(
            f's_w {show(case.s_w, "length")} is more than the {show(wire, "length")} of wire that "{crane.name}" can pay out '
            f"(drum full, {LAST_TURNS:.0f} turns kept). Lower s_w or choose another crane."
        )
    loss = case.power_loss
    if loss is not None and loss.unit > len(crane.active.pump.D):
        raise ScenarioError(
            f'power_loss.unit {loss.unit}: "{crane.name}" has {len(crane.active.pump.D)} hydraulic power units. '
            f"Give 1 to {len(crane.active.pump.D)}."
        )
    if loss is not None and len(crane.active.pump.D) == 1:
        raise ScenarioError(f'power_loss: "{crane.name}" has a single hydraulic power unit; nothing would be left to hold the load.')


def _check_load(crane: Crane, case: Scenario) -> None:
    if case.load > crane.SWL:
        raise ScenarioError(
            f'Load {show(case.load, "mass")} exceeds the SWL {show(crane.SWL, "mass")} of "{crane.name}" '
            f"({100.0 * case.load / crane.SWL:.0f} %). Lower the load or choose another crane."
        )
    load = load_record(crane, case)
    if load.W <= 0.0:
        raise ScenarioError(
            f"The payload floats: {show(case.load, 'mass')} in air displaces {case.water.volume:g} m^3 of water. "  # type: ignore[union-attr]
            "Lower water.volume or raise the load."
        )


def layer_diameter_at(crane: Crane, s_w: float) -> float:
    """Diameter of the wire centre on the layer in use with s_w paid out [m]."""
    drum = drum_record(crane)
    return float(layer_diameter(layers_filled(drum.L_full - s_w, drum), drum))


def notes(crane: Crane, case: Scenario, v_tip_max: float, s_tip_pp: float) -> list[str]:
    """Limits that this run will meet, one line each, worst first; v_tip_max [m/s] and s_tip_pp [m] are the motion's own."""
    d = layer_diameter_at(crane, case.s_w)
    K_wire = crane.drum.d_max / d
    alpha = alpha_wanted(crane, case, K_wire, 1.0)
    out = []
    v_max = wire_speed_max(crane, alpha, d)
    if v_tip_max > v_max:
        out.append(
            f"tip speed {show(v_tip_max, 'speed')} is above the {show(v_max, 'speed')} that {case.mode.value} reaches at this load "
            f"and layer (motors at {alpha:.2f}): the pumps will saturate"
        )
    limit = min(crane.active.motor.n_max_full / alpha, crane.active.motor.n_max)
    omega = min(v_tip_max / (0.5 * d / crane.i_hD), motor_speed_max(crane, alpha))
    if omega > limit:
        out.append(f"motors would turn {show(omega, 'rotation')}, above their limit {show(limit, 'rotation')} at this displacement")
    out += _stroke_notes(crane, case, s_tip_pp)
    out += _pure_active_notes(crane, case, d, alpha_wanted(crane, case, K_wire, 0.0))
    return out


def alpha_wanted(crane: Crane, case: Scenario, K_wire: float, u_ff: float) -> float:
    """Displacement that the PLC asks for in this mode at this load [-]; u_ff 0 at rest, 1 at full speed."""
    F = load_record(crane, case).W
    code = MODE_CODE[case.mode]
    y = Sensed(0.0, 0.0, 0.0, 0.0, 0.0, code, 1.0, case.s_w, F, 1.0, K_wire)
    return float(motor_demand(y, u_ff, F, plc_record(crane)))


def _stroke_notes(crane: Crane, case: Scenario, s_tip_pp: float) -> list[str]:
    """The passive circuit moves W s_tip_pp / dp of oil, whatever its gear and displacement: work is pressure times volume."""
    if crane.passive is None:
        return []
    acc = crane.passive.accumulator
    V = load_record(crane, case).W * s_tip_pp / (acc.gas.p_0 - crane.passive.p_lp)
    if V <= acc.V_stroke:
        return []
    return [
        f"compensating {show(s_tip_pp, 'length')} at this load moves about {show(V, 'volume')} of oil, more than the accumulator's "
        f"stroke of {show(acc.V_stroke, 'volume')}: the piston will run into its ends"
    ]


def _pure_active_notes(crane: Crane, case: Scenario, d: float, alpha: float) -> list[str]:
    if crane.plant is not Plant.PURE_ACTIVE:
        return []
    lever, D = 0.5 * d / crane.i_hD, crane.active.motor.D_total * alpha
    dp = load_record(crane, case).W * lever / D
    Q_leak = crane.active.C_leak * dp
    e_c = Q_leak / (crane.active.pump.D_total * crane.active.pump.omega_p) / max(crane.control.K_p, 1e-12)
    out = [f"the load is held by the pumps against leakage: under P control expect a standing offset of about {show(e_c, 'length')}"]
    relief = crane.active.relief.p - crane.active.boost.p
    if dp > relief:
        out.insert(
            0,
            f"holding the load takes {show(dp, 'pressure')} with the motors at {alpha:.2f}, more than the {show(relief, 'pressure')} "
            "up to the relief valves: the load will sink",
        )
    return out
