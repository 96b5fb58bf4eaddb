"""Simulation of a test of the winch's dynamics: the twin driven by the measured commands, many cranes side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.control.registry import MANUAL_MODE
from stillhook.engine.arguments import SERIES_STEP, check_step, substeps
from stillhook.engine.pack.winch import drum_record, pack
from stillhook.engine.runner import Run
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.errors import SpecError
from stillhook.kernels.lanes import VL
from stillhook.physics.load_path.drum import layer_diameter, layers_filled
from stillhook.sea.motion.motion import Motion, Still
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Commands, Scenario
from stillhook.validate.data_set.record import JOIN, Record, Segment, Transient, filled, smoothed
from stillhook.validate.data_set.signals import smooth_tip

SIGNALS = ("p_a", "p_b", "omega_m", "alpha_p")
"""What is compared: the twin's series of these names."""
TIP = ("s_tip", "v_tip")
SMOOTH = 0.03
"""Centred mean before signals are compared and peaks detected [s]: a twentieth of the winch's period, and three samples
of a PLC's log."""
SETTLE = 2.0
"""Start of a stretch that is not compared where the winch does not start at rest, as the twin does [s]: four of its
periods."""
MOVES = 0.02
"""Command of the pumps above which the winch does not start at rest [-]."""
THREADS = 2
"""Of the search for where to start, whose runs make several blocks; each block is what it is by one."""
MOST_FINE = 5
"""Halvings of the step that are tried for a crane with little oil in its lines."""
TIP_MOVES = 0.05
"""Peak-to-peak tip motion below which the tip counts as still [m]."""
TIP_OVER = 0.5
"""Time over which the tip is averaged for that [s]: far below a wave's period, far above its sensor's noise."""


@dataclass(frozen=True)
class DynamicsSegment:
    """An uninterrupted part of a test that the twin repeats: t (n,) [s from its start]; first: its first sample in the
    record; measured: those of SIGNALS that were logged (n,), NaN where unknown; counted (n,): samples that are
    compared; case: with the measured commands."""

    record: Record
    segment: Segment
    t: FloatArray
    first: int
    measured: Mapping[str, FloatArray]
    counted: NDArray[np.bool_]
    case: Scenario

    @property
    def u_m(self) -> FloatArray:
        """Commands of the motors' displacement, one a PLC cycle."""
        assert self.case.commands is not None
        return self.case.commands.u_m

    def holds(self, turn: Transient) -> bool:
        """Whether a turn is completely inside this segment."""
        inside = self.first <= turn.first and turn.last <= self.first + len(self.t)
        return turn.test == self.record.test.name and inside


def dynamics_segment(crane: Crane, record: Record, segment: Segment, first: int, last: int) -> DynamicsSegment:
    """Samples [first, last) of a segment; the record must have u_p, and u_m or alpha_m."""
    part = slice(first, last)
    t = record.t[part] - record.t[first]
    u_p, u_m = (filled(record.signals[name][part]) for name in ("u_p", motor_command(record)))
    s_w = filled(record.signals["s_w"][part])[0] if record.has("s_w") else segment.s_w
    at_rest = float(np.max(np.abs(u_p[: max(1, round(JOIN / record.step))]))) < MOVES
    case = Scenario(
        name=record.test.name,
        load=f"{segment.load!r} kg",
        s_w=f"{max(float(s_w), 0.0)!r} m",
        mode=MANUAL_MODE,
        ramp="0 s",
        warm_up="0 s",
        tip=tip_motion({name: record.signals[name][part] for name in TIP if record.has(name)}, t, record.test.name),
        commands=logged_commands(crane, t, u_p, u_m),
    )
    return DynamicsSegment(
        record, segment, t, first, _measured(crane, record, part), t >= (0.0 if at_rest else SETTLE), case
    )


