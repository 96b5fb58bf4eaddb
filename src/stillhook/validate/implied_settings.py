"""What pumps and motors make of their commands: gain, offset and hysteresis of the measured settings against the twin's servos."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.physics.swash import Servo
from stillhook.validate.implied_curves import bridged
from stillhook.validate.implied_parts import Part
from stillhook.validate.implied_regression import Estimate, FloatArray, IntArray, fit

OFFSETS = np.linspace(-0.3, 0.3, 13)
"""Offsets of the motors' setting that are tried first [-]: three times what the thesis reports (paper E section 5.1.1: 5 to 10 %)."""
ASIDE = 0.01
"""Half of the difference by which the setting's answer to an offset is taken [-]."""
ROUNDS = 4
LEAST_SENSE = 2.0
"""Seconds of a setting that answers an offset of a tenth, from which an offset can be told."""
EVERY = 0.05
"""Spacing of the samples that are compared [s]: a servo answers in some tenths."""
TURNING = 0.005
"""Rate below which a setting goes neither up nor down [1/s]."""


@dataclass(frozen=True)
class Offset:
    """offset: by which the motors stand above their command [-], None where no command ever left room for one; hysteresis: full width
    [-], None where the command does not go up and down; seconds of data that can tell."""

    offset: Estimate | None
    hysteresis: Estimate | None
    seconds: float


@dataclass(frozen=True)
class PumpSetting:
    """Measured pump setting over the servo's answer to the command: gain less 1, and zero offset [-]."""

    gain: Estimate
    offset: Estimate


def followed(u: FloatArray, servo: Servo, step: float) -> FloatArray:
    """What a servo of the twin makes of a command that is held from sample to sample, starting at rest on the first one; (n,) [-].

    The stroke's ends hold the answer, not the servo's state, as in `stillhook.physics.swash`.
    """
    from scipy.signal import cont2discrete, lfilter, lfiltic  # heavy: only where logs are checked

    w, z = servo.omega_n, servo.zeta
    num, den, _ = cont2discrete(([w * w], [1.0, 2.0 * z * w, w * w]), step, method="zoh")
    b, a = np.ravel(num), np.ravel(den)
    start = lfiltic(b, a, np.full(len(a) - 1, u[0]), np.full(len(b) - 1, u[0]))
    out, _ = lfilter(b, a, u, zi=start)
    return np.asarray(np.clip(out, servo.lo, servo.hi))


def known_setting(part: Part, which: str) -> FloatArray | None:
    """The setting of the active pumps ("p") or motors ("m"): measured, else the servo's answer to the command; None without both."""
    if part.has(f"alpha_{which}"):
        return bridged(part[f"alpha_{which}"], part.step)
    if not part.has(f"u_{which}"):
        return None
    u = bridged(part[f"u_{which}"], part.step)
    if not np.isfinite(u).all():
        return None
    active = part.params.active
    return followed(u, active.pump_servo if which == "p" else active.motor_servo, part.step)


def motor_offset(parts: Sequence[Part]) -> Offset | None:
    """Offset and hysteresis of the motors' setting, from all parts with u_m and alpha_m; None where they were not logged.

    The offset that explains the settings best is looked for with the stroke's ends in the model: at full displacement an offset upwards
    cannot show, and then only the rest of the data counts.
    """
    mine = [(p, bridged(p["u_m"], p.step), p["alpha_m"]) for p in parts if p.has("u_m", "alpha_m")]
    mine = [(p, u, alpha) for p, u, alpha in mine if np.isfinite(u).all()]
    if not mine:
        return None
    sense = sum(_room(part, u) for part, u, _ in mine)
    if sense < LEAST_SENSE:
        return Offset(None, None, sense)
    tried = [sum(float(np.nansum((_at(part, alpha) - _meant(part, u, x)) ** 2)) for part, u, alpha in mine) for x in OFFSETS]
    offset = Estimate(float(OFFSETS[int(np.argmin(tried))]), 0.0)
    for _ in range(ROUNDS):
        offset = _nearer(mine, offset.value)
    return Offset(offset, _hysteresis(mine, offset.value), sense)


