"""What a crane that stands in for a measured one has beyond its crane file: the parameters of the truth plant, with
their sources."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

from stillhook.spec.crane import Source, SourceKind


def _assumed(value: float, meaning: str, source: str, quantity: str = "") -> Any:
    return field(default=value, metadata={"meaning": meaning, "source": source, "quantity": quantity})


_SCATTER = "assumed: such a number of a crane file is known to some per cent"
_DATASHEET = "assumed: tolerance of a data sheet"


@dataclass(frozen=True)
class ReferenceCrane:
    """A crane as it really is, against the crane file of its twin. Most numbers are factors over those of the twin; the
    defaults are a plausible crane. `numbers` lists them with meaning and source; every source is an assumption, because
    none is published.
    """

    capacitance: float = _assumed(1.0, "oil capacitance of each line, both ends together, over the twin's", _SCATTER)
    leakage: float = _assumed(
        1.0, "leak conductance of active pumps and motors over the twin's, on the mean of the tests", _SCATTER
    )
    inertia: float = _assumed(1.0, "all inertia at the motor shaft over the twin's", _SCATTER)
    friction: float = _assumed(
        1.0, "friction over that with the twin's mean", "assumed: 1 is a crane whose friction was identified well"
    )
    gear: float = _assumed(1.0, "gear ratio motor to drum over the twin's", "assumed: a gear is what its drawing says")
    wire_short: float = _assumed(
        0.0, "wire on the drum less than the twin's", "assumed: 0 m is a drum as in the crane file", "length"
    )
    K_1: float = _assumed(
        1.0, "speed feedforward of the PLC over the twin's", "assumed: 1 is a twin with the PLC's own settings"
    )
    pump_limit: float = _assumed(1.0, "pump command at which the PLC holds it", "assumed: 1 is the twin's")
    motor_offset: float = _assumed(
        0.0, "displacement of the active motors above their command, part of D_max", "assumed: closed loop"
    )
    motor_hysteresis: float = _assumed(
        0.01, "full width of the motors' hysteresis, part of D_max", "assumed: well-adjusted closed loop"
    )
    motor_omega: float = _assumed(
        0.96, "natural frequency of the motors' servo over the twin's", "assumed: paper F has 0.7 to 3.5 s"
    )
    motor_zeta: float = _assumed(1.05, "its damping ratio over the twin's", "assumed: as its frequency")
    motor_D: float = _assumed(1.002, "full displacement of the active motors over the twin's", _DATASHEET)
    pump_omega: float = _assumed(
        1.04, "natural frequency of the pumps' servo over the twin's", "assumed: sizes differ a little"
    )
    pump_zeta: float = _assumed(0.95, "its damping ratio over the twin's", "assumed: sizes differ a little")
    pump_late: float = _assumed(
        4e-3, "dead time of the pumps' servo, within one PLC cycle", "assumed: pilot valve and bus", "time"
    )
    pump_speed: float = _assumed(
        1.002, "pump speed without load over the twin's", "assumed: slip of the electric motors"
    )
    slip: float = _assumed(
        0.01, "part by which the pumps slow at full flow and 250 bar", "assumed: about 1 % is typical"
    )
    line_split: float = _assumed(0.45, "part of a line's capacitance at the pumps", "assumed")
    line_omega: float = _assumed(
        190.0, "frequency of the oil between both ends of a line", "assumed: 20 m of pipe", "frequency"
    )
    line_drop: float = _assumed(
        1.5e5, "pressure drop of each line at full pump flow", "assumed: sized for few losses", "pressure"
    )
    passive: float = _assumed(1.003, "displacement of the passive motors over nominal", _DATASHEET)
    active_more: float = _assumed(
        0.0, "active motors more than in the crane file", "assumed: 0 is a file with the crane's motors"
    )
    passive_more: float = _assumed(
        0.0, "passive motors more than in the crane file", "assumed: 0 is a file with the crane's motors"
    )
    passive_dead: float = _assumed(
        0.0, "passive motors that take no oil and give no torque, unknown to the PLC", "assumed: all work"
    )
    precharge: float = _assumed(1.0, "pressure at mid stroke over the twin's; the PLC holds it", _SCATTER)
    gas_volume: float = _assumed(
        1.0, "gas over what has the twin's stiffness at GAS_PERIOD", "assumed: a file whose gas fits its log"
    )
    gas_T: float = _assumed(293.15, "temperature of the gas vessels [K]", "assumed: on deck")
    gas_tau: float = _assumed(
        120.0, "time in which the gas takes their temperature", "assumed: minutes, Otis and Pourmovahed 1985", "time"
    )
    piston_dry: float = _assumed(
        2e5, "dry friction of the piston's seals as pressure", "assumed: 1 to 3 bar", "pressure"
    )
    piston_oil: float = _assumed(
        1.0, "viscous friction of the piston over the twin's", "assumed: nothing is known of it"
    )
    p_low: float = _assumed(1.0, "low side at rest over the twin's", "assumed: setting of a valve")
    p_low_rise: float = _assumed(
        1e5, "rise of the low side with 3000 L/min into it", "assumed: coolers and valves", "pressure"
    )
    boost: float = _assumed(
        1.0, "boost pressure over the twin's; flushing opens as far above it", "assumed: setting of a valve"
    )
    leak_stroke: float = _assumed(
        0.1, "part of the pumps' leak that goes with their stroke", "assumed: 5 to 15 %, 10 by thesis table 2.6"
    )
    leak_speed: float = _assumed(
        0.1, "part of the motors' leak that goes with their speed", "assumed: 5 to 15 %, 10 by thesis eq. 2.18"
    )
    leak_edges: float = _assumed(
        0.05, "part of all leaks that goes with the root of the pressure", "assumed: valve plates have edges"
    )
    leak_across: float = _assumed(
        0.66, "share of a leak that goes from port to port", "assumed: two thirds in the thesis"
    )
    p_case: float = _assumed(1e5, "pressure in the housings", "assumed: 0 to 2 bar", "pressure")
    all_constant: float = _assumed(
        0.0, "part of the file's C_leak that is there at any stroke and speed", "assumed: none"
    )
    all_stroke: float = _assumed(0.0, "part of it that goes with the pumps' stroke", "assumed: none")
    all_speed: float = _assumed(0.0, "part of it that goes with the motors' speed", "assumed: none")
    tau_cell: float = _assumed(0.1, "time constant of the load cell's filter", "assumed: typical of load pins", "time")
    cell_gain: float = _assumed(1.002, "load cell over the true tension", "assumed: class of a load pin")
    cell_zero: float = _assumed(1e3, "what the load cell shows without load", "assumed: class of a load pin", "force")
    dac_bits: float = _assumed(12.0, "bits of the PLC's outputs, from -1 to 1", "assumed: 12 to 14 are typical")
    wire_beta: float = _assumed(
        25.0, "rise of the wire's stiffness with its strain", "assumed: 2 to 8 % from an empty hook to the SWL"
    )
    wire_strands: float = _assumed(
        0.01, "share of stiffness that strands carry until they slid", "assumed: 1 % of loss at the first swing"
    )
    wire_pressed: float = _assumed(
        0.01, "part by which wire on the drum is pressed flat", "assumed: 0 to 1.5 % of a layer"
    )
    wire_zeta: float = _assumed(
        0.5, "damping of the wire over the twin's", "assumed: 0.95 of paper C is high for steel"
    )
    wire_mass: float = _assumed(
        0.3, "most of the moving mass that is lumped in the wire's middle", "assumed: else half of the wire"
    )
    bristle: float = _assumed(0.7, "presliding stiffness over the twin's", "assumed: nothing is known of it")
    friction_difference: float = _assumed(
        0.08, "rms of the relative difference of friction from the twin's", "assumed: 5 to 15 %"
    )
    shape_stribeck: float = _assumed(0.7, "how the Stribeck part takes part in that difference, -1 to 1", "assumed")
    shape_load: float = _assumed(-0.4, "how the part that goes with the load does", "assumed")
    shape_viscous: float = _assumed(0.5, "how the viscous part does", "assumed")
    uneven: float = _assumed(
        0.03, "part by which hoisting has more and lowering less Coulomb friction", "assumed: sheaves and gear flanks"
    )
    stribeck: float = _assumed(
        1.5, "speed of the Gaussian Stribeck curve over that of the twin's exponential", "assumed"
    )
    friction_lag: float = _assumed(
        0.03, "time by which dry friction lags", "assumed: tens of milliseconds are typical", "time"
    )
    oil_swing: float = _assumed(
        2.0, "amplitude of the oil's temperature about nominal [K]", "assumed: temperature control"
    )
    oil_phase: float = _assumed(
        0.0, "its phase at the start [rad]; one swing lasts as long as the run", "assumed: mean is nominal"
    )
    oil_thin: float = _assumed(
        0.03, "fall of viscosity, and so of viscous losses, per kelvin", "assumed: HLP 46 at 40 degC, some 4 %"
    )


GAS_PERIOD = 10.0
"""Period at which `gas_volume` 1 has the twin's stiffness [s]: that of the tests' seas."""


class Number(NamedTuple):
    """One parameter of the truth: name, value in SI, meaning, kind of quantity ("" for factors), source."""

    name: str
    value: float
    meaning: str
    quantity: str
    source: Source


def numbers(reference: ReferenceCrane) -> Iterator[Number]:
    """Every parameter of the truth plant with its source."""
    for f in fields(reference):
        m = f.metadata
        yield Number(
            f.name,
            getattr(reference, f.name),
            m["meaning"],
            m["quantity"],
            Source(text=m["source"], kind=SourceKind.ASSUMED),
        )
