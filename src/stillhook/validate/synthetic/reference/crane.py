"""What a crane that stands in for a measured one has beyond its crane file: the parameters of the reference plant, with
their sources and the scatter between cranes in `crane.toml`."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.resources import files
from typing import NamedTuple

from stillhook.spec.crane import Source, SourceKind

PARAMETERS = tomllib.loads((files("stillhook.validate.synthetic.reference") / "crane.toml").read_text(encoding="utf-8"))
"""Rows of the parameters by name."""
GAS_PERIOD = 10.0
"""Period at which `gas_volume` 1 has the twin's stiffness [s]: that of the tests' seas."""


@dataclass(frozen=True)
class ReferenceCrane:
    """A crane as it really is, against the crane file of its twin. Most numbers are factors over those of the twin; the
    defaults are a plausible crane. `numbers` lists them with meaning and source; every source is an assumption, because
    none is published.
    """

    capacitance: float = 1.0
    leakage: float = 1.0
    inertia: float = 1.0
    friction: float = 1.0
    gear: float = 1.0
    wire_short: float = 0.0
    K_1: float = 1.0
    pump_limit: float = 1.0
    motor_offset: float = 0.0
    motor_hysteresis: float = 0.01
    motor_omega: float = 0.96
    motor_zeta: float = 1.05
    motor_D: float = 1.002
    pump_omega: float = 1.04
    pump_zeta: float = 0.95
    pump_late: float = 0.004
    pump_speed: float = 1.002
    slip: float = 0.01
    line_split: float = 0.45
    line_omega: float = 190.0
    line_drop: float = 150000.0
    passive: float = 1.003
    active_more: float = 0.0
    passive_more: float = 0.0
    passive_dead: float = 0.0
    precharge: float = 1.0
    gas_volume: float = 1.0
    gas_T: float = 293.15
    gas_tau: float = 120.0
    piston_dry: float = 200000.0
    piston_oil: float = 1.0
    p_low: float = 1.0
    p_low_rise: float = 100000.0
    boost: float = 1.0
    leak_stroke: float = 0.1
    leak_speed: float = 0.1
    leak_edges: float = 0.05
    leak_across: float = 0.66
    p_case: float = 100000.0
    all_constant: float = 0.0
    all_stroke: float = 0.0
    all_speed: float = 0.0
    tau_cell: float = 0.1
    cell_gain: float = 1.002
    cell_zero: float = 1000.0
    dac_bits: float = 12.0
    wire_beta: float = 25.0
    wire_strands: float = 0.01
    wire_pressed: float = 0.01
    wire_zeta: float = 0.5
    wire_mass: float = 0.3
    bristle: float = 0.7
    friction_difference: float = 0.08
    shape_stribeck: float = 0.7
    shape_load: float = -0.4
    shape_viscous: float = 0.5
    uneven: float = 0.03
    stribeck: float = 1.5
    friction_lag: float = 0.03
    oil_swing: float = 2.0
    oil_phase: float = 0.0
    oil_thin: float = 0.03


class Number(NamedTuple):
    """One parameter of the reference plant: name, value in SI, meaning, source."""

    name: str
    value: float
    meaning: str
    source: Source


def numbers(reference: ReferenceCrane) -> Iterator[Number]:
    """Every parameter of the reference plant with its source."""
    for name, value in vars(reference).items():
        row = PARAMETERS[name]
        yield Number(name, value, row["meaning"], Source(text=row["source"], kind=SourceKind.ASSUMED))
