"""Response of pumps and motors to their commands: gain, offset and hysteresis of settings against the twin's servos."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray, IntArray
from stillhook.physics.hydraulics.swash import Servo
from stillhook.statistics.blocks import fit
from stillhook.statistics.estimate import Estimate
from stillhook.validate.parameters.segments import LogPart, bridged, stacked

OFFSETS = np.linspace(-0.3, 0.3, 13)
"""Offsets of the motors' setting that are tried first [-]: up to three times 5 to 10 % (paper E section 5.1.1)."""
ASIDE = 0.01
"""Half of the finite difference for the setting's response to an offset [-]."""
ROUNDS = 4
LEAST_SENSE = 2.0
"""Duration in which the setting responds to an offset of a tenth, from which an offset can be determined [s]."""
EVERY = 0.05
"""Spacing of the samples that are compared [s]: a servo responds in some tenths."""
WIDEST_PLAY = 0.04
"""Full width of a play beyond which a control is broken [-]: a command that has moved this far has passed the play."""
FIRST_PLAY = 0.005
"""Half width of the play that the search starts from [-]."""
STEPS = (0.01, 0.002, 0.02, 0.02)
"""Steps for the answers to offset and half play [-], and to logarithms of the servo's speed and damping."""
LEAST_THETA, MOST_THETA = (-0.5, 0.0, -1.0, -1.0), (0.5, 0.5 * WIDEST_PLAY, 1.0, 1.0)
OPEN_PLAY = 0.01
"""Half width of the play that leaves the offset open where the command does not show it [-] (assumed: a control that
works; paper E section 5.1.1 prints no number)."""
RESOLUTION = 2.0**-11
"""What outputs and inputs of 12 bits over -1 to 1 round off [-] (assumed: usual resolution of a PLC)."""
SENSOR_GAIN = 0.003
"""Class of a displacement sensor, part of the reading (assumed: as of a transmitter); the gain of the pumps' setting
holds no better."""


Logged = tuple[LogPart, FloatArray, FloatArray]


@dataclass(frozen=True)
class Offset:
    """offset: of the motors' setting above their command [-], None where no command leaves room for one; hysteresis:
    full width [-], None where the command does not go up and down; seconds of usable data."""

    offset: Estimate | None
    hysteresis: Estimate | None
    seconds: float


@dataclass(frozen=True)
class PumpSetting:
    """Measured pump setting over the servo's response to the command: gain less 1, and zero offset [-]."""

    gain: Estimate
    offset: Estimate


def servo_response(u: FloatArray, omega_n: float, zeta: float, step: float, dead_time: float = 0.0) -> FloatArray:
    """Response of a second-order servo to a command held from sample to sample, starting at rest (n,) [-]. Source:
    Moslatt 2020 eq. C 10. A dead time is taken linear between samples."""
    from scipy.signal import cont2discrete, lfilter, lfiltic  # heavy: only where logs are checked

    if dead_time > 0.0:
        at = np.arange(len(u), dtype=np.float64)
        u = np.interp(at - dead_time / step, at, u)
    num, den, _ = cont2discrete(([omega_n * omega_n], [1.0, 2.0 * zeta * omega_n, omega_n * omega_n]), step, "zoh")
    b, a = np.ravel(num), np.ravel(den)
    start = lfiltic(b, a, np.full(len(a) - 1, u[0]), np.full(len(b) - 1, u[0]))
    return np.asarray(lfilter(b, a, u, zi=start)[0])


def followed(u: FloatArray, servo: Servo, step: float) -> FloatArray:
    """Response of a servo of the twin (n,) [-]; the stroke's ends limit the response, not the servo's state."""
    return np.clip(servo_response(u, servo.omega_n, servo.zeta, step, servo.dead_time), servo.lo, servo.hi)


