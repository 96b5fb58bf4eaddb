"""Failures of the winch that a plan is run with: what is at fault from one moment on, and on which winches."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from stillhook.library.crane_file import changed
from stillhook.spec.crane import Crane
from stillhook.spec.lift.phase import WinchMode
from stillhook.spec.scenario import Sensors
from stillhook.spec.sensors import TABLES
from stillhook.units import show

LASTS = 3600.0
"""How long a sensor stays at fault [s]: longer than any run."""
DRIFT = 18.0
"""Drift of the motion unit's position [m in an hour]: 0.3 m in a minute. Assumed."""
OVERREAD = 1.5
"""What a load cell reads that reads too much, over the weight of the SWL. Assumed."""
BOTTLES = 4
"""Equal gas bottles of a passive circuit, of which one is lost. Assumed: crane files give the volume of all of them;
fewer bottles are the safe side."""
MOTION_UNIT = ("s_tip", "v_tip", "a_tip")
GAS = ("passive.accumulator.gas.V_0", "cylinder.passive.accumulator.gas.V_0", "secondary.accumulator.gas.V_0")
"""Where a crane file has the gas that carries the load."""

Faults = Mapping[str, Mapping[str, Any]]
"""Quantity -> what its table of sensors has besides, as text."""


class Failure(NamedTuple):
    """A failure. mode: of the winch from then on, None where its programme goes on; faults: of sensors that begin at a
    time [s]; of_crane: the crane with it, None on which there can be no such failure; only_compensated: whether it says
    something of phases in which the winch follows the tip alone."""

    key: str
    title: str
    mode: WinchMode | None = None
    faults: Callable[[Crane, float], Faults] | None = None
    of_crane: Callable[[Crane], Crane | None] | None = None
    only_compensated: bool = True

    @property
    def stands(self) -> bool:
        """Whether the winch stands afterwards."""
        return self.mode is not None

    def sensors(self, crane: Crane, sensors: Sensors, t: float) -> Sensors:
        """Sensors of a plan with the fault from t on [s]."""
        return sensors if self.faults is None else at_fault(sensors, self.faults(crane, t))


def at_fault(sensors: Sensors, faults: Faults) -> Sensors:
    """Sensors with more in the tables of some quantities. The noise and steps that a quantity has outside of its table
    go into it, as a table has all of them."""
    changes: dict[str, Any] = {}
    for quantity, more in faults.items():
        table, fault = TABLES[quantity]
        before = sensors.errors(quantity) or table()
        loose = {part: getattr(sensors, f"{part}_{quantity}", 0.0) for part in ("noise", "step")}
        changes |= {f"{part}_{quantity}": 0.0 for part in loose if hasattr(sensors, f"{part}_{quantity}")}
        update: dict[str, Any] = {part: value for part, value in loose.items() if value}
        update |= {name: value for name, value in more.items() if name != "fault"}
        if "fault" in more:
            update["faults"] = (*before.faults[:MOST_BEFORE], fault(**more["fault"]))
        changes[quantity] = before.model_copy(update=update)
    return sensors.model_copy(update=changes)


MOST_BEFORE = 3
"""Faults of a plan's own that a table keeps beside that of a failure: a sensor has four at the most."""


def _lasting(t: float, **more: Any) -> dict[str, Any]:
    return {"time": f"{t!r} s", "until": f"{t + LASTS!r} s", **more}


def _frozen(crane: Crane, t: float) -> Faults:
    return {quantity: {"fault": _lasting(t, kind="frozen")} for quantity in MOTION_UNIT}


def _drifting(crane: Crane, t: float) -> Faults:
    return {quantity: {"drift": DRIFT if quantity == "s_tip" else 0.0} for quantity in MOTION_UNIT}


def _zero(crane: Crane, t: float) -> Faults:
    return {"F": {"fault": _lasting(t, kind="value", value="0 N")}}


def _over(crane: Crane, t: float) -> Faults:
    return {"F": {"fault": _lasting(t, kind="value", value=f"{OVERREAD * crane.SWL * 9.80665!r} N")}}


def less_gas(crane: Crane) -> Crane | None:
    """The crane without one of its gas bottles; None where no gas carries the load."""
    for path in GAS:
        part: Any = crane
        for name in path.split("."):
            part = getattr(part, name, None)
        if part is not None:
            text: Any = show((1.0 - 1.0 / BOTTLES) * part, "volume", 12)
            for name in reversed(path.split(".")):
                text = {name: text}
            return changed(crane, text)
    return None


AHC_TRIP, BLACKOUT = "ahc-trip", "blackout"
FAILURES = (
    Failure(AHC_TRIP, "AHC trips to the brake", WinchMode.STOP),
    Failure(BLACKOUT, "Blackout, or an emergency stop", WinchMode.BLACKOUT, only_compensated=False),
    Failure("manual-override", "AHC switched off manually", WinchMode.MANUAL),
    Failure("motion-frozen", "Motion unit frozen", faults=_frozen),
    Failure("motion-drift", "Motion unit drifting", faults=_drifting),
    Failure("load-cell-zero", "Load cell reads zero", faults=_zero),
    Failure("load-cell-over", "Load cell reads too much", faults=_over),
    Failure("gas-bottle", "Gas bottle lost", of_crane=less_gas),
)
"""In the order of the report."""
