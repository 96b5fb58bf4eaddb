"""What a controller is: one module with its name, its settings, what it remembers, and one `cycle`.

A controller module has

NAME, TITLE
    Name that users write, and one line that says what it is.
cycle(r, plc), cycle(r, plc, s), cycle(r, plc, m) or cycle(r, plc, s, m)
    The law, a `scalar` function: from a `Reading` r, the settings `Plc` that all controllers share, its own Settings s
    and its own Memory m to a `Demand`, or with a memory to (`Demand`, Memory).
Settings (optional)
    NamedTuple whose fields are annotated with a `Setting`: unit, default, ends of the search of `tune`, meaning. The
    crane file and a controller's file give them in the table `[control.NAME]`.
Memory (optional)
    NamedTuple of floats with defaults, which it starts from whenever the controller comes into force.

and may have

LABEL
    What pictures call it (default NAME).
ORDER
    Place in lists (default 100).
USES
    Settings of a crane file's [control] and [active.motor], besides those of the pumps, that the law reads; `tune`
    searches them.
FAMILY
    "classic" for motors at a fixed displacement (default "other").
USUAL
    True where it is compared when a user names no controller; others are compared with the classic ones of these.
SWL_SHARE
    Part of the SWL that it carries (default 1).
COMPENSATES
    False where it leaves the tip's motion alone (default True).
DRIVES
    Kinds of drive that it commands (default ("displacement",)): `DISPLACEMENT`, a closed circuit whose motors'
    displacement it sets too; `SPEED`, a drive that takes the speed command u_p alone.

`stillhook.control.registry` finds the modules of `stillhook.control.controllers` and of the user.
"""

from typing import NamedTuple

DISPLACEMENT, SPEED = "displacement", "speed"
"""What a controller commands of a drive: pumps and the displacement of motors, or the speed of the winch alone."""


class Setting(NamedTuple):
    """One setting of a controller as a crane file gives it."""

    kind: str  # kind of quantity, a key of `stillhook.units.KINDS`; "" for a plain number
    default: str | float  # with its unit, as in a crane file
    meaning: str
    search: tuple[float, float] | None = None  # ends of the search of `tune` [SI]; None: not tuned
    least: float = 0.0  # allowed range [SI]
    most: float = 1.0e6


class Sensed(NamedTuple):
    """What the PLC reads at the start of a cycle."""

    s_tip: float  # motion unit: position of the tip, up positive [m]
    v_tip: float  # its speed [m/s]
    a_tip: float  # its acceleration [m/s^2]
    v_op: float  # speed that the operator requests, hoisting positive [m/s]
    s_op: float  # its integral [m]
    mode: float  # code of the controller
    f_pump: float  # share of the active pumps known to run [-]
    s_w: float  # encoder: wire paid out [m]
    F: float  # load cell [N]
    alpha_m: float  # known displacement of the active motors [-]
    K_wire: float  # of the present layer [-]
    dp: float  # p_a - p_b measured [Pa]
    dp_load: float  # dp at which the active motors carry what the passive ones do not [Pa]
    p_hp: float  # accumulator pressure [Pa], 0 without a passive circuit


class Reading(NamedTuple):
    """What a controller senses in a cycle."""

    y: Sensed  # the tip's motion already extrapolated by t_lead
    e_c: float  # control error: wire that is missing against the measured tip [m]
    F: float  # load cell, low-pass filtered [N]
    u_ff: float  # feedforward of the tip's and the operator's speed [-]
    u_fb: float  # feedback -K_p e_c [-]


class Demand(NamedTuple):
    """What a controller demands, before limits and bumpless transfer."""

    u_p: float  # pump command, hoisting positive [-]
    u_m: float  # displacement of the active motors [-]
