"""Parameters of a crane implied by its logs: every check of step 1 on the parts of the records."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from stillhook.base.progress import Meter
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.parameters.circuit.flow import (
    Balance,
    Pressures,
    Rests,
    balance,
    passive_pressure,
    pressures,
    rests,
)
from stillhook.validate.parameters.circuit.settings import Offset, PumpSetting, motor_offset, pump_setting
from stillhook.validate.parameters.hoisting import Cell, EffectiveRadius, Friction, cells, effective_radii, frictions
from stillhook.validate.parameters.segments import LogPart
from stillhook.validate.parameters.signals import (
    Clock,
    Jump,
    Ratio,
    Reference,
    TipDelay,
    clock_of,
    largest_jump,
    ratios,
    references,
    tip_delays,
)


@dataclass(frozen=True)
class ParameterEstimates:
    """Results of every check; empty or None where the log has no data for it."""

    parts: tuple[LogPart, ...]
    ratios: Mapping[str, Ratio]
    clock: Clock
    jump: Jump | None
    radii: tuple[EffectiveRadius, ...]
    motor: Offset | None
    pump: PumpSetting | None
    balance: Balance | None
    cells: tuple[Cell, ...]
    frictions: tuple[Friction, ...]
    delays: tuple[TipDelay, ...]
    references: tuple[Reference, ...]
    pressures: tuple[Pressures, ...]
    p_hp: tuple[float, float] | None
    rests: Rests | None = None


def parameter_estimates(
    parts: Sequence[LogPart], progress: Callable[[float], None], records: Sequence[Record] = ()
) -> ParameterEstimates:
    """Take every check on the parts; the clock first, because lengths over speeds depend on it. records: for rests,
    which may be short."""
    meter = Meter(6.0, progress)
    parts = tuple(parts)
    rate_ratios = ratios(parts)
    clock, jump = clock_of(rate_ratios), largest_jump(parts, rate_ratios)
    drum = effective_radii(parts, clock.error.value if clock.error is not None else 0.0)
    meter.part(1.0)(1.0)
    motor, pump = motor_offset(parts), pump_setting(parts)
    meter.part(3.0)(1.0)
    flow, load, friction = balance(parts), cells(parts), frictions(parts)
    meter.part(1.0)(1.0)
    return ParameterEstimates(
        parts,
        rate_ratios,
        clock,
        jump,
        drum,
        motor,
        pump,
        flow,
        load,
        friction,
        tip_delays(parts),
        references(parts),
        pressures(parts),
        passive_pressure(parts),
        rests(parts[0].crane, records) if parts and records else None,
    )