def logged_commands(crane: Crane, t: FloatArray, u_p: FloatArray, u_m: FloatArray) -> Commands:
    """The commands of every PLC cycle; between the samples of a slower log, on the line between them."""
    cycles = np.arange(round(t[-1] / crane.control.t_cycle) + 1) * crane.control.t_cycle
    return Commands(cycles, np.clip(np.interp(cycles, t, u_p), -1.0, 1.0), np.clip(np.interp(cycles, t, u_m), 0.0, 1.0))


def motor_command(record: Record) -> str:
    """The signal for the command of the motors' displacement: u_m, or the measured setting where it was not logged."""
    return "u_m" if record.has("u_m") else "alpha_m"


def tip_motion(signals: Mapping[str, FloatArray], t: FloatArray, test: str) -> Motion:
    """The tip's motion as logged, smooth; a tip at rest is constant: its sensor's noise would shake the hook on the
    short wire. t (n,) even [s]."""
    s = signals.get("s_tip", np.full(len(t), np.nan))
    step = float(t[-1]) / max(len(t) - 1, 1)
    if not np.isfinite(s).any() or np.ptp(smoothed(filled(s), step, TIP_OVER)) < TIP_MOVES:
        return Still()
    return smooth_tip(t, s, signals.get("v_tip"), place=f'test "{test}"').motion


def _measured(crane: Crane, record: Record, part: slice) -> dict[str, FloatArray]:
    """The signals to compare; motor speed from the wire's where it was not logged itself."""
    out = {name: record.signals[name][part] for name in SIGNALS if record.has(name)}
    if "omega_m" not in out and record.has("v_w", "s_w"):
        drum = drum_record(crane)
        wire_on_drum = drum.L_full - filled(record.signals["s_w"][part])
        d = np.array([layer_diameter(layers_filled(float(x), drum), drum) for x in wire_on_drum])
        out["omega_m"] = record.signals["v_w"][part] * 2.0 * crane.i_hD / d
    return out


def steps_per_cycle(crane: Crane, time_segment: DynamicsSegment) -> int:
    """Steps per PLC cycle: the default of runs with series, or as many more as the crane's fastest mode requires.
    Errors: SpecError where MOST_FINE times as many do not do."""
    packed, t_cycle = pack(crane, time_segment.case), crane.control.t_cycle
    for finer in range(MOST_FINE):
        n_sub = substeps(t_cycle, SERIES_STEP * 0.5**finer)
        try:
            check_step(packed, t_cycle / n_sub)
        except SpecError:
            if finer + 1 == MOST_FINE:
                raise
        else:
            return n_sub
    raise AssertionError


def delayed(time_segment: DynamicsSegment, by: float) -> DynamicsSegment:
    """A stretch whose commands come later [s]; a part of a cycle is shared between two cycles."""
    commands = time_segment.case.commands
    if by == 0.0 or commands is None:
        return time_segment
    late = Commands(commands.times, np.interp(commands.times - by, commands.times, commands.u_p), commands.u_m)
    return replace(time_segment, case=time_segment.case.model_copy(update={"commands": late}))


def repeated(
    cranes: Sequence[Crane], time_segments: Sequence[Sequence[DynamicsSegment]], n_sub: int
) -> list[FloatArray]:
    """The twin for every crane, side by side: one array (cranes, n, SIGNALS) a stretch, on its samples; NaN from where
    a run loses its numbers. time_segments: for each the form that each crane runs; n_sub: steps per PLC cycle."""
    cases = [s.case for row in time_segments for s in row]
    machines = list(cranes) * len(time_segments)
    results = run_cases(machines, cases, step=n_sub, lanes=VL, every=1, keep=unchanged, threads=THREADS)
    out = []
    for i, row in enumerate(time_segments):
        rows = results[i * len(cranes) : (i + 1) * len(cranes)]
        out.append(np.stack([on_samples(r, SIGNALS, row[0].t) for r in rows]))
    return out


def on_samples(run: Run, names: Sequence[str], t: FloatArray) -> FloatArray:
    """Signals of a run at the times t (n,) [s]: (n, names)."""
    assert run.series is not None
    grid = np.arange(len(run.series)) * run.dt
    return np.column_stack([np.interp(t, grid, run.series[:, run.signals.index(name)]) for name in names])
