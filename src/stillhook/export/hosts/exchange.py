"""A winch in a host whose steps are its own: PLC cycles run as the host's time passes them.

The host has wire, load and water. It gives, at its own times, the tension at the crane tip and the motion of the tip,
and gets the rate at which wire is paid out, and the wire out. A time may be asked as often as a host iterates: the
state is held at the last time that was accepted, and every answer starts from a copy of it.

PLC cycles are counted, from one sample to the next: a host that adds up its time, and whose sum is off by seconds after
years, has as many cycles as it made steps for.
"""

from __future__ import annotations

import base64
import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.gateway.parse import from_json
from stillhook.engine.saved import printable
from stillhook.engine.session import Kept, Session
from stillhook.errors import MotionError, SimulationError, UnreadableError
from stillhook.physics.scalar import G
from stillhook.physics.tip_kinematics import Jet, cosine
from stillhook.physics.tip_kinematics import between as quintic
from stillhook.sea.motion.motion import Still
from stillhook.sea.vessel.vessel_tip import GIVEN, VesselTip
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

ROUNDING = 1e-6
"""Part of a PLC cycle by which a host's time may deviate from one and still be it."""
EPSILON = math.ulp(1.0)
FORMAT = "stillhook exchange 2"
MOST_CYCLES = 1_000_000
"""PLC cycles in one step of a host."""
LARGEST = 1e12
"""Largest number of a host [SI]."""


class Sample(NamedTuple):
    """What a host gives at a time [s], SI: tension at the crane tip [N]; position, speed and acceleration of the tip,
    up positive, from any datum [m, m/s, m/s^2]."""

    time: float
    F_w: float
    s_tip: float
    v_tip: float
    a_tip: float


class Answer(NamedTuple):
    """Rate at which wire is paid out, paid out positive [m/s], and wire out [m]."""

    payout: float
    s_w: float


@dataclass
class Mark:
    """A time of the host: sample; k PLC cycles that it has made, and part of the next [-]; kept state of the session
    after them."""

    sample: Sample
    k: int
    part: float
    kept: Kept


