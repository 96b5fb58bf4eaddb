"""Inputs of a test of the controller on its PLC, and the outputs that it must give, cycle by cycle."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from stillhook.control.commands import SMALL
from stillhook.control.interface import Sensed
from stillhook.control.plc import ActuatorCommands, memory_before
from stillhook.export.plc.block import sensed_notes
from stillhook.export.plc.program import Block
from stillhook.kernels import plc_alone
from stillhook.kernels.control_laws import extra_controllers
from stillhook.physics.hydraulics.swash import known_displacement

PART = 340
"""Cycles of each part of the sequence but those in which the holding brake moves."""
UNITS = dict.fromkeys(ActuatorCommands._fields, "-") | {"e_c": "m"}


class Reference:
    """The cycle that Stillhook simulates with, one call a cycle, in Python."""

    def __init__(self, block: Block) -> None:
        self.block = block
        self.kernel = plc_alone.kernel(extra_controllers([block.controller]), block.drive)
        own = {block.controller: block.own} if block.own is not None else {}
        self.m = block.memory
        self.laws = self.kernel.laws.blank(own)
        self.first = True

    def step(self, seen: Sensed) -> ActuatorCommands:
        """Commands of the next cycle."""
        b = self.block
        if self.first:
            self.m = memory_before(self.m, seen.F, seen.s_w, seen.s_tip, seen.mode, seen.v_op, b.plc)
            self.first = False
        seen = seen._replace(alpha_m=known_displacement(seen.alpha_m, self.m.u_m, b.control))
        drive, self.m, self.laws = self.kernel.laws.cycle(seen, self.m, self.laws, b.plc)
        return ActuatorCommands(*drive)


def inputs(block: Block, reference: Reference) -> Iterator[tuple[Sensed, ActuatorCommands]]:
    """Every cycle's inputs and outputs. A crude winch follows the commands, so that the control error stays small.

    In turn: at rest behind the brake, the operator hoists, compensation of a small and of a large motion, a light load,
    compensation while the operator lowers, half of the pumps and a pressure beyond their torque, an inner layer, at
    rest until the brake closes.
    """
    plc, dt = block.plc, block.t_cycle
    brake = plc.brake
    rest = PART + math.ceil((brake.t_wait + brake.t_close) / dt) if brake.fitted > 0.0 else PART
    opening = PART + math.ceil((brake.t_open + brake.t_most) / dt) if brake.fitted > 0.0 else PART
    F_swl = 1.0 / plc.motors.i_F_swl
    speed = 1.0 / plc.gains.K_1
    limited = plc.power.Q_p > 0.0 and plc.power.P_max / plc.power.Q_p < 1e9
    high = 1.5 * plc.power.P_max / plc.power.Q_p if limited else 2.0e7
    code = block.code
    # cycles, mode, operator's speed, amplitude of the tip's speed over full speed, load, pumps, pressure, layer
    parts = [
        (PART, 0.0, 0.0, 0.2, 0.6, 1.0, 0.0, 1.0),
        (opening, 0.0, 0.3, 0.2, 0.6, 1.0, 1.5e7, 1.0),
        (PART, code, 0.0, 0.4, 0.6, 1.0, 1.5e7, 1.0),
        (PART, code, 0.0, 1.6, 0.6, 1.0, 1.5e7, 1.0),
        (PART, code, 0.0, 0.7, 0.05, 1.0, 2.0e6, 1.0),
        (PART, code, -0.3, 0.5, 0.6, 1.0, 1.5e7, 1.0),
        (PART, code, 0.1, 0.7, 1.0, 0.5, high, 1.0),
        (PART, code, 0.0, 0.6, 0.8, 1.0, 2.0e7, 1.4),
        (rest, 0.0, 0.0, 0.3, 0.6, 1.0, 1.5e7, 1.2),
    ]
    omega = 2.0 * math.pi / (0.7 * PART * dt)
    t, s_w, s_op, v_op, alpha, dp, s_tip = 0.0, 100.0, 0.0, 0.0, 1.0, 0.0, 0.0
    for cycles, mode, operator, amplitude, share, pumps, pressure, layer in parts:
        for _ in range(cycles):
            a = amplitude * speed
            v_tip = a * math.sin(omega * t) + 0.15 * a * math.sin(2.9 * omega * t)
            a_tip = a * omega * (math.cos(omega * t) + 0.435 * math.cos(2.9 * omega * t))
            step = 2.0 * speed * dt
            wanted = operator * speed
            v_op = wanted if abs(wanted - v_op) <= step else v_op + math.copysign(step, wanted - v_op)
            F = share * F_swl * (1.0 + 0.05 * math.sin(3.7 * omega * t))
            dp_load = pressure if pressure > 0.0 else 1.5e7
            seen = Sensed(
                s_tip=s_tip, v_tip=v_tip, a_tip=a_tip, v_op=v_op, s_op=s_op, mode=mode, f_pump=pumps, s_w=s_w, F=F,
                alpha_m=alpha, K_wire=layer, dp=dp, dp_load=dp_load, p_hp=2.0e7 + 1.0e6 * math.sin(0.3 * omega * t),
            )  # fmt: skip
            drive = reference.step(seen)
            yield seen, drive
            moving = drive.u_p * speed if drive.brake <= 0.0 else 0.0
            s_w -= moving * dt
            s_op += v_op * dt
            s_tip += v_tip * dt
            alpha += 0.2 * (drive.u_m - alpha)
            dp += 0.1 * (pressure - dp)
            t += dt


def sequence_csv(block: Block) -> str:
    """CSV: cycle, inputs and expected outputs, with units in the header and every digit that a double has."""
    units = {
        name: note.rsplit("[", 1)[1].split("]")[0] if "[" in note else "-" for name, note in sensed_notes().items()
    }
    head = ["cycle", *(f"{n} [{u}]" for n, u in units.items()), *(f"expected {n} [{u}]" for n, u in UNITS.items())]
    lines = [",".join(head)]
    for number, (seen, drive) in enumerate(inputs(block, Reference(block))):
        lines.append(",".join([str(number), *(repr(float(x)) for x in (*seen, *drive))]))
    return "".join(f"{line}\r\n" for line in lines)


def reaches(rows: list[tuple[Any, Any]]) -> dict[str, bool]:
    """What a sequence of inputs and outputs brings about, each by name."""
    return {
        "manual": any(y.mode == 0.0 for y, _ in rows),
        "compensation": any(y.mode > 0.0 for y, _ in rows),
        "saturation": any(abs(d.u_raw) > 1.0 for _, d in rows),
        "half of the pumps": any(y.f_pump < 1.0 for y, _ in rows),
        "operator": any(abs(y.v_op) > SMALL for y, _ in rows),
        "brake closed": any(d.brake == 1.0 for _, d in rows),
        "brake open": any(d.brake == 0.0 for _, d in rows),
        "limited stroke": any(abs(d.u_p) < min(abs(d.u_raw), 1.0) for _, d in rows),
        "reduced displacement": any(d.u_m < 1.0 for _, d in rows),
    }