def known_setting(part: LogPart, machine: str) -> FloatArray | None:
    """The setting of the active pumps ("p") or motors ("m"): measured, or else the servo's response; None without
    both."""
    if part.has(f"alpha_{machine}"):
        return bridged(part[f"alpha_{machine}"], part.step)
    if not part.has(f"u_{machine}"):
        return None
    u = bridged(part[f"u_{machine}"], part.step)
    if not np.isfinite(u).all():
        return None
    active = part.params.active
    return followed(u, active.pump_servo if machine == "p" else active.motor_servo, part.step)


def motor_offset(parts: Sequence[LogPart]) -> Offset | None:
    """Offset and hysteresis of the motors' setting, from all parts with u_m and alpha_m; None where they were not
    logged. The stroke's ends are in the model: at full displacement an offset upwards cannot show. Play and the servo's
    speed and damping are fitted with it. Until the command has moved WIDEST_PLAY either way the position within the
    play is unknown, and those samples do not count; where no command goes that far, OPEN_PLAY is in the interval as
    structural."""
    logs = [(p, bridged(p["u_m"], p.step), p["alpha_m"]) for p in parts if p.has("u_m", "alpha_m")]
    logs = [(p, u, alpha) for p, u, alpha in logs if np.isfinite(u).all()]
    if not logs:
        return None
    sense = sum(_room(part, u) for part, u, _ in logs)
    if sense < LEAST_SENSE:
        return Offset(None, None, sense)
    tried = [
        sum(float(np.nansum((_at(part, alpha) - _meant(part, u, x)) ** 2)) for part, u, alpha in logs) for x in OFFSETS
    ]
    first = float(OFFSETS[int(np.argmin(tried))])
    together = _with_play(logs, first)
    if together is not None:
        return Offset(*together, sense)
    offset = Estimate.around(first, 0.0)
    for _ in range(ROUNDS):
        offset = _nearer(logs, offset.value)
    half = math.hypot(offset.half, OPEN_PLAY)
    return Offset(Estimate.around(offset.value, half, offset.n, OPEN_PLAY), None, sense)


def after_play(u: FloatArray, half_width: float) -> FloatArray:
    """Response of a play to a command (n,), starting in the middle, as `stillhook.physics.hydraulics.swash.play`
    does."""
    moves = np.flatnonzero(np.diff(u, prepend=u[0]) != 0.0)
    position, out = float(u[0]), np.empty(len(moves) + 1)
    out[0] = position
    ends = (u[moves] - half_width).tolist(), (u[moves] + half_width).tolist()
    for i, (low, high) in enumerate(zip(*ends, strict=True), 1):
        if low > position:
            position = low
        if high < position:
            position = high
        out[i] = position
    return np.repeat(out, np.diff(np.concatenate(([0], moves, [len(u)]))))


def _with_play(logs: Sequence[Logged], first: float) -> tuple[Estimate, Estimate] | None:
    """Offset and hysteresis with the servo's speed and damping free, by Gauss-Newton; None where the command does not
    go up and down far enough."""
    theta, fitted, step = np.array([first, FIRST_PLAY, 0.0, 0.0]), None, np.array(STEPS)
    wide = [_at(part, np.maximum.accumulate(u) - np.minimum.accumulate(u)) > WIDEST_PLAY for part, u, _ in logs]
    usable = [(*logged, k) for logged, k in zip(logs, wide, strict=True) if k.any()]
    if not usable:
        return None
    for _ in range(ROUNDS):
        rows = []
        for part, u, alpha, k in usable:
            slopes = []
            for i in range(len(theta)):
                up, down = theta.copy(), theta.copy()
                up[i], down[i] = up[i] + step[i], down[i] - step[i]
                down[1] = max(down[1], 0.0)
                slopes.append((_played(part, u, up) - _played(part, u, down)) / (up[i] - down[i]))
            use = k & (np.abs(slopes[0]) > 1e-3)
            rest = _at(part, alpha) - _played(part, u, theta)
            rows.append(tuple(x[use] for x in (*slopes, rest, _blocks(part))))
        *columns, y, block = stacked(rows)
        fitted = fit(columns, y, block.astype(np.intp))
        if fitted is None:
            return None
        theta = np.clip(theta + fitted.b, LEAST_THETA, MOST_THETA)
    assert fitted is not None
    offset, width = (math.hypot(half, RESOLUTION) for half in (fitted.half(0), 2.0 * fitted.half(1)))
    return (
        Estimate.around(float(theta[0]), offset, fitted.blocks, RESOLUTION),
        Estimate.around(2.0 * float(theta[1]), width, fitted.blocks, RESOLUTION),
    )


