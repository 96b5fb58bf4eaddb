"""The twin as a function of the tuned and the free nuisance parameters: outputs as the sensors show them, and their
derivatives.

Tuned parameters of a test of the winch's dynamics, and nuisance parameters left free so that they do not bias the
tuned ones.
"""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from importlib.resources import files
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from stillhook.base.arrays import FloatArray
from stillhook.errors import ValidateError
from stillhook.library.leakage import form_of
from stillhook.spec.crane import Crane, inertia_ratio_without_wire
from stillhook.validate.dynamics.output_error import FAR, Model
from stillhook.validate.dynamics.runs import SIGNALS, DynamicsSegment, delayed, repeated, steps_per_cycle
from stillhook.winches.circuits.losses import MJ4
from stillhook.winches.circuits.tables import LeakForm

S = TypeVar("S", bound=BaseModel)
C_H, C_LEAK, INERTIA, VISCOUS, SPEED_LEAKAGE = "C_h", "C_leak", "J_m_eff", "viscous", "speed_leakage"
TUNED = (C_H, C_LEAK, INERTIA)
"""The three that are tuned: capacitance of both lines, leakage of the active pumps and motors, inertia at the shaft
with a full drum."""


MOST = math.log(2.5)
"""A factor on what is tuned is looked for within exp(MOST) and its inverse."""


class Unknown(NamedTuple):
    """A factor on the crane. bend(crane, factor) gives the crane; spread: standard deviation of its logarithm before
    any data (inf: none is assumed); step of the logarithm in a finite difference; varies: deviation from turn to
    turn."""

    name: str
    bend: Callable[[Crane, float], Crane]
    spread: float = math.inf
    step: float = 2e-3
    varies: float = 0.0

    @property
    def most(self) -> float:
        """Bound of the logarithm either way: what is tuned within a factor of 2.5, the rest within three spreads."""
        return MOST if math.isinf(self.spread) else max(MOST, 3.0 * self.spread)


def with_change(spec: S, path: str, change: Callable[[Any], Any]) -> S:
    """A crane, or a part of it, with the value at a dotted path changed; "motors" stands for those of every circuit."""
    name, _, rest = path.partition(".")
    if name == "motors":
        for circuit in spec.circuits:  # type: ignore[attr-defined]
            spec = with_change(spec, f"{circuit}.motor.{rest}", change)
        return spec
    value = getattr(spec, name)
    return spec.model_copy(update={name: with_change(value, rest, change) if rest else change(value)})


def scaled(crane: Crane, factor: float, *paths: str) -> Crane:
    """The crane with the numbers at these paths times a factor; an absent one counts as 1."""
    for path in paths:
        crane = with_change(crane, path, lambda x: (1.0 if x is None else x) * factor)
    return crane


def scaling(*paths: str) -> Callable[[Crane, float], Crane]:
    """`scaled` as a function of crane and factor."""
    return lambda crane, factor: scaled(crane, factor, *paths)


WITHOUT_SPEED: Mapping[LeakForm, LeakForm] = {LeakForm.CONSTANT: LeakForm.SPEED, LeakForm.STROKE: LeakForm.STROKE_SPEED}
"""Forms of leak that do not vary with the motors' speed, and each with it."""


def _speed_leakage(crane: Crane, x: float) -> Crane:
    """C_2 times x, in every form; in a form without it, C_2 (x - 1) in addition to what the motors leak."""
    motor, leak = crane.active.motor, form_of(crane.active)
    C_1, C_2 = motor.C_1, motor.C_2 * x
    if leak.form in WITHOUT_SPEED:
        C_1, C_2 = C_1 + motor.C_2 * leak.at.n_m, C_2 - motor.C_2
        leak = leak.model_copy(update={"form": WITHOUT_SPEED[leak.form]})
    update = {"motor": motor.model_copy(update={"C_1": C_1, "C_2": C_2}), "leak": leak}
    return with_change(crane, "active", lambda circuit: circuit.model_copy(update=update))


def _inertia(crane: Crane, x: float) -> Crane:
    """All inertia but the wire's takes the difference: the wire's follows from its mass."""
    ratio = 1.0 + inertia_ratio_without_wire(crane) * (x - 1.0)
    return scaled(scaled(crane, x, "inertia.J_m_eff"), ratio, "inertia.J_gear", "inertia.J_drum", "motors.J")


