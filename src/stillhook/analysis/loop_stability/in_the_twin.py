"""Margins of a controller in the complete twin in waves: by how much the gain may rise, or a command come later, until
a disturbance no longer dies out or the control error grows by half.

Nothing is linearised: friction, saturation, valves, noise and what the controller learns are all in it. A disturbance
is a step of the reference; a run with it and one without it have the same waves and noise, so the difference of their
control errors is what the loop makes of the disturbance alone. In waves the winch passes through every speed: where
the linearised loop swings at one of them, the difference need not grow over a wave.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.control.sensor_errors import RING
from stillhook.engine.pack.settings import with_value
from stillhook.engine.pack.winch import set_up_for
from stillhook.engine.scenario.summary import OSCILLATES, ScenarioRun
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.errors import StillhookError
from stillhook.kernels.lanes import VL
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

GROWS = 1.5
"""Control error over the least at a smaller gain or delay, from which it counts as grown [-]."""
STEP = 0.02
"""Step of the reference by default [m]."""
STAYS, LEAST, FALLS = 0.05, 0.002, 0.9
"""What is left of a step in the last third of the time behind it, over the step, from which it has not died out, and
below which it has [-]; between the two it has where that is less than this part of what the third before had [-]."""
MOST_FACTOR, LEAST_DELAY = 16.0, 5e-3
"""Largest factor on K_p [-] and shortest extra delay [s] that are run."""
VALUES = 8
"""Values side by side, each with a disturbance and without."""
IN_THE_LOOP = ("u_p", "x_v")
"""Commands that position feedback acts by: of pumps, or of a valve."""
SPACING = 5
"""PLC cycles between samples of the control error."""


class Until(NamedTuple):
    """Value from which the control error has grown by half, and from which a disturbance stays: infinite where neither
    happens up to the largest value that was run, NaN of what a winch type does not have."""

    error: float
    swings: float


class TwinMargins(NamedTuple):
    """Of a controller in a sea: factor on K_p [-]; extra delay of the command that position feedback acts by [s];
    e_c_pp control error as it is [m]. A factor of 1 or a delay of 0: a disturbance stays as it is, or has not the time
    to die out."""

    factor: Until
    delay: Until
    e_c_pp: float


def twin_margins(
    crane: Crane, case: Scenario, *, step: float = STEP, delays: bool = True, threads: int = 2
) -> TwinMargins:
    """Margins in the twin under the controller of a case, in its waves and with its sensors; step the disturbance [m];
    delays: whether delays are run too, NaN where not.

    The PLC knows the machine as the file has it: of the extra delay it knows nothing, and its feedforward is as late as
    its feedback. The delay is a dead time of the pumps' controls (of the valve), up to RING PLC cycles in all.

    Values are those of a ladder of `VALUES` rungs, and of as many again in the rung that they are in: a factor is
    accurate to 5 %.
    Errors: StillhookError for a case whose reference is stepped already, or whose controller does not compensate.
    """
    if case.operator.steps or not case.mode.compensates:
        raise StillhookError("Margins in the twin need a case that compensates, without steps of its reference.")

    def stronger(factor: float) -> Crane:
        control = crane.control.model_copy(update={"K_p": factor * crane.control.K_p})
        return crane.model_copy(update={"control": control})

    factor, e_c_pp = _until(stronger, np.geomspace(1.0, MOST_FACTOR, VALUES), case, step, threads)
    command = next((u for u in IN_THE_LOOP if u in crane.plant.type.SERVOS), None)
    if command is None or not delays:
        return TwinMargins(factor, Until(math.nan, math.nan), e_c_pp)
    path, own = crane.plant.type.SERVOS[command][0], crane.plant.type.dead_times(crane)[command]
    most = RING * crane.control.t_cycle - crane.control.computing - own

    def later(delay: float) -> Crane:
        return set_up_for(with_value(crane, f"{path}.dead_time", own + delay), crane)

    rungs = np.array([0.0, *np.geomspace(min(LEAST_DELAY, 0.5 * most), most, VALUES - 1)])
    return TwinMargins(factor, _until(later, rungs, case, step, threads)[0], e_c_pp)


def _until(
    machine: Callable[[float], Crane], rungs: FloatArray, case: Scenario, step: float, threads: int
) -> tuple[Until, float]:
    """Values from which the error has grown and from which a disturbance stays, and the error at the first rung [m]."""
    error, stays = _looked_at([machine(x) for x in rungs], case, step, threads)
    rung = [_first(error >= GROWS * np.fmin.accumulate(error)), _first(stays)]
    values = np.unique([np.linspace(rungs[i - 1], rungs[i], VALUES + 2)[1:-1] for i in rung if i])
    least = np.fmin.accumulate(error)[max((rung[0] or 0) - 1, 0)]
    finer, still = _looked_at([machine(x) for x in values], case, step, threads) if len(values) else (values, values)

    def least_value(i: int | None, beyond: BoolArray) -> float:
        if not i:
            return math.inf if i is None else float(rungs[i])
        within = values[beyond & (values > rungs[i - 1]) & (values < rungs[i])]
        return float(within[0] if len(within) else rungs[i])

    return Until(least_value(rung[0], finer >= GROWS * least), least_value(rung[1], still)), float(error[0])


def _first(beyond: BoolArray) -> int | None:
    return int(np.argmax(beyond)) if beyond.any() else None


def _looked_at(machines: Sequence[Crane], case: Scenario, step: float, threads: int) -> tuple[FloatArray, BoolArray]:
    """Of each machine the control error [m], infinite where a run lost its numbers, and whether a disturbance stays."""
    stepped = case.operator.model_copy(update={"steps": ((case.warm_up, step),)})
    disturbed = case.model_copy(update={"operator": stepped})
    runs: list[ScenarioRun] = run_cases(
        [*machines, *machines],
        [*(case for _ in machines), *(disturbed for _ in machines)],
        every=SPACING,
        keep=unchanged,
        lanes=VL,
        threads=threads,
    )
    n = len(machines)
    error = np.array([math.inf if run.diverged else float(run.row["e_c_pp"]) for run in runs[:n]])
    return error, np.array([_stays(run, other, case, step) for run, other in zip(runs[:n], runs[n:], strict=True)])


def _stays(run: ScenarioRun, disturbed: ScenarioRun, case: Scenario, step: float) -> bool:
    """Whether a disturbance has not died out, or the winch swings without one."""
    if run.diverged or disturbed.diverged or OSCILLATES in str(run.row["status"]):
        return True
    apart = np.abs(disturbed.column("e_c") - run.column("e_c"))[round(case.warm_up / run.dt) :]
    middle, late = (float(part.max()) / step for part in np.array_split(apart, 3)[1:])
    return late > STAYS or (late > LEAST and late > FALLS * middle)
