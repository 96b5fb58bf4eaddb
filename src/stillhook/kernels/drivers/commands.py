"""Commands of the PLC that are in force between two cycles: those of the cycle before until it has calculated, and
where displacement controls have a dead time each control's own command of that time ago.

Commands are held, so what a control follows over a step is one command, or the mean of two in force one after the other
within the step, weighted by their time.
"""

import functools
from typing import Any, NamedTuple

from stillhook.control.sensor_errors import RING, Ring, pushed
from stillhook.kernels.lanes import access
from stillhook.physics.records import define, record, replace
from stillhook.physics.scalar import clip, scalar

MEMORY = "dead_time_memory"
"""Field of what is carried from cycle to cycle: last commands of each control."""
ROUNDING = 1e-9
"""Part of a step below which a change of command is at the step's end: rounding of sums."""


@functools.cache
def memory_of(commands: tuple[str, ...]) -> dict[str, Any]:
    """Class of `MEMORY` for the displacement controls that follow these commands; {} for none."""
    of = f"{__name__} {' '.join(commands)}"
    return {MEMORY: record("LastCommands", of, **dict.fromkeys(commands, Ring))} if commands else {}


@scalar
def either(u, before, w):
    """Command over a step of which the one before u is in force for a share w; where that is all or none, to the
    bit."""
    mean = u + w * (before - u)
    late = before if w > 1.0 - ROUNDING else mean
    return u if w < ROUNDING else late


define(
    "def followed(u, r, a, n):\n"
    + "".join(f"    u = either(u, r.x_{i + 1}, a - {float(i)} * n)\n" for i in range(RING))
    + "    return u\n",
    globals(),
    f"<commands of {RING} cycles>",
)
followed = scalar(globals()["followed"])
"""followed(u, r, a, n): command that a control follows over a step: u of this cycle, r those of the cycles before; a
steps from now until u is in force, n steps in a cycle."""


class InForce(NamedTuple):
    """in_force(b, tau, h): commands over a step of h that begins tau into the cycle [s], of a lane b; kept(b, laws):
    what is carried on to the next cycle, with the commands of the one that ends."""

    in_force: Any
    kept: Any


def commands_in_force(d: Any) -> InForce:
    """Of a driver."""
    mix = access(d.Command, d.lanes).mix

    @scalar
    def held(b, tau, h):
        """Commands in force over a step of h that begins tau into the cycle [s]: those of the cycle before until the
        PLC has calculated."""
        return mix(b.u, b.u_0, clip((b.p.plc.t_compute - tau) / h, 0.0, 1.0))

    Last = d.laws.Record.__annotations__.get(MEMORY)
    if Last is None:

        @scalar
        def unchanged(b, laws):
            return laws

        return InForce(held, unchanged)
    names = Last._fields
    used: dict[str, Any] = {"held": held, "followed": followed, "Ring": Ring, "pushed": pushed, "Last": Last}
    used |= {"with_late": replace(d.Command, *names), "with_last": replace(d.laws.Record, MEMORY)}
    places = {f: d.plant.SERVOS[f][1] for f in names}
    late = ", ".join(f"followed(b.u.{f}, last.{f}, a + b.p.{at}.dead_time / h, n)" for f, at in places.items())
    last = ", ".join(f"pushed(b.u.{f}, last.{f}) if begun else Ring({', '.join([f'b.u.{f}'] * RING)})" for f in names)
    source = f"""\
def in_force(b, tau, h):
    last = b.laws.{MEMORY}
    a, n = (b.p.plc.t_compute - tau) / h, b.p.plc.t_cycle / h
    return with_late(held(b, tau, h), {late})

def kept(b, laws):
    begun, last = b.laws.code >= 0.0, b.laws.{MEMORY}
    return with_last(laws, Last({last}))
"""
    define(source, used, f"<late {' '.join(names)} of {d.laws.Record.__module__}, {d.Command.__module__}, {d.lanes}>")
    return InForce(scalar(used["in_force"]), scalar(used["kept"]))
