"""Operability maps: error, pressure and limits of several controllers over load and speed, and where each cannot be
used, and why."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from stillhook.analysis.axes import LOADS, PERIOD, SPEEDS, Axes, Texts, axes_of
from stillhook.analysis.controllers import Controller, learning_time
from stillhook.analysis.controllers import controllers as controllers_of
from stillhook.analysis.maps.result import Map, as_dataset, cause_of
from stillhook.base.progress import Progress, begin
from stillhook.engine.scenario.checks import notes_of
from stillhook.engine.scenario.summary import numbers_of
from stillhook.engine.simulate import raise_refused, run_cases
from stillhook.errors import Cancelled, ScenarioError
from stillhook.sea.motion.motion import Motion, Sine
from stillhook.sea.motion.text import scaled_to, speed_peak
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Scenario
from stillhook.units import parse, show

DURATION, WARM_UP = "30 s", "10 s"
"""Paper E neglects the first 10 s and counts 20 s (section 4.1, figure 6)."""
RAMP = 10.0
"""Time in which the tip's motion grows to full size [s], or the warm-up where that is shorter."""
NUMBERS = (
    "e_c_pp",
    "eta_c",
    "p_max",
    "p_a_max",
    "alpha_m_min",
    "alpha_p_max",
    "u_p_max",
    "saturation_time",
    "relief_time",
    "validated",
)
"""What a map holds of every cell's run, in the names of `stillhook.variables.SUMMARY`, where the winch type has it."""


def map_of(
    crane: Crane,
    controllers: Sequence[str | Path | Controller] | None = None,
    *,
    loads: Texts = LOADS,
    speeds: Texts = SPEEDS,
    period: str = PERIOD,
    motion: Motion | None = None,
    s_w: str | None = None,
    layers: int | Sequence[int] | None = None,
    periods: Texts | None = None,
    duration: str = DURATION,
    warm_up: str = WARM_UP,
    step: str | None = None,
    threads: int = 2,
    store: str | Path | None = None,
    client: Any = None,
    progress: Progress | None = None,
) -> Map:
    """One run for every controller, load and speed (and layer, and period), statistics alone.

    This is `operability_map` before it is made a Dataset, with its parameters and errors.
    """
    axes, chosen, cranes, cases = cells_of(
        crane,
        controllers,
        loads=loads,
        speeds=speeds,
        period=period,
        motion=motion,
        s_w=s_w,
        layers=layers,
        periods=periods,
        duration=duration,
        warm_up=warm_up,
    )
    begin(progress, "map")

    def map_from(rows: Mapping[int, Mapping[str, Any]]) -> Map:
        answers = [rows.get(i, NOT_RUN) for i in range(len(cases))]
        return _map(crane, axes, chosen, cranes, cases, answers, _words(motion, period, periods is not None))

    try:
        options: dict[str, Any] = {"threads": threads, "store": store, "client": client, "progress": progress}
        rows = run_cases(cranes, cases, step=step, mark=True, **options)
        raise_refused(rows)
    except Cancelled as stopped:
        raise stopped.then(map_from) from None
    return map_from(dict(enumerate(rows)))


NOT_RUN: Mapping[str, Any] = defaultdict(lambda: math.nan, status="not run")
"""Summary of a cell that a cancelled map has not run."""


def _map(
    crane: Crane,
    axes: Axes,
    chosen: Sequence[Controller],
    cranes: Sequence[Crane],
    cases: Sequence[Scenario],
    answers: Sequence[Mapping[str, Any]],
    motion: str,
) -> Map:
    """The summaries of all cells as a map."""
    names = [name for name in NUMBERS if name in numbers_of(crane)]
    modes = [c.mode for c in chosen for _ in range(math.prod(axes.shape))]
    causes = [
        "not run" if s is NOT_RUN else cause_of(crane, s, m, k.load)
        for s, m, k in zip(answers, modes, cases, strict=True)
    ]
    rows = [
        {"cause": cause, **{name: s[name] for name in ("status", *names)}}
        for cause, s in zip(causes, answers, strict=True)
    ]
    about = {
        "speed_is": "peak speed of the tip",
        "motion": motion,
        "duration": cases[0].duration,
        "warm_up": cases[0].warm_up,
        "notes": notes_of(cranes, cases),
    }
    return Map.of(crane, chosen, axes, names, rows, "e_c_pp", about)


