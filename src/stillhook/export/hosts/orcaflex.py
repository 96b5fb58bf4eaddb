"""An external function for a winch of OrcaFlex, in Python: the rate of pay-out of a winch that Stillhook calculates.

OrcaFlex has wire, load, vessel and sea. At every time it requests the rate at which the winch pays out, and this class
reads the winch's tension and the motion of the crane tip in the model and answers. Written from the public help of
OrcFxAPI (Orcina, "Python external functions" and "Native external functions"); docs/how-to/use-in-orcaflex says what
was not tried.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stillhook import units
from stillhook.errors import SimulationError
from stillhook.export.hosts.exchange import Exchange, Sample
from stillhook.library import load_crane
from stillhook.sea.motion.text import motion_from_dict
from stillhook.sea.vessel.vessel_tip import VesselTip
from stillhook.spec.scenario import Scenario

INSTANT = 32005
"""Period of the present value: pnInstantaneousValue of OrcFxAPI."""
RESULTS: Mapping[str, tuple[str, ...]] = {
    "TensionResult": ("Tension",),
    "PositionResult": ("Z",),
    "SpeedResult": ("GZ velocity", "GZ-Velocity"),
    "AccelerationResult": ("GZ acceleration", "GZ-Acceleration"),
}
"""Results that are read, by the parameter that names another, with the names that versions of OrcaFlex gave them."""
DATA_NAMES = ("WholeSimulationPayoutRate", "StageValue", "PayoutRate")
"""Beginnings of names of data items whose value is a rate of pay-out."""
PARAMETERS = ("TipObject", "TipPosition", "WireOut", "Mode", "OperatorSpeed", *RESULTS)


class Winch:
    """External function for the pay-out rate of a winch. A module for OrcaFlex names crane and case::

        from stillhook.export.hosts.orcaflex import Winch

        class StillhookWinch(Winch):
            crane = "nov-250t"
            case = {"load": "100 t", "s_w": "100 m", "mode": "ssc"}

    Parameters, from the object's tags or its external function parameters (lines of NAME=value), in the model's units:
    TipObject, the object that the crane tip is fixed to; TipPosition, "x, y, z" of the tip on it; WireOut, wire paid
    out at the start (default the case's); Mode; OperatorSpeed, hoisting positive; TensionResult, PositionResult,
    SpeedResult, AccelerationResult, names of results. What is raised stops OrcaFlex, which shows the line.

    A case with a boom (tip, as its `to_dict`): the PLC makes the tip's motion from what its motion unit feels of the
    object and from the boom's angles.

    Signs: tip up positive; pay-out rate positive where wire goes out.
    """

    crane: str | Path = ""
    case: Mapping[str, Any] = {}
    tip: Mapping[str, Any] = {}

    def Initialise(self, info: Any) -> None:
        """Read parameters, units and a stored state."""
        if not str(info.DataName).startswith(DATA_NAMES):
            raise SimulationError(
                f"StillhookWinch gives a rate of pay-out, and OrcaFlex requested {units.quote(str(info.DataName))}."
                " Choose it for the winch's pay-out rate."
            )
        given = _parameters(info)
        self._force, self._length = _factors(info)
        self._winch = info.ModelObject
        if "tipobject" not in given:
            raise SimulationError("TipObject is missing. Name the object that the crane tip is fixed to.")
        self._tip = info.Model[given["tipobject"]]
        self._place = _numbers("TipPosition", given.get("tipposition", "0, 0, 0"), 3)
        self._names = {name: given.get(name.lower()) for name in RESULTS}
        values = dict(self.case) | ({"tip": motion_from_dict(self.tip)} if self.tip else {})
        if "wireout" in given:
            values["s_w"] = f"{_numbers('WireOut', given['wireout'], 1)[0] / self._length!r} m"
        if "mode" in given:
            values["mode"] = given["mode"]
        v_op = _numbers("OperatorSpeed", given.get("operatorspeed", "0"), 1)[0] / self._length
        self._exchange = Exchange(load_crane(self.crane), Scenario(**values), v_op=v_op)
        if getattr(info, "StateData", None):
            self._exchange.restore(info.StateData)
        else:
            info.Value = 0.0

    def Calculate(self, info: Any) -> None:
        """Put the rate of pay-out at the present time into info.Value."""
        time, F_w = float(info.SimulationTime), 1000.0 * self._read(self._winch, "TensionResult") / self._force
        tip = self._exchange.case.tip
        if isinstance(tip, VesselTip):
            lever = self._length * (np.array(tip.boom.tip) - tip.unit.at)
            points = self._place - lever + self._length * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
            sample = self._exchange.of_heights(time, F_w, np.array([self._heights(point) for point in points]))
        else:
            sample = Sample(time, F_w, *self._heights(self._place))
        info.Value = self._exchange.at(sample, new_step=bool(info.NewTimeStep)).payout * self._length

    def StoreState(self, info: Any) -> None:
        """Put the state into the simulation file."""
        info.StateData = self._exchange.save()

    def _heights(self, place: Sequence[float]) -> list[float]:
        """Height, speed and acceleration of a place on the tip's object [m, m/s, m/s^2]."""
        names = ("PositionResult", "SpeedResult", "AccelerationResult")
        return [self._read(self._tip, name, place) / self._length for name in names]

    def _read(self, thing: Any, parameter: str, place: Sequence[float] | None = None) -> float:
        """A result at the present time, in the model's units."""
        api = _api()
        extra = api.ObjectExtra()
        if place is not None:
            extra.RigidBodyPos = tuple(float(x) for x in place)
        named = self._names[parameter]
        problem: Exception | None = None
        for name in (named,) if named else RESULTS[parameter]:
            try:
                value = float(thing.TimeHistory(name, api.Period(INSTANT), extra)[0])
            except Exception as e:  # OrcFxAPI says in words of its own that there is no such result
                problem = e
                continue
            self._names[parameter] = name
            return value
        names = " nor ".join(units.quote(n) for n in ((named,) if named else RESULTS[parameter]))
        raise SimulationError(
            f'"{thing.Name}" has no result {names} ({problem}). Name it in the parameter {parameter}, as the results'
            " form of OrcaFlex shows it."
        )


def _api() -> Any:
    """The module of OrcaFlex, which is there where OrcaFlex runs this."""
    import OrcFxAPI  # type: ignore[import-not-found,unused-ignore]

    return OrcFxAPI


def _parameters(info: Any) -> dict[str, str]:
    """Parameters by their names in small letters; tags count over the text of external function parameters."""
    given: dict[str, str] = {}
    text = getattr(info, "ObjectParameters", None)
    if isinstance(text, Mapping):
        given |= {str(k).strip().lower(): str(v).strip() for k, v in text.items()}
    for line in str(text or "").splitlines() if not isinstance(text, Mapping) else ():
        name, equals, value = line.split("//")[0].partition("=")
        if equals:
            given[name.strip().lower()] = value.strip()
    tags = getattr(info.ModelObject, "tags", None) or {}
    known = {name.lower() for name in PARAMETERS}
    given |= {str(k).lower(): str(tags[k]).strip() for k in tags if str(k).lower() in known}
    return {name: value for name, value in given.items() if value}


def _factors(info: Any) -> tuple[float, float]:
    """The model's units of force and length in kN and m: what a number of those is multiplied by."""
    factor = getattr(info.ModelObject, "UnitsConversionFactor", None)
    if factor is not None:
        return float(factor("FF")), float(factor("LL"))
    system = str(getattr(info.Model.general, "UnitsSystem", "SI"))
    if system.upper() != "SI":
        raise SimulationError(
            f"Units system {units.quote(system)}: this version of OrcaFlex does not say what its units are. Choose SI."
        )
    return 1.0, 1.0


def _numbers(name: str, text: str, count: int) -> list[float]:
    """Numbers of a parameter. Errors: SimulationError."""
    try:
        found = [float(x) for x in text.replace(",", " ").split()]
        if len(found) != count:
            raise ValueError
    except ValueError:
        need = "one number" if count == 1 else f"{count} numbers"
        raise SimulationError(f"{name} = {units.quote(text)}: give {need} in the model's units.") from None
    return found
