"""The PLC alone, without a winch behind it: cycle after cycle over inputs that are given, such as those of a log."""

import functools
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.plc import Memory, Plc, Sensed, cycle
from stillhook.kernels.build import kept
from stillhook.physics.hydraulics.swash import MotorControl, known_displacement


class Commands(NamedTuple):
    """What the PLC commands in every cycle, each (n,): u_p pumps and u_m motors [-], u_ff the feedforward in u_p, u_raw
    pumps before the limit, e_c control error against the tip that it reads [m]."""

    u_p: FloatArray
    u_m: FloatArray
    u_ff: FloatArray
    u_raw: FloatArray
    e_c: FloatArray


AJAR = 1e-9
"""Share by which a brake is closed that may be so by the log: the next cycle without that mark finds it open [-]."""


class Seen(NamedTuple):
    """What the PLC reads in every cycle, each (n,): the fields of `Sensed` but its pressures, in its order.

    braked: 1 where the holding brake may not be open; u_braked: the pump command of those cycles, which follows from
    pressures [-].
    """

    s_tip: FloatArray
    v_tip: FloatArray
    a_tip: FloatArray
    v_op: FloatArray
    s_op: FloatArray
    mode: FloatArray
    f_pump: FloatArray
    s_w: FloatArray
    F: FloatArray
    alpha_m: FloatArray
    K_wire: FloatArray
    braked: FloatArray
    u_braked: FloatArray

    @property
    def sensed(self) -> Any:
        """`Sensed` of columns for the laws of the compensation, which read no pressure."""
        return Sensed._make([*self[: self._fields.index("braked")], 0.0, 0.0])


def plc_alone(seen: Seen, p_hp: FloatArray, memory: Memory, plc: Plc, control: MotorControl) -> tuple[Commands, Memory]:
    """Commands of the PLC over what it reads, cycle by cycle, and its memory after the last one.

    Parameters: seen, one value a cycle; p_hp (n,) accumulator pressure [Pa]; memory before the first
    cycle; control: where the motors' displacement is not measured, the PLC reckons with its own last command in place
    of seen.alpha_m. The holding brake and the pumps' torque limit are left out: both depend on pressures, which the
    plant makes. Where seen.braked marks a brake, the pump command is taken as it is and the PLC goes on from it without
    a jump, as it does when a brake opens.
    Source: Moslatt 2020 paper F, verification step 2 ("controller inputs from measured data").
    """
    plc = plc._replace(brake=plc.brake._replace(fitted=0.0))
    columns = Seen(*(np.ascontiguousarray(x, dtype=np.float64) for x in seen))
    commands = Commands(*np.empty((len(Commands._fields), len(p_hp))))
    last = _compiled()(columns, np.ascontiguousarray(p_hp, dtype=np.float64), commands, memory, plc, control)
    return commands, last


@functools.cache
def _compiled() -> Any:
    return kept(_cycles, "plc")


def _cycles(seen, p_hp, commands, m, plc, control):
    for k in range(len(p_hp)):
        alpha_m = known_displacement(seen.alpha_m[k], m.u_m, control)
        y = Sensed(
            seen.s_tip[k],
            seen.v_tip[k],
            seen.a_tip[k],
            seen.v_op[k],
            seen.s_op[k],
            seen.mode[k],
            seen.f_pump[k],
            seen.s_w[k],
            seen.F[k],
            alpha_m,
            seen.K_wire[k],
            0.0,
            0.0,
        )
        drive, m = cycle(y, m, p_hp[k], plc)
        u_p, u_raw = drive.u_p, drive.u_raw
        if seen.braked[k] > 0.0:
            u_p = u_raw = seen.u_braked[k]
            u_next = seen.u_braked[min(k + 1, len(p_hp) - 1)]  # where the open brake's first command starts
            m = Memory(m.mode, m.datum, m.F, m.p_mean, u_next, m.u_m, 0.0, m.b_m, m.held, AJAR, m.idle, m.stroke)
        commands.u_p[k], commands.u_m[k], commands.u_ff[k] = u_p, drive.u_m, drive.u_ff
        commands.u_raw[k], commands.e_c[k] = u_raw, drive.e_c
    return m
