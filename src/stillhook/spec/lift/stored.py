"""Lowerings as plain data, from which they run again: what cases share is written once."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from stillhook.base.arrays import ComplexArray, decode_array, encode_array
from stillhook.base.gateway.guard import reason_of
from stillhook.base.gateway.parse import from_json
from stillhook.control.registry import Mode
from stillhook.errors import LiftError, StillhookError, UnreadableError
from stillhook.sea.motion.motion import Still
from stillhook.sea.motion.text import motion_from_dict
from stillhook.sea.spectra.spectrum import Sea, Train
from stillhook.sea.spectra.text import spectrum_from_dict
from stillhook.sea.steady_flow import Current, FlowReference, FlowSense
from stillhook.sea.vessel.boom import TipPoint
from stillhook.sea.vessel.motion_unit import MotionUnit
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.realisation import Amplitudes, WaveField
from stillhook.sea.vessel.relative import OtherVessel
from stillhook.spec.lift.deck import Deck
from stillhook.spec.lift.lowering import DeepWire, InSea, Lowering, Rigging, WinchSettings
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase, PhaseKind, WinchMode
from stillhook.spec.scenario import FrictionModel, Sensors
from stillhook.tables.table import Source
from stillhook.units import stored_numbers
from stillhook.winches.load_path.registry import UNITS

LARGEST = 64e6
"""Numbers of water that are stored with a run at most [bytes]: an hour of a case's own water takes 12 MB. A table of
many seas names them by spectrum and seed (`InSea`), in some hundred bytes each."""


class Shared:
    """Objects that several cases share, each written once."""

    def __init__(self, write: Callable[[Any], Any]) -> None:
        self.write = write
        self.places: dict[int, int] = {}
        self.rows: list[Any] = []

    def place(self, thing: Any) -> int | None:
        if thing is None:
            return None
        if id(thing) not in self.places:
            self.places[id(thing)] = len(self.rows)
            self.rows.append(self.write(thing))
        return self.places[id(thing)]


def lowerings_text(cases: Sequence[Lowering | InSea]) -> str:
    """Cases as JSON text; "" where their own water is more than `LARGEST`."""
    fields = {id(w): w for c in cases if isinstance(c, Lowering) and (w := c.waves) is not None}
    if sum(w.eta.nbytes + w.eta_dot.nbytes + w.w.nbytes + w.a.nbytes for w in fields.values()) > LARGEST:
        return ""
    shared = {
        "lifts": Shared(_lift),
        "tips": Shared(lambda tip: tip.to_dict()),
        "waters": Shared(_water),
        "seas": Shared(_sea),
        "raos": Shared(_rao),
    }
    rows = []
    for case in cases:
        if isinstance(case, InSea):
            own: dict[str, Any] = {"seed": case.seed, "x": case.x, "y": case.y, "water": case.water, "left": case.left}
            own |= {"amplitudes": case.amplitudes.value, "repeat": case.repeat}
            if case.other is not None:
                other, at = case.other, case.other.at
                own["other"] = {"rao": shared["raos"].place(other.rao), "at": [at.x, at.y], "heading": other.heading}
                own["other"]["position"] = other.position
            own |= {} if case.unit is None else {"unit": case.unit.to_dict()}
            own |= {"sea": shared["seas"].place(case.sea), "rao": shared["raos"].place(case.rao)}
            rows.append({"lift": shared["lifts"].place(case.lift), "in_sea": own})
        else:
            moved = {"tip": shared["tips"].place(case.tip), "waves": shared["waters"].place(case.waves)}
            rows.append({"lift": shared["lifts"].place(case), **moved})
    return json.dumps({"cases": rows, **{name: each.rows for name, each in shared.items()}})


def stored_lowerings(text: str) -> list[Lowering | InSea]:
    """The cases that `lowerings_text` wrote. Errors: LiftError, one line, where the text is not one."""
    try:
        data = from_json(text)
        made: dict[str, list[Any]] = {
            "lifts": [_rebuilt(row) for row in data["lifts"]],
            "tips": [motion_from_dict(row) for row in data["tips"]],
            "waters": [_water_of(row) for row in data["waters"]],
            "seas": [Sea(tuple(_train(t) for t in row)) for row in data["seas"]],
            "raos": [_rao_of(row) for row in data["raos"]],
        }
        cases: list[Lowering | InSea] = []
        for row in data["cases"]:
            lift = made["lifts"][row["lift"]]
            if own := row.get("in_sea"):
                own["amplitudes"] = Amplitudes(own["amplitudes"])
                place = {"sea": made["seas"][own.pop("sea")], "rao": made["raos"][own.pop("rao")]}
                if of := own.pop("unit", None):
                    own["unit"] = MotionUnit.from_dict(of)
                if of := own.pop("other", None):
                    position = None if of["position"] is None else tuple(of["position"])
                    deck = made["raos"][of["rao"]], TipPoint(*of["at"]), of["heading"], position
                    own["other"] = OtherVessel(*deck)
                cases.append(InSea(lift, **place, **own))
            else:
                waves = None if row["waves"] is None else made["waters"][row["waves"]]
                cases.append(lift.model_copy(update={"tip": made["tips"][row["tip"]], "waves": waves}))
        if not cases:
            raise ValueError("no cases")
    except UnreadableError as problem:
        raise LiftError(f"stored lowerings: not JSON ({problem}). Run the lift again.") from None
    except StillhookError as problem:
        raise LiftError(f"stored lowerings: {problem}") from None
    except Exception as problem:  # KeyError where a part is missing, many others where one is odd
        reason = f"a part is missing or wrong, {reason_of(problem)}"
        raise LiftError(f"stored lowerings: {reason}. Run the lift again.") from None
    return cases


def _lift(case: Lowering) -> dict[str, Any]:
    plain = case.model_dump(mode="json", exclude={"tip", "waves", "payload"})
    plain = {key: value for key, value in plain.items() if value is not None or key not in ("deck", "current")}
    return {**plain, "payload": case.payload.to_dict()}


@stored_numbers()
def _rebuilt(row: Mapping[str, Any]) -> Lowering:
    raw = dict(row)
    raw["payload"] = Payload.from_dict(raw["payload"])
    raw["rigging"] = Rigging(**raw["rigging"])
    if raw["compensator"] is not None:
        own = dict(raw["compensator"])
        own["sources"] = {name: Source(**each) for name, each in own["sources"].items()}
        raw["compensator"] = UNITS[own["type"]].Unit(**own)
    if deck := raw.get("deck"):
        raw["deck"] = Deck(**{**deck, "motion": motion_from_dict(deck["motion"])})
    if current := raw.get("current"):
        profile = {key: tuple(current[key]) for key in ("depth", "speed", "direction")}
        sense = {"sense": FlowSense(current["sense"]), "reference": FlowReference(current["reference"])}
        raw["current"] = Current.model_construct(**current | profile | sense)
    raw["wire"] = DeepWire(**raw["wire"])
    if "z_0" in raw:  # of 0.10: heights
        raw["start_depth"] = 0.0 - raw.pop("z_0")
    raw["programme"] = tuple(_phase(phase) for phase in raw["programme"])
    raw["winch"] = WinchSettings(**raw["winch"])
    raw["controller"] = Mode(raw["controller"])
    raw["sensors"] = Sensors.from_dict(raw["sensors"])
    raw["friction"] = FrictionModel(raw["friction"])
    return Lowering(**raw, tip=Still(), waves=None)


def _phase(row: Mapping[str, Any]) -> Phase:
    """A stored phase; a stage of 0.10, which lowered at `lower`, held a tension `hold` and ended at one `tension`."""
    if "lower" in row:
        own = {key: row[key] for key in ("name", "time", "depth", "wire", "landed", "timeout")}
        row = {**own, "mode": row["mode"], "speed": row["lower"], "tension": row["hold"], "end_tension": row["tension"]}
    kind = None if row.get("kind") is None else PhaseKind(row["kind"])
    return Phase(**{**row, "kind": kind, "mode": WinchMode(row["mode"])})


def _water(field: WaveField) -> dict[str, Any]:
    columns = {name: encode_array(np.ravel(getattr(field, name))) for name in ("eta", "eta_dot", "w", "a")}
    return {"dt": field.dt, "z_0": field.z_0, "ds": field.ds, "source": field.source, **columns}


def _water_of(row: Mapping[str, Any]) -> WaveField:
    eta, eta_dot, w, a = (decode_array(row[name]) for name in ("eta", "eta_dot", "w", "a"))
    shape = (len(eta), -1)
    return WaveField(row["dt"], eta, eta_dot, w.reshape(shape), a.reshape(shape), row["z_0"], row["ds"], row["source"])


def _sea(sea: Sea) -> list[dict[str, Any]]:
    return [{"spectrum": t.spectrum.to_dict(), "beta": t.beta, "spread": t.spread} for t in sea.trains]


def _train(row: Mapping[str, Any]) -> Train:
    return Train(spectrum_from_dict(row["spectrum"]), row["beta"], row["spread"])


def _rao(rao: Rao) -> dict[str, Any]:
    columns = {"omega": rao.omega, "beta": rao.beta, "real": np.ravel(rao.H.real), "imaginary": np.ravel(rao.H.imag)}
    text = {"name": rao.name, "source": rao.source, "notes": list(rao.notes), "origin": rao.origin}
    depth = None if np.isinf(rao.depth) else rao.depth
    return {**text, "depth": depth, **{name: encode_array(column) for name, column in columns.items()}}


def _rao_of(row: Mapping[str, Any]) -> Rao:
    omega, beta, real, imaginary = (decode_array(row[name]) for name in ("omega", "beta", "real", "imaginary"))
    H: ComplexArray = np.empty((6, len(beta), len(omega)), dtype=np.complex128)
    H.real, H.imag = real.reshape(H.shape), imaginary.reshape(H.shape)
    depth = np.inf if row["depth"] is None else row["depth"]
    return Rao(row["name"], omega, beta, H, row["source"], tuple(row["notes"]), row["origin"], depth)
