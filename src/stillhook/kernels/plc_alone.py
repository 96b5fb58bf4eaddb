"""The PLC alone, without a winch behind it: cycle after cycle over inputs that are given, such as those of a log."""

import functools
from collections.abc import Mapping
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.interface import Sensed
from stillhook.control.plc import Memory, Plc
from stillhook.control.registry import CONTROLLERS, mode_of_code
from stillhook.kernels.build import compiled
from stillhook.kernels.control_laws import control_laws, extra_controllers, label
from stillhook.physics.hydraulics.swash import MotorControl, known_displacement
from stillhook.physics.records import replace


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

going_on = replace(Memory, "u_p", "b_p", "brake")


class PlcInputs(NamedTuple):
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
        return Sensed._make([*self[: self._fields.index("braked")], 0.0, 0.0, 0.0])


def plc_alone(
    seen: PlcInputs, p_hp: FloatArray, memory: Memory, plc: Plc, control: MotorControl, settings: Mapping[str, Any]
) -> tuple[Commands, Memory]:
    """Commands of the PLC over what it reads, cycle by cycle, and its memory after the last one.

    Parameters: seen, one value a cycle; p_hp (n,) accumulator pressure [Pa]; memory before the first cycle; control:
    where the motors' displacement is not measured, the PLC calculates with its own last command in place of
    seen.alpha_m; settings those of controllers that have some of their own, by name.

    The holding brake and the pumps' torque limit are left out: both depend on pressures, which the plant makes. Where
    seen.braked marks a brake, the pump command is taken as it is and the PLC goes on from it without a jump, as it does
    when a brake opens.
    Source: Moslatt 2020 paper F, verification step 2 ("controller inputs from measured data").
    """
    plc = plc._replace(brake=plc.brake._replace(fitted=0.0))
    columns = PlcInputs(*(np.ascontiguousarray(x, dtype=np.float64) for x in seen))
    commands = Commands(*np.empty((len(Commands._fields), len(p_hp))))
    used = extra_controllers(mode_of_code(code) for code in np.unique(columns.mode))
    record = control_laws(used).blank({name: settings[name] for name in used if CONTROLLERS[name].settings})
    p_hp = np.ascontiguousarray(p_hp, dtype=np.float64)
    return commands, _compiled(used)(columns, p_hp, commands, memory, record, plc, control)


@functools.cache
def _compiled(names: tuple[str, ...]) -> Any:
    """`_cycles` with these controllers in addition to those of every kernel."""
    bound = FunctionType(_cycles.__code__, {**globals(), "plc_cycle": control_laws(names).cycle}, _cycles.__name__)
    return compiled(bound, f"plc{label(names)}")


def _cycles(seen, p_hp, commands, m, laws, plc, control):
    for k in range(len(p_hp)):
        alpha_m = known_displacement(seen.alpha_m[k], m.u_m, control)
        y = Sensed(
            s_tip=seen.s_tip[k],
            v_tip=seen.v_tip[k],
            a_tip=seen.a_tip[k],
            v_op=seen.v_op[k],
            s_op=seen.s_op[k],
            mode=seen.mode[k],
            f_pump=seen.f_pump[k],
            s_w=seen.s_w[k],
            F=seen.F[k],
            alpha_m=alpha_m,
            K_wire=seen.K_wire[k],
            dp=0.0,
            dp_load=0.0,
            p_hp=p_hp[k],
        )
        drive, m, laws = plc_cycle(y, m, laws, plc)  # type: ignore[name-defined]  # noqa: F821
        u_p, u_raw = drive.u_p, drive.u_raw
        if seen.braked[k] > 0.0:
            u_p = u_raw = seen.u_braked[k]
            u_next = seen.u_braked[min(k + 1, len(p_hp) - 1)]  # where the open brake's first command starts
            m = going_on(m, u_next, 0.0, AJAR)
        commands.u_p[k], commands.u_m[k], commands.u_ff[k] = u_p, drive.u_m, drive.u_ff
        commands.u_raw[k], commands.e_c[k] = u_raw, drive.e_c
    return m