def _played(part: LogPart, u: FloatArray, theta: FloatArray) -> FloatArray:
    """Setting every EVERY seconds by offset, half play, and logarithms of the servo's speed and damping over the twin's
    (4,)."""
    servo = part.params.active.motor_servo
    scaled = servo._replace(omega_n=servo.omega_n * math.exp(theta[2]), zeta=servo.zeta * math.exp(theta[3]))
    return _at(part, followed(np.clip(after_play(u, float(theta[1])) + theta[0], 0.0, 1.0), scaled, part.step))


def _at(part: LogPart, x: FloatArray) -> FloatArray:
    """A signal every EVERY seconds."""
    return x[:: max(1, round(EVERY / part.step))]


def _blocks(part: LogPart) -> IntArray:
    return part.blocks(_at(part, part.t))


def _meant(part: LogPart, u: FloatArray, offset: float) -> FloatArray:
    """The setting that the command gives with an offset, every EVERY seconds."""
    return _at(part, followed(np.clip(u + offset, 0.0, 1.0), part.params.active.motor_servo, part.step))


def _room(part: LogPart, u: FloatArray) -> float:
    """Duration in which an offset of a tenth of either sign would show [s]."""
    up, plain, down = (_meant(part, u, x) for x in (0.1, 0.0, -0.1))
    return float(np.sum(np.minimum(np.abs(up - plain), np.abs(plain - down)) > 0.05)) * EVERY


def _nearer(logs: Sequence[Logged], offset: float) -> Estimate:
    """One step of Gauss and Newton towards the offset of the least sum of squares, with its interval."""
    columns = []
    for part, u, alpha in logs:
        up, down = _meant(part, u, offset + ASIDE), _meant(part, u, offset - ASIDE)
        columns.append(((up - down) / (2.0 * ASIDE), _at(part, alpha) - _meant(part, u, offset), _blocks(part)))
    answer, rest, block = stacked(columns)
    telling = np.abs(answer) > 1e-3  # a block at full stroke throughout has no information and is left out
    fitted = fit((answer[telling],), rest[telling], block[telling])
    if fitted is None:
        return Estimate.around(offset, float("inf"))
    return Estimate.around(offset + float(fitted.b[0]), fitted.half(0), fitted.blocks)


def pump_setting(parts: Sequence[LogPart]) -> PumpSetting | None:
    """Gain and zero of the pumps' setting against the servo's response; None where not logged or constant."""
    rows = []
    for part in parts:
        if not part.has("u_p", "alpha_p"):
            continue
        u = bridged(part["u_p"], part.step)
        if not np.isfinite(u).all():
            continue
        set_point = followed(u, part.params.active.pump_servo, part.step)
        rows.append(
            (*(_at(part, x) for x in (set_point, np.gradient(set_point, part.step), part["alpha_p"])), _blocks(part))
        )
    if not rows:
        return None
    set_point, rate, alpha, block = stacked(rows)
    fitted = fit((set_point, rate, np.ones_like(set_point)), alpha, block)
    if fitted is None:
        return None
    gain = Estimate.around(
        float(fitted.b[0]) - 1.0, math.hypot(fitted.half(0), SENSOR_GAIN), fitted.blocks, SENSOR_GAIN
    )
    return PumpSetting(gain, fitted.estimate(2))
