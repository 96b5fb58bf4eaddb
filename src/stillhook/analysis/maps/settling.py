"""Settling time after a step of wire speed, over load and speed, and the displacement of the motors after it (paper E
figures 9 to 11)."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.analysis.axes import LOADS, SPEEDS, Axes, Texts, axes_of
from stillhook.analysis.controllers import Controller
from stillhook.analysis.controllers import controllers as controllers_of
from stillhook.analysis.maps.result import Map, as_dataset, cause_of, saturated
from stillhook.analysis.steady.steady_state import layer_row
from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.engine.scenario.checks import notes_of
from stillhook.engine.scenario.summary import ScenarioRun
from stillhook.engine.simulate import run_cases
from stillhook.engine.tasks.carried import kept_on_workers
from stillhook.errors import ScenarioError
from stillhook.kernels.lanes import VL
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Operator, Scenario
from stillhook.units import parse, show

STEP = "5 m/min"
BAND = 0.02
"""Step of the wire speed, and how near to the new speed is settled, over the step. Source: paper E section 4.3 (0.1
m/min)."""
RAMP, HOLD, AFTER = 8.0, 22.0, 15.0
"""Time in which the operator's speed grows to that before the step, time for which it is then held, and time after the
step [s]. The slowest mode is the position loop's, 1 / (K_p v_w) = 3 to 5 s at the printed gain: 22 s bring what the
ramp left behind
below the band."""
PIECES = 16
"""Straight pieces of the ramp, which follow a smoothstep: its corners are then a hundredth of those of a straight
ramp."""
LAST = 2.0
"""End of the test over which an oscillation is distinguished from a slow approach, and full pumps from pumps that were
full for a moment [s]."""
NUMBERS = ("settling_time", "overshoot", "alpha_m_end", "u_p_end")


class Response(NamedTuple):
    """Response to a step: settling_time [s], NaN where it never settles; overshoot over the step [-]; alpha_m_end
    motors (NaN where the winch has no such signal) and u_p_end pump command at the end [-]; status as in a summary;
    cause why the controller is not applicable, "" where it is."""

    settling_time: float
    overshoot: float
    alpha_m_end: float
    u_p_end: float
    status: str
    cause: str


def settling_of(
    crane: Crane,
    controllers: Sequence[str | Path | Controller] | None = None,
    *,
    loads: Texts = LOADS,
    speeds: Texts = SPEEDS,
    wire_step: str = STEP,
    lowering: bool = False,
    s_w: str | None = None,
    layers: int | Sequence[int] | None = None,
    step: str | None = None,
    threads: int = 2,
    client: Any = None,
    progress: Progress | None = None,
) -> Map:
    """A step of the wire's speed at every load and speed, in heave compensation with the tip at rest.

    This is `settling_map` before it is made a Dataset, with its parameters and errors.
    """
    axes = axes_of(crane, loads, speeds, s_w=s_w, layers=layers)
    chosen = controllers_of(crane.plant.type.usual_modes if controllers is None else controllers)
    dv = parse(wire_step, "speed", "wire_step")
    if dv <= 0.0:
        raise ScenarioError(f'wire_step = "{wire_step}": must be above 0.')
    _check_room(crane, axes, dv, s_w is None)
    cranes, cases = _runs(crane, chosen, axes, dv, lowering)
    answers: list[Response] = run_cases(
        cranes,
        cases,
        step=step,
        every=1,
        lanes=VL,
        keep=functools.partial(response, dv=dv),
        threads=threads,
        client=client,
        progress=progress,
    )
    motors = any(row.name == "alpha_m" for row in crane.plant.type.rows)
    about = {
        "speed_is": "wire speed before the step",
        "wire_step": dv,
        "lowering": lowering,
        "duration": RAMP + HOLD + AFTER,
        "notes": notes_of(cranes, cases),
    }
    names = [name for name in NUMBERS if name != "alpha_m_end" or motors]
    return Map.of(crane, chosen, axes, names, [a._asdict() for a in answers], "settling_time", about)


settling_map = as_dataset(
    settling_of,
    "settling_map",
    """Settling time and displacement after a step of wire speed, in heave compensation with the tip at rest.

    Parameters
    ----------
    crane : Crane
        The machine.
    controllers : sequence of str, Path or Controller, optional
        Names, paths of TOML files (`stillhook.analysis.controller`) or Controller objects; default the crane's usual
        ones.
    loads : str or sequence of str
        Payloads with units; several with commas between them, or a range. They may be parts of the SWL; default "20 %
        to 100 % by 10 %".
    speeds : str or sequence of str
        Speeds before the step, likewise; default "10 m/min to 120 m/min by 10 m/min".
    wire_step : str, default "5 m/min"
        Size of the step.
    lowering : bool, default False
        Pay out instead of hoisting.
    s_w : str, optional
        Wire paid out, such as "100 m"; default to the middle of the layer.
    layers : int or sequence of int, optional
        One layer sets the wire and adds no dimension, a list adds one; default the outermost. Not together with s_w.
    step : str, optional
        Integration step; default 2 ms.
    threads : int, default 2
        Threads that share the runs.
    client : dask.distributed.Client, optional
        Cluster that shares the runs, with the same numbers.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Dataset
        Over ("controller", "load", "speed"[, "layer"]): the numbers of `NUMBERS` (without `alpha_m_end` where the winch
        has no motors of variable displacement), `status`, `applicable`, `cause`, and `settling_time_change` against the
        best classic controller (the applicable one of NS and HS that settles first).

    Raises
    ------
    ScenarioError, UnitError, SpecError
        One line each; ScenarioError also where the wire of a layer is too short for the test.

    Notes
    -----
    The operator's speed grows smoothly to that of the cell, is held until the winch is steady, and steps up by
    `wire_step`; v_w has settled when it stays within 2 % of the step of the new speed. The gas pressure is held, so
    that the accumulator never runs empty, and the step is made in the middle of the layer (or with s_w of wire out),
    far enough from its ends. Memory is bounded: of a test nothing but its response is kept.

    The operator's acceleration is not fed forward: u_ff takes v_op alone, so K_2 plays no part and the pumps' own lag
    is in the answer.

    Source: Moslatt 2020 paper E section 4.3, figures 9 to 11; neither the direction nor the time before the step is
    printed.
    """,
)


def _check_room(crane: Crane, axes: Axes, dv: float, in_middle: bool) -> None:
    """The test stays on one layer, so that no change of gear disturbs it."""
    v = axes.speeds[-1]
    before, after = v * (0.5 * RAMP + HOLD), (v + dv) * AFTER
    if not in_middle:
        return
    for layer in axes.layers:
        n = crane.drum.layers if layer is None else layer
        half = 0.5 * float(layer_row(crane, n)["wire_length"])
        if max(before, after) > half:
            raise ScenarioError(
                f"speed {show(v, 'speed')}: the test takes {show(before, 'length')} of wire before the step, and layer"
                f" {n} of "
                f'"{crane.name}" has {show(half, "length")} on either side of its middle. Lower the speed.'
            )


def operator_of(v: float, dv: float, lowering: bool) -> Operator:
    """The joystick of one test: a smooth ramp to v, held, then v + dv [m/s]; hoisting unless lowering."""
    sign = -1.0 if lowering else 1.0
    x = [i / PIECES for i in range(PIECES + 1)]
    rise = [(RAMP * i, v * i * i * (3.0 - 2.0 * i)) for i in x]
    points = [*rise, (RAMP + HOLD, v), (RAMP + HOLD, v + dv), (RAMP + HOLD + AFTER, v + dv)]
    return Operator(profile=tuple((f"{t!r} s", f"{sign * u!r} m/s") for t, u in points))


def _runs(
    crane: Crane, chosen: Sequence[Controller], axes: Axes, dv: float, lowering: bool
) -> tuple[list[Crane], list[Scenario]]:
    """Crane and scenario of every cell, controller by controller."""
    joysticks = {v: operator_of(v, dv, lowering) for v in axes.speeds}
    length = RAMP + HOLD + AFTER
    base = Scenario(
        load="0 t",
        s_w="0 m",
        duration=f"{length!r} s",
        warm_up=f"{RAMP + HOLD!r} s",
        gas_held="passive" in crane.circuits,
    )
    cranes, cases = [], []
    for c in chosen:
        machine = c.on(crane)
        for load, v, s_w, _ in axes.cells():
            path = v * (0.5 * RAMP + HOLD)
            start = s_w - path if lowering else s_w + path
            cranes.append(machine)
            cases.append(base.model_copy(update={"load": load, "s_w": start, "operator": joysticks[v], "mode": c.mode}))
    return cranes, cases


@kept_on_workers
def response(run: ScenarioRun, dv: float) -> Response:
    """One test's response to a step dv [m/s], with the cause where it did not settle."""
    import xarray  # heavy: other maps print without it

    from stillhook.metrics import settled_after

    assert run.series is not None
    (_, before), (at, _) = run.case.operator.profile[-3:-1]
    rise = (run.column("v_w")[round(at / run.dt) :] - before) * (1.0 if before >= 0.0 else -1.0)
    data = xarray.Dataset({"v_w": ("time", rise)}, coords={"time": np.arange(len(rise)) * run.dt})
    t = float(settled_after(data, start=0.0, target=dv, step=dv, band=BAND))
    end = dict(zip(run.signals, run.series[-1].tolist(), strict=True))
    settled = math.nan if run.diverged or not np.isfinite(rise).all() else t
    cause = cause_of(run.crane, run.summary, run.case.mode, run.case.load) or (
        ""
        if math.isfinite(settled)
        else _invalid_reason(rise, dv, run.dt, saturated(run.crane) if abs(end["u_p"]) >= 1.0 else "")
    )
    return Response(
        settling_time=settled,
        overshoot=float(np.max(rise)) / dv - 1.0,
        alpha_m_end=end.get("alpha_m", math.nan),
        u_p_end=abs(end["u_p"]),
        status=run.summary["status"],
        cause=cause,
    )


def _invalid_reason(v: FloatArray, dv: float, dt: float, saturation: str) -> str:
    """Why a run without a limit passed never settles; saturation in words where the command is at its end."""
    last, band = v[-round(LAST / dt) :], BAND * dv
    if saturation:
        return saturation
    if abs(v[0]) > band:
        return "not steady before the step"
    if float(np.ptp(last)) > 2.0 * band:
        return "keeps swinging"
    return f"slower than {AFTER:g} s"