class Exchange:
    """A winch for a host, coupled by tension.

    Parameters: crane; case: wire out, mode and controllers with which it begins; its load follows from the first
    tension, its motion and water are the host's; v_op: speed of the operator, hoisting positive [m/s].

    At the first sample the winch is at rest under its tension, with a tip at rest. The PLC runs on its own grid of
    cycles from that time on. What it reads at a cycle is between two samples of the host: the tension on a line, the
    tip on a quintic through position, speed and acceleration of both. An answer between two cycles is on a line
    between the rates of both; the later one is tried with the tension and the acceleration of the present sample held,
    for less than one cycle, and thrown away.

    >>> import stillhook
    >>> crane = stillhook.load_crane("nov-250t")
    >>> case = stillhook.Scenario(load="100 t", s_w="100 m", mode="ssc")
    >>> exchange = Exchange(crane, case)
    >>> exchange.at(Sample(0.0, 1.01e6, 20.0, 0.0, 0.0), new_step=True)
    Answer(payout=0.0, s_w=100.0)
    >>> first = exchange.at(Sample(0.013, 1.02e6, 20.001, 0.1, 0.5), new_step=True)
    >>> first == exchange.at(Sample(0.013, 1.02e6, 20.001, 0.1, 0.5), new_step=False)
    True
    """

    def __init__(self, crane: Crane, case: Scenario, *, v_op: float = 0.0) -> None:
        self.crane, self.case, self.v_op = crane, case, v_op
        self._session: Session | None = None
        self._first: Sample
        self._accepted: Mark
        self._trial: Mark

    def sample(self, time: float, F_w: float, vessel: Mapping[str, float]) -> Sample:
        """What a host gives that has the vessel's motion, by names as in `Session.vessel_inputs`: the tip is the one
        that the PLC calculates, as the wire is the host's. Errors: SimulationError for what is not complete."""
        if not isinstance(self.case.tip, VesselTip):
            raise SimulationError(
                "The case's tip has no boom. Give a case with [scenario.tip] boom, or the tip's motion."
            )
        try:
            _, seen, _ = self.case.tip.of_inputs(vessel, time)
        except MotionError as problem:
            raise SimulationError(f"The host's motion of the vessel: {problem}") from None
        return Sample(time, F_w, *(x.item() for x in seen))

    def of_heights(self, time: float, F_w: float, z: FloatArray) -> Sample:
        """What a host gives of whose vessel the motion unit's place is known: rows of its height, and of those 1 m
        ahead and 1 m to port of it, each with rate and acceleration, from any datum."""
        pitch = _angle(z[1] - z[0])
        c = cosine(pitch)
        port = z[2] - z[0]
        q = port[0] / c.x
        q_v = (port[1] - q * c.v) / c.x
        roll = _angle((q, q_v, (port[2] - 2.0 * q_v * c.v - q * c.a) / c.x))
        jets = {"heave": z[0], "roll": roll, "pitch": pitch, "unit_heave": z[0]}
        return self.sample(
            time, F_w, {n: float(x) for name, jet in jets.items() for n, x in zip(GIVEN[name], jet, strict=True)}
        )

    def at(self, sample: Sample, *, new_step: bool) -> Answer:
        """The answer at a sample; new_step: the host began a new step, so that its last sample is accepted unless the
        time went back behind it.

        Errors: SimulationError, one line, for a sample that is not a number, and a time before the last accepted one.
        ScenarioError for a tension that the crane cannot hold at the start.
        """
        if not all(map(_possible, sample)):
            given = ", ".join(f"{name} = {printable(x)}" for name, x in sample._asdict().items())
            raise SimulationError(f"The host gave {given}. Give finite numbers, up to {LARGEST:g}.")
        sample = sample._replace(F_w=max(sample.F_w, 0.0))  # a wire cannot push
        t_cycle = self.crane.control.t_cycle
        room = t_cycle * rounding(sample.time, t_cycle)
        if self._session is None or sample.time <= self._first.time + room:
            return self._begin(sample)
        ahead_of_trial = new_step and self._accepted.sample.time < self._trial.sample.time < sample.time
        before = self._trial if ahead_of_trial else self._accepted
        if sample.time < before.sample.time - room:
            raise SimulationError(
                f"The host went back to {sample.time:.6g} s, before its last accepted step at "
                f"{before.sample.time:.6g} s. Restore the state that was stored with that time."
            )
        return self._advance(self._session, sample, before)

    def _begin(self, sample: Sample) -> Answer:
        session = self._standing(sample)
        self._session, self._first = session, sample
        self._accepted = self._trial = Mark(sample, 0, 0.0, session.keep())
        return _reading(session)

    def _standing(self, first: Sample) -> Session:
        """The winch standing under the first tension."""
        load = max(first.F_w / G - self.crane.hook_mass, 0.0)
        still = {"tip": Still()} if isinstance(self.case.tip, VesselTip) else {}
        case = self.case.model_copy(update={"load": load, "water": None, **still})
        return Session(self.crane, case, coupling="wire")

    def _advance(self, session: Session, sample: Sample, before: Mark) -> Answer:
        t_cycle = session.cycle
        k, part = counted(before, sample.time, t_cycle)
        if k - before.k > MOST_CYCLES:
            raise SimulationError(
                f"The host went ahead from {before.sample.time:.6g} s to {sample.time:.6g} s: give steps of at most"
                f" {MOST_CYCLES * t_cycle:g} s."
            )
        session.go_back(before.kept)
        start = before.sample._replace(time=before.part * t_cycle)  # times from the cycle before the last sample on
        end = sample._replace(time=(k - before.k + part) * t_cycle)
        for j in range(1, k - before.k + 1):
            session.step(self._inputs(between(start, end, j * t_cycle)))
        trial, now = Mark(sample, k, part, session.keep()), _reading(session)
        later = now
        if part > rounding(sample.time, t_cycle):
            session.step(self._inputs(ahead(end, (k - before.k + 1) * t_cycle)))
            later = _reading(session)
        self._accepted, self._trial = before, trial
        return now if later is now else inside(now, later, part, t_cycle)

    def _inputs(self, sample: Sample) -> dict[str, float]:
        return {
            "F_w": sample.F_w,
            "s_tip": sample.s_tip - self._first.s_tip,
            "v_tip": sample.v_tip,
            "a_tip": sample.a_tip,
            "v_op": self.v_op,
        }

    def save(self) -> str:
        """The state as text, after the last sample; "" before the first."""
        if self._session is None:
            return ""
        mark, now = self._trial, self._session.keep()
        self._session.go_back(mark.kept)
        state = base64.b85encode(self._session.save()).decode()
        self._session.go_back(now)
        data = {"first": self._first, "sample": mark.sample, "k": mark.k, "part": mark.part}
        return _sealed({**data, "v_op": self.v_op, "state": state})

    def restore(self, text: str) -> None:
        """Continue from what `save` gave. Errors: SimulationError, one line, where it is damaged, of another crane,
        case or version, or no such text; nothing is changed then."""
        data = _unsealed(text)
        try:
            first, sample = (Sample(*map(float, data[name])) for name in ("first", "sample"))
            k, part, v_op, state = data["k"], data["part"], data["v_op"], base64.b85decode(data["state"])
            good = type(k) is int and all(abs(x) <= LARGEST for x in (*first, *sample, part, v_op))
        except (ValueError, KeyError, TypeError, OverflowError):
            good = False
        if not good:
            raise SimulationError(f"The stored state lacks numbers that are needed. {AGAIN}")
        self._check(first, sample, k, part)
        session = self._standing(first)
        session.restore(state)
        if round(session.time / session.cycle) != k:
            raise SimulationError(f"The stored state is of {session.time:.9g} s, not of {k} cycles. {AGAIN}")
        self.v_op, self._first, self._session = v_op, first, session
        self._accepted = self._trial = Mark(sample, k, part, session.keep())

    def _check(self, first: Sample, sample: Sample, k: int, part: float) -> None:
        """Errors: SimulationError where a host cannot have been so."""
        t_cycle = self.crane.control.t_cycle
        apart = abs((sample.time - first.time) / t_cycle - k - part)
        allowed = ROUNDING + 1e-9 * k + 4.0 * EPSILON * (k + 2) * max(abs(sample.time), abs(first.time)) / t_cycle
        if not (-0.02 < part < 1.0 and k >= 0 and min(first.F_w, sample.F_w) >= 0.0 and apart <= allowed):
            raise SimulationError(
                f"The stored state has k = {printable(k)} and part {part:.6g} of a cycle from {first.time:.9g} s to"
                f" {sample.time:.9g} s, or a tension below 0. {AGAIN}"
            )


