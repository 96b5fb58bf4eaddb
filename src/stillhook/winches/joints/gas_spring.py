"""A passive heave compensator above the slings: a gas spring with seals, an orifice and two stops."""

from typing import NamedTuple

from stillhook.physics.load_path.compensator import (
    Compensator,
    compensator_energy,
    compensator_mean,
    gas_force,
    gas_law,
    place_of,
    pull_of_compensator,
    stroke,
)
from stillhook.physics.scalar import fmax, fmin, scalar

NAME = "compensator"
NEVER = 1.0e300
Link = Compensator


class Signals(NamedTuple):
    """Columns of a series; names and units as in `stillhook.variables`."""

    s_c: float
    v_c: float
    p_c: float


class Stats(NamedTuple):
    """Over one stage, from every step, the load hanging free: least and largest stroke [m]; fastest rod either way
    [m/s]; highest gas pressure [Pa]; time with the rod fully out and fully in [s], and when it first was [s]."""

    s_c_min: float
    s_c_max: float
    v_c: float
    p_c: float
    out: float
    inside: float
    t_out: float
    t_in: float


def blank() -> Stats:
    """Statistics of nothing yet."""
    return Stats(s_c_min=NEVER, s_c_max=-NEVER, v_c=0.0, p_c=0.0, out=0.0, inside=0.0, t_out=NEVER, t_in=NEVER)


@scalar
def pull(x, v, z, A_up, R_up, A_down, R_down, h, sling, link):
    """Force between hook and payload over a step, and their speeds in its middle."""
    return pull_of_compensator(x, A_up, R_up, A_down, R_down, h, gas_law(x, v, z + link.z_c, h, link), sling, link)


@scalar
def mean(x, v, z, rate, h, sling, link):
    """Its force over the step [N], and the part of it that the sea does [N]."""
    law = gas_law(x, v, z + link.z_c, h, link)
    return compensator_mean(x, rate, h, law, sling, link), law.sea


@scalar
def energy(x, sling, link):
    """Energy in unit and slings [J]."""
    return compensator_energy(x, sling, link)


@scalar
def slack_of_stop(sea, sling, link):
    """How far the slings still give before the rod leaves its inner stop, beyond what the gas alone asks [m]: sea and
    seals hold it too."""
    return (sea + link.F_f) / sling.k


@scalar
def signals(x, rate, sling, link):
    """A row of the series: x stretch [m] and its rate [m/s]."""
    s = stroke(x, link)
    moves = 1.0 if s > 0.0 and s < link.x_max else 0.0
    return Signals(s_c=s, v_c=moves * rate, p_c=gas_force(place_of(s, link), link.gas) / link.A)


@scalar
def fold(a, t, h, x, rate, sea, grounded, sling, link):
    """Statistics with one more step that ends at t [s]: x stretch at its end [m], rate in its middle [m/s], sea force
    of the sea on the rod [N]; once the load touched the seabed the rod may go in, and nothing is counted."""
    s = stroke(x, link)
    free = 1.0 if grounded == 0.0 else 0.0
    out = free if x - link.e >= link.x_max else 0.0
    inside = free if x - link.e <= slack_of_stop(sea, sling, link) else 0.0
    moves = free * (1.0 - out) * (1.0 - inside)
    return Stats(
        s_c_min=fmin(a.s_c_min, s) if free > 0.0 else a.s_c_min,
        s_c_max=fmax(a.s_c_max, s) if free > 0.0 else a.s_c_max,
        v_c=fmax(a.v_c, moves * abs(rate)),
        p_c=fmax(a.p_c, gas_force(place_of(s, link), link.gas) / link.A),
        out=a.out + h * out,
        inside=a.inside + h * inside,
        t_out=fmin(a.t_out, t if out > 0.0 else NEVER),
        t_in=fmin(a.t_in, t if inside > 0.0 else NEVER),
    )
