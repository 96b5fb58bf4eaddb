"""A winch in a host whose steps are its own: PLC cycles run as the host's time passes them.

The host has wire, load and water. It gives, at its own times, the tension at the crane tip and the motion of the tip,
and gets the rate at which wire is paid out, and the wire out. A time may be asked as often as a host iterates: the
state is held at the last time that was accepted, and every answer starts from a copy of it.
"""

from __future__ import annotations

import base64
import json
import math
from dataclasses import dataclass
from typing import NamedTuple

from stillhook.engine.session import Session
from stillhook.errors import SimulationError
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

ROUNDING = 1e-6
"""Part of a PLC cycle by which a host's time may be beside one and still be it."""


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
    """A time of the host, and the winch at the last PLC cycle before it: state of the session after k cycles."""

    sample: Sample
    k: int
    state: bytes


class Exchange:
    """A winch for a host, coupled by tension.

    Parameters: crane; case: wire out, mode and controllers with which it begins; its load follows from the first
    tension, its motion and water are the host's; v_op: speed of the operator, hoisting positive [m/s].

    At the first sample the winch stands under its tension, with a tip that stands. The PLC runs on its own grid of
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

    def at(self, sample: Sample, *, new_step: bool) -> Answer:
        """The answer at a sample; new_step: the host began a new step, so that its last sample is accepted unless the
        time went back behind it.

        Errors: SimulationError, one line, for a sample that is no number, and a time before the last accepted one.
        ScenarioError for a tension that the crane cannot hold at the start.
        """
        if not all(math.isfinite(x) for x in sample):
            raise SimulationError(f"The host gave {sample._asdict()} at {sample.time:.6g} s. Give finite numbers.")
        sample = sample._replace(F_w=max(sample.F_w, 0.0))  # a wire cannot push
        room = ROUNDING * self.crane.control.t_cycle
        if self._session is None or sample.time <= self._first.time + room:
            return self._begin(sample)
        if new_step and self._accepted.sample.time < self._trial.sample.time < sample.time:
            self._accepted = self._trial
        if sample.time < self._accepted.sample.time - room:
            raise SimulationError(
                f"The host went back to {sample.time:.6g} s, before its last accepted step at "
                f"{self._accepted.sample.time:.6g} s. Restore the state that was stored with that time."
            )
        return self._advance(self._session, sample)

    def _begin(self, sample: Sample) -> Answer:
        self._first = sample
        session = self._standing()
        self._session = session
        self._accepted = self._trial = Mark(sample, 0, session.save())
        return _reading(session)

    def _standing(self) -> Session:
        """The winch standing under the first tension."""
        load = max(self._first.F_w / G - self.crane.hook_mass, 0.0)
        case = self.case.model_copy(update={"load": load, "water": None})
        return Session(self.crane, case, coupling="wire")

    def _advance(self, session: Session, sample: Sample) -> Answer:
        t_cycle, first = session.cycle, self._first.time
        before = self._accepted
        session.restore(before.state)
        cycles = (sample.time - first) / t_cycle
        n = math.floor(cycles + ROUNDING)
        for k in range(before.k + 1, n + 1):
            session.step(self._inputs(between(before.sample, sample, first + k * t_cycle)))
        self._trial = Mark(sample, max(n, before.k), session.save())
        now, x = _reading(session), cycles - n
        if x <= ROUNDING:
            return now
        session.step(self._inputs(ahead(sample, first + (n + 1) * t_cycle)))
        return inside(now, _reading(session), x, t_cycle)

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
        mark = self._trial
        data = {"first": self._first, "k": mark.k, "sample": mark.sample}
        return json.dumps({**data, "v_op": self.v_op, "state": base64.b85encode(mark.state).decode()})

    def restore(self, text: str) -> None:
        """Go on from what `save` gave. Errors: SimulationError where it is of another crane, case or version, or no
        such text; nothing is changed then."""
        try:
            data = json.loads(text)
            first, sample = Sample(*data["first"]), Sample(*data["sample"])
            k, v_op, state = int(data["k"]), float(data["v_op"]), base64.b85decode(data["state"])
        except (ValueError, KeyError, TypeError):
            raise SimulationError("The stored state is not one of Stillhook's. Begin the simulation anew.") from None
        other = Exchange(self.crane, self.case, v_op=v_op)
        other._first = first
        session = other._standing()
        session.restore(state)
        self.v_op, self._first, self._session = v_op, first, session
        self._accepted = self._trial = Mark(sample, k, state)


def _reading(session: Session) -> Answer:
    return Answer(0.0 - session.get("v_w"), session.get("s_w"))


def between(a: Sample, b: Sample, time: float) -> Sample:
    """The host's course at a time between two samples: tension on a line, tip on the quintic through both."""
    h = b.time - a.time
    if h <= 0.0:
        return b._replace(time=time)
    x = (time - a.time) / h
    v_0, a_0, v_1, a_1 = a.v_tip * h, a.a_tip * h * h, b.v_tip * h, b.a_tip * h * h
    d = b.s_tip - a.s_tip
    c_3 = 10.0 * d - 6.0 * v_0 - 4.0 * v_1 - 1.5 * a_0 + 0.5 * a_1
    c_4 = -15.0 * d + 8.0 * v_0 + 7.0 * v_1 + 1.5 * a_0 - a_1
    c_5 = 6.0 * d - 3.0 * v_0 - 3.0 * v_1 - 0.5 * a_0 + 0.5 * a_1
    return Sample(
        time,
        a.F_w + x * (b.F_w - a.F_w),
        a.s_tip + x * (v_0 + x * (0.5 * a_0 + x * (c_3 + x * (c_4 + x * c_5)))),
        (v_0 + x * (a_0 + x * (3.0 * c_3 + x * (4.0 * c_4 + x * 5.0 * c_5)))) / h,
        (a_0 + x * (6.0 * c_3 + x * (12.0 * c_4 + x * 20.0 * c_5))) / (h * h),
    )


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