def _possible(x: Any) -> bool:
    return isinstance(x, int | float | np.integer | np.floating) and bool(-LARGEST <= x <= LARGEST)


def _angle(sine: Sequence[float]) -> Jet:
    """An angle by its sine, each with rate and acceleration."""
    s, v, a = sine
    c = math.sqrt(max(1.0 - s * s, 1e-9))
    return Jet(math.asin(max(min(s, 1.0), -1.0)), v / c, (a + s * (v / c) ** 2) / c)


AGAIN = "Start the simulation again."


def counted(before: Mark, time: float, t_cycle: float) -> tuple[int, float]:
    """PLC cycles that the host has made at a time [s], and part of the next, which may be below 0 by `rounding`: from
    those of the sample before. A step that is a whole number of cycles to the rounding of the host's times is one."""
    cycles = max(time - before.sample.time, 0.0) / t_cycle
    if abs(cycles - round(cycles)) <= 1e-9 + 2.0 * EPSILON * abs(time) / t_cycle:
        cycles = float(round(cycles))
    whole = math.floor(cycles)
    part = before.part + (cycles - whole)
    more = math.floor(part + rounding(time, t_cycle))
    return before.k + whole + more, part - more


def rounding(time: float, t_cycle: float) -> float:
    """Part of a PLC cycle by which a host's time [s] may deviate from one and still be it."""
    return ROUNDING + min(2.0 * EPSILON * abs(time) / t_cycle, 0.01)


def _sealed(data: dict[str, Any]) -> str:
    """Data as text with the SHA-256 of what it says."""
    return _envelope(json.dumps(data))


def _envelope(body: str) -> str:
    digest = hashlib.sha256(body.encode("utf-8", "replace")).hexdigest()
    return json.dumps({"format": FORMAT, "sha256": digest, "body": body})


def _unsealed(text: str) -> dict[str, Any]:
    """Errors: SimulationError, one line, for what is not such a text, of another format, or damaged."""
    try:
        data = from_json(text)
    except UnreadableError:
        data = None
    form, body = (data.get("format"), data.get("body")) if isinstance(data, dict) else (None, None)
    if form != FORMAT:
        raise SimulationError(
            f"The stored state is not one of Stillhook's, or of an older version: its format is {printable(form)}, not"
            f" {FORMAT}. {AGAIN}"
        )
    if not isinstance(body, str) or _envelope(body) != text:
        raise SimulationError(f"The stored state is damaged: its checksum is not that of its text. {AGAIN}")
    try:
        found = from_json(body)
    except UnreadableError:
        found = None
    if not isinstance(found, dict):
        raise SimulationError(f"The stored state is damaged: it is not JSON of names and values. {AGAIN}")
    return found


def _reading(session: Session) -> Answer:
    return Answer(0.0 - session.get("v_w"), session.get("s_w"))


def between(a: Sample, b: Sample, time: float) -> Sample:
    """The host's course at a time between two samples: tension on a line, tip on the quintic through both."""
    h = b.time - a.time
    if h <= 0.0:
        return b._replace(time=time)
    x = (time - a.time) / h
    tip = quintic(Jet(*a[2:]), Jet(*b[2:]), h, x)
    return Sample(time, a.F_w + x * (b.F_w - a.F_w), *tip)


def ahead(a: Sample, time: float) -> Sample:
    """The host's course a part of a cycle ahead: tension and acceleration of the tip held."""
    h = time - a.time
    return Sample(time, a.F_w, a.s_tip + h * (a.v_tip + 0.5 * h * a.a_tip), a.v_tip + h * a.a_tip, a.a_tip)


def inside(a: Answer, b: Answer, x: float, h: float) -> Answer:
    """Between two cycles, h apart, at part x: the rate on a line, the wire out its integral through both ends."""
    change = b.payout - a.payout
    off = b.s_w - a.s_w - h * (a.payout + 0.5 * change)
    return Answer(a.payout + x * change, a.s_w + h * x * (a.payout + 0.5 * x * change) + x * off)


__all__ = ["Answer", "Exchange", "Sample", "ahead", "between", "inside"]