Logged = tuple[Part, FloatArray, FloatArray]


def _at(part: Part, x: FloatArray) -> FloatArray:
    """A signal every EVERY seconds."""
    return x[:: max(1, round(EVERY / part.step))]


def _blocks(part: Part) -> IntArray:
    return part.blocks(_at(part, part.t))


def _meant(part: Part, u: FloatArray, offset: float) -> FloatArray:
    """The setting that the command gives with an offset, every EVERY seconds."""
    return _at(part, followed(np.clip(u + offset, 0.0, 1.0), part.params.active.motor_servo, part.step))


def _room(part: Part, u: FloatArray) -> float:
    """Seconds in which an offset of a tenth would show, whichever way."""
    up, plain, down = (_meant(part, u, x) for x in (0.1, 0.0, -0.1))
    return float(np.sum(np.minimum(np.abs(up - plain), np.abs(plain - down)) > 0.05)) * EVERY


def _nearer(mine: Sequence[Logged], offset: float) -> Estimate:
    """One step of Gauss and Newton towards the offset of the least sum of squares, with its interval."""
    columns = []
    for part, u, alpha in mine:
        up, down = _meant(part, u, offset + ASIDE), _meant(part, u, offset - ASIDE)
        columns.append(((up - down) / (2.0 * ASIDE), _at(part, alpha) - _meant(part, u, offset), _blocks(part)))
    answer, rest, block = (np.concatenate(c) for c in zip(*columns, strict=True))
    telling = np.abs(answer) > 1e-3  # a block at full stroke all the time says nothing, and is none
    found = fit((answer[telling],), rest[telling], block[telling])
    if found is None:
        return Estimate(offset, float("inf"))
    return Estimate(offset + float(found.b[0]), found.half(0), found.blocks)


def _hysteresis(mine: Sequence[Logged], offset: float) -> Estimate | None:
    """Full width: by how much the setting lies higher on the way down than on the way up, the servo's own lag taken out."""
    columns: list[list[FloatArray]] = [[], [], [], [], []]
    for part, u, alpha in mine:
        servo = part.params.active.motor_servo
        meant = followed(np.clip(u + offset, 0.0, 1.0), servo, part.step)
        rate = np.gradient(meant, part.step)
        free = (meant > servo.lo + 0.01) & (meant < servo.hi - 0.01) & (np.abs(rate) > TURNING)
        rows = (np.where(free, alpha - meant, np.nan), rate, np.sign(rate), np.ones_like(rate))
        for column, row in zip(columns, rows, strict=False):
            column.append(_at(part, row))
        columns[4].append(_blocks(part).astype(np.float64))
    y, rate, way, one, block = (np.concatenate(c) for c in columns)
    found = fit((way, rate, one), y, block.astype(np.intp))
    return None if found is None else Estimate(-2.0 * float(found.b[0]), 2.0 * found.half(0), found.blocks)


def pump_setting(parts: Sequence[Part]) -> PumpSetting | None:
    """Gain and zero of the pumps' setting against the servo's answer to the command; None where they were not logged or stand still."""
    rows = []
    for part in parts:
        if not part.has("u_p", "alpha_p"):
            continue
        u = bridged(part["u_p"], part.step)
        if not np.isfinite(u).all():
            continue
        meant = followed(u, part.params.active.pump_servo, part.step)
        rows.append((*(_at(part, x) for x in (meant, np.gradient(meant, part.step), part["alpha_p"])), _blocks(part)))
    if not rows:
        return None
    meant, rate, alpha, block = (np.concatenate(c) for c in zip(*rows, strict=True))
    found = fit((meant, rate, np.ones_like(meant)), alpha, block)
    if found is None:
        return None
    gain = Estimate(float(found.b[0]) - 1.0, found.half(0), found.blocks)
    return PumpSetting(gain, Estimate(float(found.b[2]), found.half(2), found.blocks))
