"""Inputs of a test of the controller on its PLC, and the outputs that it must give, cycle by cycle."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from stillhook.control.guard import GuardSettings, guard_at_start
from stillhook.control.interface import Sensed
from stillhook.control.plc import memory_before
from stillhook.engine.pack.guard import time_to_stop
from stillhook.export.plc.block import sensed_notes
from stillhook.export.plc.program import Block
from stillhook.kernels import plc_alone
from stillhook.kernels.control_laws import extra_controllers
from stillhook.kernels.plc_alone import GuardedCommands, Outside
from stillhook.physics.hydraulics.swash import known_displacement

PART = 340
"""Cycles of each part of the sequence but those in which the holding brake moves."""
UNITS = dict.fromkeys(GuardedCommands._fields, "-") | {"e_c": "m"}
GOOD = Sensed._make([1.0] * len(Sensed._fields))
P_LOW = 2.0e6
"""Pressure of the line without load in the sequence [Pa]."""
NAN, INF = float("nan"), float("inf")
UNKNOWN_MODE = 99.0


class Reference:
    """The cycle that is exported, its guard included, one call a cycle, in Python."""

    def __init__(self, block: Block, guard: GuardSettings | None = None) -> None:
        self.block = block
        self.kernel = plc_alone.kernel(
            extra_controllers([block.controller]),
            block.drive,
            True,
            block.checks is not None,
            block.prediction is not None,
        )
        self.m = block.memory
        self.laws = self.kernel.laws.blank(
            block.own_settings, guard_at_start(guard or block.guard, block.code), block.checks_at_start
        )
        self.first = True

    def step(self, seen: Sensed, quality: Sensed = GOOD, reset: float = 0.0) -> Any:
        """`GuardedCommands` of the next cycle."""
        b, laws = self.block, self.kernel.laws
        outside = self.laws._replace(guard=self.laws.guard._replace(quality=quality, reset=reset))
        y, m, outside = laws.check(seen, self.m, outside, b.plc)
        if self.first:
            m = memory_before(m, y.F, y.s_w, y.s_tip, y.mode, y.v_op, b.plc)
            self.first = False
        y = y._replace(alpha_m=known_displacement(y.alpha_m, m.u_m, b.control))
        drive, self.m, self.laws = laws.cycle(y, m, outside, b.plc)
        g = self.laws.guard.g
        return GuardedCommands(*drive, g.alarm, g.cause, g.state)


class Part(NamedTuple):
    """A part of the sequence: cycles, mode, operator's speed and amplitude of the tip's speed over full speed, load
    over the safe working load, pumps, pressure [Pa], layer; faults as (first cycle, end, input, value or None for a bad
    quality); reset cycle in which the operator acknowledges, -1 never."""

    cycles: int
    mode: float
    operator: float
    amplitude: float
    share: float
    pumps: float
    pressure: float
    layer: float
    faults: tuple[tuple[int, int, str, float | None], ...] = ()
    reset: int = -1


def parts(block: Block) -> list[Part]:
    """In turn: at rest behind the brake, the operator hoists, compensation of a small and of a large motion, a light
    load, compensation while the operator lowers, half of the pumps and a pressure beyond their torque, an inner layer,
    at rest until the brake closes. Then faults: short ones in compensation, a joystick that fails and is released, a
    motion unit that fails for good, acknowledgements that are refused and one that is taken, and compensation again.
    """
    plc, dt = block.plc, block.t_cycle
    brake, code = plc.brake, block.code
    rest = PART + math.ceil((brake.t_wait + brake.t_close) / dt) if brake.fitted > 0.0 else PART
    opening = PART + math.ceil((brake.t_open + brake.t_most) / dt) if brake.fitted > 0.0 else PART
    limited = plc.power.Q_p > 0.0 and plc.power.P_max / plc.power.Q_p < 1e9
    high = min(1.5 * plc.power.P_max / plc.power.Q_p, 0.9 * block.guard.most.dp) if limited else 2.0e7
    short = (
        (20, 24, "v_tip", NAN),
        (60, 68, "s_w", None),
        (100, 140, "F", INF),
        (160, 163, "mode", UNKNOWN_MODE),
        (190, 193, "K_wire", 1e308),
        (220, 223, "dp", -INF),
        (250, 260, "s_tip", 1.0e3),
        (300, 310, "f_pump", 0.0),
    )
    stop = 50 + math.ceil(time_to_stop(block.guard, plc) / dt)
    return [
        Part(PART, 0.0, 0.0, 0.2, 0.6, 1.0, 0.0, 1.0),
        Part(opening, 0.0, 0.3, 0.2, 0.6, 1.0, 1.5e7, 1.0),
        Part(PART, code, 0.0, 0.4, 0.6, 1.0, 1.5e7, 1.0),
        Part(PART, code, 0.0, 1.6, 0.6, 1.0, 1.5e7, 1.0),
        Part(PART, code, 0.0, 0.7, 0.05, 1.0, 2.0e6, 1.0),
        Part(PART, code, -0.3, 0.5, 0.6, 1.0, 1.5e7, 1.0),
        Part(PART, code, 0.1, 0.7, 1.0, 0.5, high, 1.0),
        Part(PART, code, 0.0, 0.6, 0.8, 1.0, 2.0e7, 1.2),
        Part(rest, 0.0, 0.0, 0.3, 0.6, 1.0, 1.5e7, 1.2),
        Part(opening, 0.0, 0.3, 0.2, 0.6, 1.0, 1.5e7, 1.0),
        Part(PART, code, 0.0, 0.4, 0.6, 1.0, 1.5e7, 1.0, short),
        Part(PART, code, 0.2, 0.4, 0.6, 1.0, 1.5e7, 1.0, ((100, 140, "v_op", NAN), (180, 184, "v_op", None))),
        Part(stop, code, 0.0, 0.4, 0.6, 1.0, 1.5e7, 1.0, ((20, stop, "s_tip", NAN),)),
        Part(50, code, 0.0, 0.4, 0.6, 1.0, 1.5e7, 1.0, (), 20),
        Part(50, 0.0, 0.1, 0.4, 0.6, 1.0, 1.5e7, 1.0, (), 40),
        Part(100, 0.0, 0.0, 0.4, 0.6, 1.0, 1.5e7, 1.0, (), 80),
        Part(opening, 0.0, 0.3, 0.2, 0.6, 1.0, 1.5e7, 1.0, ((20, 40, "dp_load", None),)),
        Part(PART, code, 0.0, 0.4, 0.6, 1.0, 1.5e7, 1.0),
    ]


def inputs(block: Block, reference: Reference) -> Iterator[tuple[Outside, Any]]:
    """Every cycle's inputs and outputs, of `parts`. A crude winch follows the commands, so that the control error stays
    small."""
    dt = block.t_cycle
    F_swl = 1.0 / block.plc.motors.i_F_swl
    speed = 1.0 / block.plc.gains.K_1
    omega = 2.0 * math.pi / (0.7 * PART * dt)
    turning = 0.5 * block.guard.most.omega_m / block.guard.v_full  # of the motors on the innermost layer [rad/m]
    t, s_w, v_w, s_op, v_op, alpha, dp, s_tip, layer, amplitude = 0.0, 100.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.2
    for part in parts(block):
        for k in range(part.cycles):
            amplitude = _nearer(amplitude, part.amplitude, 0.5 * dt)
            layer = _nearer(layer, part.layer, 0.02)
            a = amplitude * speed
            v_tip = a * math.sin(omega * t) + 0.15 * a * math.sin(2.9 * omega * t)
            a_tip = a * omega * (math.cos(omega * t) + 0.435 * math.cos(2.9 * omega * t))
            v_op = _nearer(v_op, part.operator * speed, 2.0 * speed * dt)
            F = part.share * F_swl * (1.0 + 0.05 * math.sin(3.7 * omega * t))
            dp_load = part.pressure if part.pressure > 0.0 else 1.5e7
            seen = Sensed(
                s_tip=s_tip, v_tip=v_tip, a_tip=a_tip, v_op=v_op, s_op=s_op, mode=part.mode, f_pump=part.pumps,
                s_w=s_w, F=F, alpha_m=alpha, K_wire=layer, dp=dp, dp_load=dp_load,
                p_hp=2.0e7 + 1.0e6 * math.sin(0.3 * omega * t), omega_m=turning * v_w, p_a=P_LOW + max(dp, 0.0),
                p_b=P_LOW + max(-dp, 0.0),
            )  # fmt: skip
            faults = {name: value for first, end, name, value in part.faults if first <= k < end}
            seen = seen._replace(**{name: value for name, value in faults.items() if value is not None})
            quality = GOOD._replace(**{name: 0.0 for name, value in faults.items() if value is None})
            reset = float(k == part.reset)
            drive = reference.step(seen, quality, reset)
            yield Outside(seen, quality, reset), drive
            v_w = drive.u_p * speed if drive.brake <= 0.0 else 0.0
            s_w -= v_w * dt
            s_op += v_op * dt
            s_tip += v_tip * dt
            alpha += 0.2 * (drive.u_m - alpha)
            dp += 0.1 * (part.pressure - dp)
            t += dt


def _nearer(x: float, wanted: float, step: float) -> float:
    """x nearer to what is wanted by at most a step."""
    return wanted if abs(wanted - x) <= step else x + math.copysign(step, wanted - x)


def numbers(outside: Outside) -> list[float]:
    """A row of inputs in the order of the block."""
    return [*outside.y, *outside.quality, outside.reset]


def sequence_csv(block: Block) -> str:
    """CSV: cycle, inputs, their qualities, the reset, and expected outputs, with units in the header and every digit
    that a double has; nan, inf and -inf are written so."""
    units = {
        name: note.rsplit("[", 1)[1].split("]")[0] if "[" in note else "-" for name, note in sensed_notes().items()
    }
    head = ["cycle", *(f"{n} [{u}]" for n, u in units.items()), *(f"q_{n} [-]" for n in units), "reset [-]"]
    head += [f"expected {n} [{u}]" for n, u in UNITS.items()]
    lines = [",".join(head)]
    for number, (outside, drive) in enumerate(inputs(block, Reference(block))):
        lines.append(",".join([str(number), *(repr(float(x)) for x in (*numbers(outside), *drive))]))
    return "".join(f"{line}\r\n" for line in lines)