def viscous_friction(crane: Crane) -> float:
    """Friction of motors and transmission that is proportional to speed, of all motors together, as the tuning scales
    it: that of the transmission alone where motors have another loss model than MJ4 [N m s/rad]."""
    Y_5 = crane.friction.system.Y_5
    total = float(sum(m.count * ((m.loss.X_1 if m.law == MJ4 else 0.0) + Y_5) for m in crane.motors))
    if total == 0.0:
        do = "Give friction.system.Y_5, or validate with MJ4"
        raise ValidateError(f'"{crane.name}": no viscous friction to tune: X_1 of MJ4, and Y_5, are 0. {do}.')
    return total


def _pump_flow(crane: Crane, x: float) -> Crane:
    """Displacement of the pumps times x, at the same leakage."""
    crane = with_change(crane, "active.pump.D", lambda D: tuple(each * x for each in D))
    return with_change(crane, "active.pump.leak_scale", lambda scale: (1.0 if scale is None else scale) / x)


class Extra(NamedTuple):
    """Effect that the twin does not model and a log shows: 0 is the unchanged twin. spread: deviation beforehand."""

    name: str
    spread: float
    low: float
    high: float


COMMAND_DELAY, INERTANCE, DROP, P_DELAY, SPEED_DELAY = (
    "command_delay",
    "line_inertance",
    "line_drop",
    "p_delay",
    "omega_delay",
)
OFFSETS = {"p_a": "p_a_offset", "p_b": "p_b_offset"}
"""Signals whose sensor may have a constant error, and the parameter that says which."""
DELAYS = {"p_a": P_DELAY, "p_b": P_DELAY, "omega_m": SPEED_DELAY}
"""Signals whose sensor may be late, and the parameter that says by how much."""
_TABLE = tomllib.loads((files("stillhook.validate.dynamics") / "parameters.toml").read_text(encoding="utf-8"))
BENDS = {SPEED_LEAKAGE: _speed_leakage, INERTIA: _inertia, "pump_flow": _pump_flow}
"""Factors that are not those of single numbers of the crane file."""
UNKNOWNS: tuple[Unknown, ...] = tuple(
    Unknown(bend=scaling(*row.pop("paths")) if "paths" in row else BENDS[row["name"]], **row)
    for row in _TABLE["unknown"]
)
EXTRAS: tuple[Extra, ...] = tuple(Extra(**row) for row in _TABLE["extra"])
NAMES = (*(u.name for u in UNKNOWNS), *(e.name for e in EXTRAS))
"""Every parameter of the fit, in its order."""
PLACE = {name: i for i, name in enumerate(NAMES)}


SLIP, SLIP_PRESSURE, SLIP_AT = 0.01, 250e5, 0.35
"""Slip of the electric motors that drive the pumps at full flow and this pressure [-, Pa] (typical of their size), and
pump setting at which it is compared with leakage."""


def centre(crane: Crane, name: str) -> float:
    """What the logarithm of an unknown is beforehand: 0, but for leakage that rises with speed.

    The pumps slow with the power that they give. At a setting a that takes the flow of a conductance of slip a^2 Q / p,
    Q full flow: like leakage that rises with speed, which the twin has.
    """
    if name != SPEED_LEAKAGE:
        return 0.0
    pump, motor = crane.active.pump, crane.active.motor
    Q = pump.D_total * pump.omega_p
    rise = motor.count * motor.C_2 * SLIP_AT * Q / motor.D_total
    return math.log1p(SLIP * SLIP_AT**2 * Q / SLIP_PRESSURE / rise) if rise > 0.0 else 0.0


def bent(crane: Crane, logs: Mapping[str, float]) -> Crane:
    """The crane with the factors exp(logs[name]) of the unknowns."""
    for unknown in UNKNOWNS:
        if logs.get(unknown.name):
            crane = unknown.bend(crane, math.exp(logs[unknown.name]))
    return crane


