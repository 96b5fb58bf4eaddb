"""Holding brake: closes where no speed is commanded, and opens only once the motors carry the load, so that it does not
drop or jump."""

from typing import NamedTuple

from stillhook.physics.scalar import clip, fmax, fmin, scalar

SMALL = 0.02
"""Pump command below which the winch counts as standing [-]: 2 % of its speed, no more than leakage takes."""


class BrakeSettings(NamedTuple):
    """fitted 1 where there is a brake, else 0; t_wait time at zero speed before it closes, t_close, t_open times of
    travel, t_most longest wait for the motors' torque [s]; dp_near pressure by which that torque may be off [Pa];
    K_fill pump command per missing pressure, K_leak pump command that replaces what leaks, per pressure [1/Pa]; u_most
    largest pump command against the closed brake [-].
    """

    fitted: float
    t_wait: float
    t_close: float
    t_open: float
    t_most: float
    dp_near: float
    K_fill: float
    K_leak: float
    u_most: float


@scalar
def idle_time(idle, stands, t_cycle):
    """Time for which nothing was commanded [s], negative: time since a speed is commanded again."""
    return fmax(idle, 0.0) + t_cycle if stands else fmin(idle, 0.0) - t_cycle


@scalar
def closed_share(on, idle, missing, s, t_cycle):
    """How far the brake is closed after this cycle, 0 open to 1 closed; on before it.

    idle as in `idle_time`; missing pressure by which the motors do not yet carry the load [Pa]. A closed brake waits
    for them, at most t_most; one that is half closed opens at once.
    """
    closes = s.fitted > 0.5 and idle >= s.t_wait
    opens = idle < 0.0 and (on < 1.0 or abs(missing) <= s.dp_near or idle <= -s.t_most)
    more = t_cycle / fmax(s.t_close, t_cycle) if closes else 0.0
    less = t_cycle / fmax(s.t_open, t_cycle) if opens else 0.0
    return clip(on + more - less, 0.0, 1.0)


@scalar
def fill(dp_load, missing, s):
    """Pump command that brings the motors to the load's torque behind a closed brake [-]."""
    return clip(s.K_fill * missing + s.K_leak * dp_load, -s.u_most, s.u_most)