operability_map = as_dataset(
    map_of,
    "operability_map",
    """Error, pressure and limits of controllers over load and peak speed of the tip.

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
        Peak speeds of the tip, likewise; default "10 m/min to 120 m/min by 10 m/min".
    period : str, default "12 s"
        Of the sine that is the motion by default.
    motion : Motion, optional
        Another motion, made larger or smaller in every cell until its highest speed between warm_up and duration is the
        cell's; its times stay.
    s_w : str, optional
        Wire paid out, such as "100 m"; default to the middle of the layer.
    layers : int or sequence of int, optional
        One layer sets the wire and adds no dimension, a list adds one; default the outermost. Not together with s_w.
    periods : str or sequence of str, optional
        Periods of the sine as a further dimension.
    duration : str, default "30 s"
        Length of each run; that and the warm-up of all are 40 s longer where one of the controllers learns.
    warm_up : str, default "10 s"
        Start of each run that does not count.
    step : str, optional
        Integration step, such as "2 ms"; default as in `stillhook.simulate`.
    threads : int, default 2
        Threads that share the runs.
    store : str or Path, optional
        Folder in which statistics are kept as they finish, so that an interrupted run continues; as in
        `stillhook.simulate`.
    client : dask.distributed.Client, optional
        Cluster that shares the runs, with the same numbers.
    progress : callable or Monitor, optional
        Called with the share done, 0 to 1; a `stillhook.Monitor` gets events and can cancel.

    Returns
    -------
    Dataset
        Over ("controller", "load", "speed"[, "layer"][, "period"]): the numbers of `NUMBERS`, `status`, `applicable`
        and `cause`; in addition to the requested controllers, "best classic" (cell by cell the applicable one of NS and
        HS with the lower error), and `e_c_pp_change`, `p_max_change` against it.

    Raises
    ------
    ScenarioError, UnitError, SpecError, MotionError
        One line each, before anything runs.
    Cancelled
        When the token of the monitor is set; the cells of its `partial` that were not run have the cause "not run".

    Notes
    -----
    The peak-to-peak error is that of the part that counts, at most of 30 s. The tip's motion grows over the first 10 s,
    or over the warm-up where that is shorter. Paper E's velocity profile (figure 6) is not printed as numbers.
    Source: Moslatt 2020 paper E section 4.
    """,
)


class Cells(NamedTuple):
    """Axes and controllers of a map, and crane and scenario of every cell: controller by controller, the last axis
    fastest."""

    axes: Axes
    controllers: list[Controller]
    cranes: list[Crane]
    cases: list[Scenario]


def cells_of(
    crane: Crane,
    controllers: Sequence[str | Path | Controller] | None = None,
    *,
    loads: Texts = LOADS,
    speeds: Texts = SPEEDS,
    period: str = PERIOD,
    motion: Motion | None = None,
    s_w: str | None = None,
    layers: int | Sequence[int] | None = None,
    periods: Texts | None = None,
    duration: str = DURATION,
    warm_up: str = WARM_UP,
) -> Cells:
    """What a map runs; parameters and errors as in `map_of`."""
    axes = axes_of(crane, loads, speeds, s_w=s_w, layers=layers, periods=periods)
    chosen = controllers_of(crane.plant.type.usual_modes if controllers is None else controllers)
    base = Scenario(load="0 t", s_w="0 m", duration=duration, warm_up=warm_up)
    ramp, learning = min(RAMP, base.warm_up), learning_time(Mode(c.mode) for c in chosen)
    longer = {"duration": base.duration + learning, "warm_up": base.warm_up + learning}
    base = base.model_copy(update={"ramp": ramp} | longer)
    waves = _waves(base, axes, period, periods is not None, motion)
    return Cells(axes, chosen, *_runs(crane, chosen, axes, base, waves))


def _waves(
    base: Scenario, axes: Axes, period: str, over_periods: bool, motion: Motion | None
) -> dict[tuple[float, float | None], Motion]:
    """The tip's motion for every speed and period."""
    if motion is not None:
        if over_periods:
            raise ScenarioError("motion and periods: a motion has its own periods. Choose one of them.")
        if motion.duration is not None and motion.duration < base.duration:
            raise ScenarioError(
                f"motion: {motion.duration:g} s of record do not fill runs of {base.duration:g} s. Shorten the"
                " duration."
            )
        largest = speed_peak(motion, base.warm_up, base.duration)
        unit = scaled_to(motion, 1.0, base.warm_up, base.duration) if largest > 0.0 else motion
        return {(v, None): scaled_to(unit, v, base.warm_up, base.duration) for v in axes.speeds}
    waves: dict[tuple[float, float | None], Motion] = {}
    counted = base.duration - base.warm_up
    for T in axes.periods:
        wave = parse(period, "time", "period") if T is None else T
        if not wave > 0.0:
            raise ScenarioError(f"period {show(wave, 'time')}: must be above 0.")
        if wave > counted:
            raise ScenarioError(
                f"period {show(wave, 'time')}: a complete wave must be within the {counted:g} s that count"
                " (duration less warm-up). Run longer, or choose a shorter wave."
            )
        waves |= {
            (v, T): Sine.from_si(v * wave / (2.0 * math.pi), wave, where=f"speed {show(v, 'speed')}")
            for v in axes.speeds
        }
    return waves


def _runs(
    crane: Crane,
    chosen: Sequence[Controller],
    axes: Axes,
    base: Scenario,
    waves: dict[tuple[float, float | None], Motion],
) -> tuple[list[Crane], list[Scenario]]:
    """Crane and scenario of every cell, controller by controller."""
    cranes, cases = [], []
    for c in chosen:
        machine = c.on(crane)
        for load, v, s_w, T in axes.cells():
            cranes.append(machine)
            cases.append(base.model_copy(update={"load": load, "s_w": s_w, "tip": waves[v, T], "mode": Mode(c.mode)}))
    return cranes, cases


def _words(motion: Motion | None, period: str, over_periods: bool) -> str:
    """The motion of a map in words."""
    if motion is not None:
        return f"{motion.describe()}, scaled to the peak speed"
    return "sine" if over_periods else f"sine of {show(parse(period, 'time', 'period'), 'time')}"