LEAST_DEVIATIONS = np.array([0.3e5, 0.3e5, 0.05, 3e-4])
"""Least deviation that weights the residuals of each of SIGNALS [SI]: the step of a 12-bit input card, and a little
noise."""
ENDS = ((-1.0, "low"), (1.0, "high"))
"""Ends of a range: sign of the end for an Unknown, name of the field of an Extra."""
LEAST_OTHER_INERTIA = 0.8
"""The inertia other than the wire's (which follows from its mass) may decrease by this part."""
PERIODS = tuple(math.log(x) for x in (0.70, 0.77, 0.84, 0.92, 1.0, 1.09, 1.19, 1.3, 1.42))
"""Logarithms of sqrt(C_h J) that the search starts from: a twelfth of the period apart, so that the ringing of one
falls in step."""
STIFFNESSES = tuple(math.log(x) for x in (0.7, 0.84, 1.0, 1.19, 1.42))
"""Logarithms of sqrt(J / C_h) that it starts from."""
LEAKS = tuple(math.log(x) for x in (0.5, 1.0, 2.0))
DELAY_STEP = 1e-3
"""By how much the commands are moved in a finite difference [s]."""
P_A, P_B, OMEGA, ALPHA_P = (SIGNALS.index(name) for name in ("p_a", "p_b", "omega_m", "alpha_p"))
SPLIT = 0.5
"""Part of a line's capacitance at the pumps: not known, and of little weight (it counts squared, in one of
two lines)."""
BOTH_LINES = 1.0 + SPLIT**2
"""Oil that swings with the shaft, over that of one line: all of the lower line, whose pressure is held at the pumps; of
the higher line the flow into its pump end, whose energy counts."""
HELD_BY, HELD_OVER = 3e5, 1e5
"""A line is held at the pumps up to this pressure above its flushing valve's, and the change is this wide [Pa]."""
SIDES = ((P_A, -1.0), (P_B, 1.0))
"""Pressure transmitters, and the sign by which the pressure at the motors differs from the line's mean as oil goes to
the motors in A."""


