"""Where the energy of a run comes from and where it goes, out of the powers that its audit adds up."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.scenario.summary import ScenarioRun
from stillhook.report.formatting import HOUR
from stillhook.winches.registry import WinchType

ROUNDING = 1e-12
"""Part of the supply's energy, both directions added up, that is nothing from rounding [-]."""
SUPPLY = ("P_el", "P_hpu")
"""Signals with the power of what feeds a drive: of the grid, of the hydraulic power units."""


class Energies(NamedTuple):
    """Energies per hour [J]: drawn from what feeds the drive, returned to it, net; supplied: each power that goes in,
    the crane tip's among them; lost: each that goes out, the change of gas and stores that is counted as power among
    them; stored: change of the other stores."""

    drawn: float
    returned: float
    net: float
    supplied: Mapping[str, float]
    lost: Mapping[str, float]
    stored: float

    @property
    def unaccounted(self) -> float:
        """What goes in less what goes out and less the change of the stores, over all of them without signs [-]."""
        flows = [*self.supplied.values(), *self.lost.values(), self.stored]
        missing = sum(self.supplied.values()) - sum(self.lost.values()) - self.stored
        return missing / max(sum(abs(x) for x in flows), 1.0)


def per_hour(result: ScenarioRun) -> float:
    """What a sum of powers over the counted cycles of a run is multiplied with to be an energy per hour [s]."""
    return HOUR / max(float(result.stats.common.cycles) - 1.0, 1.0)


def net_energy(winch: WinchType, result: ScenarioRun) -> float:
    """Energy per hour from what feeds the drive [J]."""
    power = result.stats.power._asdict()
    return per_hour(result) * sum(float(power[name]) for name in fed(winch))


def fed(winch: WinchType) -> tuple[str, ...]:
    """Powers from outside the winch, without that of the crane tip."""
    within = getattr(winch.module, "WITHIN", ())
    return tuple(name for name in winch.module.SUPPLIED if name not in within)


def energies(winch: WinchType, result: ScenarioRun) -> Energies:
    """Energies of a run with its series at every PLC cycle.

    What is drawn and what is returned are the positive and the negative part of the supply's power at PLC cycles. The
    power units' signal is that of the pumps; boost and make-up, which have no signal and only give, are added whole.
    """
    hour, power, module = per_hour(result), result.stats.power._asdict(), winch.module
    within, feeds = getattr(module, "WITHIN", ()), fed(winch)
    given = (*feeds, *module.PATH.SUPPLIED)
    net = hour * sum(power[name] for name in feeds)
    positive, negative = (hour * part for part in _parts(supply(winch, result)))
    others = net - (positive + negative)
    others = 0.0 if abs(others) < ROUNDING * (positive - negative) else others
    common = result.stats.common
    return Energies(
        drawn=positive + max(others, 0.0),
        returned=0.0 - negative - min(others, 0.0),
        net=net,
        supplied={name: hour * power[name] for name in given},
        lost={name: hour * x for name, x in power.items() if name not in given and name not in within},
        stored=hour * (common.E_end - common.E_start) / result.t_cycle,
    )


def supply(winch: WinchType, result: ScenarioRun) -> FloatArray:
    """Power of the supply over the counted part of a run, a sample each PLC cycle [W]; empty where the type has no such
    signal."""
    names = {row.name for row in winch.rows}
    signal = next((name for name in SUPPLY if name in names), None)
    if signal is None or result.series is None:
        return np.empty(0)
    return result.column(signal)[round(result.warm_up / result.dt) :]


def _parts(P: FloatArray) -> tuple[float, float]:
    """Trapezoidal sums of the positive and of the negative part of samples."""
    if len(P) < 2:
        return 0.0, 0.0
    weights = np.ones(len(P))
    weights[[0, -1]] = 0.5
    return float(weights @ np.maximum(P, 0.0)), float(weights @ np.minimum(P, 0.0))
