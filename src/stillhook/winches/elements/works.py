"""Work that passes through a lift, for its audit: what each element does in a step is added up."""

from typing import NamedTuple

from stillhook.physics.records import replace
from stillhook.physics.scalar import scalar


class Works(NamedTuple):
    """Work since the start [J]: top from the winch into the wire; damping of wire and sling, gravity that was worked
    against; of the water and the seabed on the load, positive where it speeds the load up: buoyancy, inertia (added
    mass included), drag, slam, bottom; relay energy that wire brings along as it leaves the drum."""

    top: float
    damping: float
    gravity: float
    buoyancy: float
    inertia: float
    drag: float
    slam: float
    bottom: float
    relay: float


with_joint, with_wire = replace(Works, "damping", "buoyancy"), replace(Works, "top", "damping", "gravity")
with_relay = replace(Works, "relay")


@scalar
def of_body(w, p, v, dv, h, load):
    """A body's step h [s]: p `Momentum` with which it was solved, v its speed in the middle, dv what it gained [m/s].

    The water's force is that at the foreseen speed, its drag straightened from there.
    """
    f = p.force
    return Works(
        top=w.top,
        damping=w.damping,
        gravity=w.gravity + h * load.W * v,
        buoyancy=w.buoyancy + h * f.buoyancy * v,
        inertia=w.inertia + (h * f.inertia - f.m_a * dv) * v,
        drag=w.drag + h * (f.drag - f.damping * (v - p.v)) * v,
        slam=w.slam + h * f.slam * v,
        bottom=w.bottom + h * f.bottom * v,
        relay=w.relay,
    )


@scalar
def of_joint(w, F, sea, rate, stored, h):
    """A joint's step: force F [N] and the sea's part of it, rate at which its ends part [m/s], what it stored [J]."""
    return with_joint(w, w.damping + ((F - sea) * rate * h - stored), w.buoyancy - sea * rate * h)


@scalar
def of_wire(w, rows, v, sums, h):
    """A wire's step: v speed of its first node in the middle [m/s]."""
    top = rows.taut * (rows.T_0 - rows.G_0 * v)
    return with_wire(w, w.top + h * top * v, w.damping + h * sums.damping, w.gravity + h * sums.gravity)