class Twin:
    """A crane on stretches of tests. clusters: for each sample the turn that it is of, -1 for none."""

    def __init__(
        self, crane: Crane, time_segments: Sequence[DynamicsSegment], clusters: Sequence[NDArray[np.int64]]
    ) -> None:
        self.crane, self.time_segments = crane, tuple(time_segments)
        self.least_J = max(-MOST, math.log(1.0 - LEAST_OTHER_INERTIA / inertia_ratio_without_wire(crane)))
        stiffest = {u.name: u.most for u in UNKNOWNS} | {C_H: -MOST, INERTIA: self.least_J}
        self.n_sub = max(steps_per_cycle(bent(crane, stiffest), s) for s in time_segments)
        shape = [
            (s, c, k, name) for s, c in zip(time_segments, clusters, strict=True) for k, name in enumerate(SIGNALS)
        ]
        self.signal = np.concatenate([np.full(len(s.t), k) for s, _, k, _ in shape])
        self.cluster = np.concatenate([c for _, c, _, _ in shape])
        self.measured = np.concatenate([_compared(s, c, name) for s, c, _, name in shape])
        pump, motor = crane.active.pump, crane.active.motor
        self.Q_full = pump.D_total * pump.omega_p
        self.D_m = motor.D_total * float(np.mean([np.mean(s.u_m) for s in time_segments]))
        self.inertance = crane.inertia.J_m_eff / self.D_m**2
        """Inertance of a line whose oil moves as J_m_eff does [Pa s^2/m^3]."""
        self.held = crane.active.boost.p + crane.active.flushing.dp_open + HELD_BY

    def model(self, known: Mapping[str, tuple[float, float]]) -> Model:
        """What `stillhook.validate.dynamics.output_error.fit` fits; known: logarithms of factors and their
        deviations from other tests."""
        spread = np.array([*(u.spread for u in UNKNOWNS), *(e.spread for e in EXTRAS)])
        low, high = (
            np.array([sign * u.most for u in UNKNOWNS] + [getattr(e, end) for e in EXTRAS]) for sign, end in ENDS
        )
        low[PLACE[INERTIA]] = self.least_J
        centres = np.array([centre(self.crane, name) for name in NAMES])
        for name, (x, deviation) in known.items():
            centres[PLACE[name]], spread[PLACE[name]] = x, deviation
        return Model(
            evaluate=self.evaluate,
            signal=self.signal,
            cluster=self.cluster,
            noise=LEAST_DEVIATIONS,
            centre=centres,
            spread=spread,
            varies=np.array([*(u.varies for u in UNKNOWNS), *(0.0 for _ in EXTRAS)]),
            low=low,
            high=high,
        )

    def bent(self, theta: FloatArray) -> Crane:
        """The crane at some parameters: the oil in the lines swings with the shaft, and is slowed as viscous friction
        slows it."""
        logs = {u.name: float(theta[i]) for i, u in enumerate(UNKNOWNS)}
        logs[INERTIA] = math.log(math.exp(logs[INERTIA]) + BOTH_LINES * float(theta[PLACE[INERTANCE]]))
        added = self._line_friction * float(theta[PLACE[DROP]]) / viscous_friction(self.crane)
        logs[VISCOUS] = math.log(math.exp(logs[VISCOUS]) + added)
        return bent(self.crane, logs)

    @property
    def _line_friction(self) -> float:
        """Viscous friction at the shaft that stands for the drop of both lines, per drop at full flow [N m
        s/rad/Pa]."""
        return BOTH_LINES * self.D_m**2 / self.Q_full

    def evaluate(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Outputs less measurements (n,) and derivatives (n, p); FAR from the measurements where a run loses its
        numbers."""
        late = float(theta[PLACE[COMMAND_DELAY]])
        moved = [theta + u.step * np.eye(len(theta))[i] for i, u in enumerate(UNKNOWNS)]
        cranes = [self.bent(x) for x in (theta, *moved, theta)]
        delays = [late] * (len(UNKNOWNS) + 1) + [late + DELAY_STEP]
        steps = np.array([u.step for u in UNKNOWNS] + [DELAY_STEP])
        values, slopes = [], []
        for s, runs in zip(self.time_segments, repeated(cranes, self._late(delays), self.n_sub), strict=True):
            rows = np.zeros((len(NAMES), *runs.shape[1:]))
            rows[: len(steps)] = (runs[1:] - runs[0]) / steps[:, None, None]
            values.append(self._sensed(s.t, runs[0], rows, theta).T.ravel())
            slopes.append(rows.transpose(2, 1, 0).reshape(-1, len(NAMES)))
        y, J = np.concatenate(values), np.concatenate(slopes)
        lost = np.isfinite(self.measured) & ~(np.isfinite(y) & np.isfinite(J).all(axis=1))
        far = FAR * LEAST_DEVIATIONS[self.signal]
        return np.where(lost, far, y - self.measured), np.where(lost[:, None], 0.0, J)

    def _late(self, delays: Sequence[float]) -> list[list[DynamicsSegment]]:
        """Each stretch with its commands moved by each of the delays [s]."""
        out = []
        for s in self.time_segments:
            made = {x: delayed(s, x) for x in dict.fromkeys(delays)}
            out.append([made[x] for x in delays])
        return out

    def _sensed(self, t: FloatArray, runs: FloatArray, rows: FloatArray, theta: FloatArray) -> FloatArray:
        """Outputs (n, SIGNALS) as their sensors show them: oil of the lines in the pressures at the motors, delays,
        offsets. rows (p, n, SIGNALS), the derivatives, change with them."""
        y = runs.copy()
        inertance, drop = float(theta[PLACE[INERTANCE]]), float(theta[PLACE[DROP]])
        viscous = viscous_friction(self.crane) * math.exp(float(theta[PLACE[VISCOUS]]))
        rows[PLACE[DROP]] = rows[PLACE[VISCOUS]] * self._line_friction / viscous
        rows[PLACE[INERTANCE]] = rows[PLACE[INERTIA]] * BOTH_LINES * math.exp(-float(theta[PLACE[INERTIA]]))
        flows, flow_rows = (
            {OMEGA: self.D_m * x[..., OMEGA], ALPHA_P: self.Q_full * x[..., ALPHA_P]} for x in (runs, rows)
        )  # of motors and pumps (n,) [m^3/s], and their derivatives (p, n)
        for k, sign in SIDES:
            share = 1.0 / (1.0 + np.exp((runs[:, k] - self.held) / HELD_OVER))
            motors, pumps = share + (1.0 - share) * SPLIT**2, (1.0 - share) * SPLIT * (1.0 - SPLIT)
            Q, Q_rows = (motors * x[OMEGA] + pumps * x[ALPHA_P] for x in (flows, flow_rows))
            rate, rates = (
                motors * np.gradient(x[OMEGA], t, axis=-1) + pumps * np.gradient(x[ALPHA_P], t, axis=-1)
                for x in (flows, flow_rows)
            )
            rows[:, :, k] += sign * (drop / self.Q_full * Q_rows + inertance * self.inertance * rates)
            rows[PLACE[DROP], :, k] += sign * Q / self.Q_full
            rows[PLACE[INERTANCE], :, k] += sign * self.inertance * rate
            y[:, k] += sign * (drop / self.Q_full * Q + inertance * self.inertance * rate)
        for k, name in enumerate(SIGNALS):
            if name in DELAYS:
                self._lag(t, y, rows, k, PLACE[DELAYS[name]], float(theta[PLACE[DELAYS[name]]]))
            if name in OFFSETS:
                rows[PLACE[OFFSETS[name]], :, k] = 1.0
                y[:, k] += theta[PLACE[OFFSETS[name]]]
        return y

    @staticmethod
    def _lag(t: FloatArray, y: FloatArray, rows: FloatArray, k: int, i: int, by: float) -> None:
        """Signal k as shown by a sensor with a delay [s]; i: place of the parameter."""
        rows[i, :, k] = -np.gradient(y[:, k], t)
        late = t - by
        for row in rows[:, :, k]:
            row[:] = np.interp(late, t, row)
        y[:, k] = np.interp(late, t, y[:, k])

    def outputs(self, theta: FloatArray) -> tuple[FloatArray, ...]:
        """Outputs at some parameters as the sensors show them, (n, SIGNALS) for each stretch."""
        runs = repeated([self.bent(theta)], self._late([float(theta[PLACE[COMMAND_DELAY]])]), self.n_sub)
        return tuple(
            self._sensed(s.t, r[0], np.zeros((len(NAMES), *r.shape[1:])), theta)
            for s, r in zip(self.time_segments, runs, strict=True)
        )

    def best_start(self) -> FloatArray:
        """The point of a grid over C_h, J and leakage whose outputs are nearest: an oscillation out of phase by half a
        period would mislead the steps."""
        grid = [
            (a - b, max(a + b, 0.9 * self.least_J), c) for a, b, c in itertools.product(PERIODS, STIFFNESSES, LEAKS)
        ]
        cranes = [bent(self.crane, {C_H: x, INERTIA: y, C_LEAK: z}) for x, y, z in grid]
        runs = repeated(cranes, [[s] * len(cranes) for s in self.time_segments], self.n_sub)
        signals = [each[:, :, k] for each in runs for k in range(len(SIGNALS))]
        ends = np.cumsum([signal.shape[1] for signal in signals])[:-1]
        cost = np.sum([_misfit(x, y) for x, y in zip(signals, np.split(self.measured, ends), strict=True)], axis=0)
        theta = np.zeros(len(NAMES))
        for e in EXTRAS:
            theta[PLACE[e.name]] = max(0.0, e.low + 0.05 * e.spread) if e.low >= 0.0 else 0.0
        for name, x in zip((C_H, INERTIA, C_LEAK), grid[int(np.argmin(cost))], strict=True):
            theta[PLACE[name]] = x
        return theta


def _compared(time_segment: DynamicsSegment, cluster: NDArray[np.int64], name: str) -> FloatArray:
    """The measured samples of a signal that count, NaN elsewhere."""
    if name not in time_segment.measured:
        return np.full(len(time_segment.t), np.nan)
    return np.where(time_segment.counted & (cluster >= 0), time_segment.measured[name], np.nan)


def _misfit(runs: FloatArray, y: FloatArray) -> FloatArray:
    """Mean square of every run's deviation over the variance of the measured signal; 0 where it was not logged."""
    ok = np.isfinite(y)
    if not ok.any():
        return np.zeros(len(runs))
    d = np.where(np.isfinite(runs[:, ok]), runs[:, ok] - y[ok], 1e9)
    out: FloatArray = np.mean(d**2, axis=1) / max(float(np.var(y[ok])), 1e-30)
    return out
