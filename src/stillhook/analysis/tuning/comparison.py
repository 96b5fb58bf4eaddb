"""Controllers with their best tuning side by side: on waves they were not tuned on, on a winch that deviates from its
file, as a trade of control error against pressure, and in pictures."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from stillhook.analysis.controllers import Controller
from stillhook.analysis.controllers import controller as controller_of
from stillhook.analysis.effects import idle, scaled
from stillhook.analysis.tuning.objective import OURS, Limits, Objective, pressure_of
from stillhook.analysis.tuning.parameters import described
from stillhook.analysis.tuning.search import Trial
from stillhook.analysis.tuning.tune import BUDGET, Tuned, tune
from stillhook.base.progress import Progress
from stillhook.engine.pack.settings import with_value
from stillhook.engine.simulate import run_cases
from stillhook.errors import StillhookError
from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS, GREY, colours_of
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.units import in_display

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


LATE = 0.1
"""Delay of the motion signal that no controller compensates, among the variations [s]: ten PLC cycles."""
FRICTION = 0.3
"""Change of all system friction among the variations [-]: the published sets of the thesis differ by more."""
WORN, NEW = 2.0, 0.5
"""Leak of pumps and active motors over that of their tables, among the variations [-]."""
SYSTEM_FRICTION = tuple(f"friction.system.{Y}" for Y in ("Y_1", "Y_2", "Y_3", "Y_5", "Y_6"))
SOFT = 0.7
"""Effective bulk modulus over that of the crane, among the variations [-]: 1 % of free air in the oil does as much."""
STYLES = (
    ("as it starts", GREY, ""),
    ("tuned", COLOURS[0], ""),
    ("as it starts, hold-out", "#CCCCCC", "//"),
    ("tuned, hold-out", COLOURS[5], "//"),
)
WIDTH = 0.2


class Outcome(NamedTuple):
    """Result of a controller on some scenarios: mean and largest e_c_pp [m], highest pressure [Pa]; beyond: what of a
    status that is the controller's doing came up, and in how many scenarios."""

    e_c_pp_mean: float
    e_c_pp_worst: float
    p_max: float
    beyond: tuple[str, ...]


class Point(NamedTuple):
    """A setting that no other one beats in both: mean error [m], highest pressure [Pa], settings [SI]."""

    e_c_pp_mean: float
    p_max: float
    values: Mapping[str, float]


def outcomes(
    crane: Crane | Sequence[Crane], controllers: Sequence[Controller], cases: Sequence[Scenario]
) -> list[Outcome]:
    """Every controller in all scenarios, in its own mode; crane that of all, or one for each controller. All runs side
    by side."""
    cranes = [crane] * len(controllers) if isinstance(crane, Crane) else list(crane)
    machines = [k.on(c) for k, c in zip(controllers, cranes, strict=True)]
    n = len(cases)
    results = run_cases(
        [m for m in machines for _ in range(n)],
        [case.with_mode(k.mode) for k in controllers for case in cases],
    )
    return [_outcome(results[i * n : (i + 1) * n]) for i in range(len(controllers))]


def _outcome(rows: Sequence[Mapping[str, float | str]]) -> Outcome:
    e, p = np.array([float(r["e_c_pp"]) for r in rows]), np.array([pressure_of(r) for r in rows])
    counts = {name: sum(name in str(r["status"]).split(", ") for r in rows) for name in OURS}
    beyond = tuple(f"{name} in {count} of {len(rows)}" for name, count in counts.items() if count)
    return Outcome(float(np.mean(e)), float(np.max(e)), float(np.max(p)), beyond)


LEAKS = ("active.motor.C_1", "active.motor.C_2", "active.pump.leak_scale")
VARIATIONS: Mapping[str, tuple[Mapping[str, float], float]] = {
    "as it should be": ({}, 0.0),
    f"motion signal {LATE:g} s later": ({}, LATE),
    f"friction {FRICTION:.0%} less".replace("%", " %"): (dict.fromkeys(SYSTEM_FRICTION, 1.0 - FRICTION), 0.0),
    f"friction {FRICTION:.0%} more".replace("%", " %"): (dict.fromkeys(SYSTEM_FRICTION, 1.0 + FRICTION), 0.0),
    f"leakage x {NEW:g}": (dict.fromkeys(LEAKS, NEW), 0.0),
    f"leakage x {WORN:g}": (dict.fromkeys(LEAKS, WORN), 0.0),
    f"bulk modulus x {SOFT:g}": ({"active.line.bulk_modulus": SOFT}, 0.0),
}
"""What may be wrong about the winch, as factors on its numbers, and by how much the motion signal is later than the
controllers assume [s]."""


def variations(crane: Crane, controllers: Sequence[Controller], cases: Sequence[Scenario]) -> dict[str, list[Outcome]]:
    """Variation -> outcome of every controller, whose settings stay what they are: those of the crane of the file.
    Variations of numbers that the winch type does not have are left out.

    Derived gains K_1 and K_2 come from numbers that no variation changes.
    """
    out = {}
    for name, (factors, late) in VARIATIONS.items():
        if (not crane.circuits and any(path.startswith("active.") for path in factors)) or (
            factors and idle(crane, factors)
        ):
            continue
        machine = scaled(crane, factors)
        sensed = [
            c.model_copy(update={"sensors": c.sensors.model_copy(update={"delay": c.sensors.delay + late})})
            for c in cases
        ]
        out[name] = outcomes(
            [_fixed(k, crane, machine) for k in controllers], [Controller(k.name, k.mode) for k in controllers], sensed
        )
    return out


def _fixed(controller: Controller, crane: Crane, machine: Crane) -> Crane:
    """The changed machine under the settings that the controller has on the crane of the file."""
    tuned = controller.on(crane)
    if not crane.circuits:
        drive = {path: operator.attrgetter(path)(tuned) for path in crane.plant.type.tuned}
        machine = machine.model_copy(update={"control": tuned.control})
        for path, value in drive.items():
            machine = with_value(machine, path, value)
        return machine
    motor = tuned.active.motor
    settings = {n: getattr(motor, n) for n in ("alpha_min", "servo", "variant", "offset", "hysteresis")}
    active = machine.active.model_copy(update={"motor": machine.active.motor.model_copy(update=settings)})
    return machine.model_copy(update={"control": tuned.control, "active": active})


def front(trials: Iterable[Trial], names: Sequence[str]) -> list[Point]:
    """The trials that keep all limits and that no other such trial beats in both mean error and highest pressure, by
    pressure."""
    sound = sorted((t.score.p_max, t.score.e_c_pp_mean, t.values) for t in trials if not t.score.broken)
    out: list[Point] = []
    for p, e, values in sound:
        if not out or e < out[-1].e_c_pp_mean:
            out.append(Point(e, p, dict(zip(names, values, strict=True))))
    return out


def pareto(
    crane: Crane,
    controller: Controller | Path | str,
    *,
    free: Sequence[str] = (),
    cases: Sequence[Scenario] | None = None,
    limits: Limits | None = None,
    seed: int = 0,
    budget: int = BUDGET,
    points: int = 3,
    progress: Progress | None = None,
) -> tuple[list[Point], list[Tuned]]:
    """The trade of mean control error against highest pressure: its front, and the tunings it is made of.

    The least pressure and the least error are tuned first, then the least error under `points` limits of pressure in
    between (epsilon constraint); the front is the non-dominated part of everything that was run. budget: evaluations of
    each of the points + 2 tunings.
    Errors: as `tune`; StillhookError where no setting keeps the limits.
    Source: Haimes 1971 (epsilon constraint).
    """
    common = {"free": free, "cases": cases, "budget": budget, "seed": seed}
    first = controller_of(controller)
    done: list[Tuned] = []
    report = progress or (lambda share: None)

    def part(share: float) -> None:
        report((len(done) + share) / (points + 2))

    def add(objective: Objective, start: Controller, within: Limits | None) -> Tuned:
        tuned = tune(crane, start, objective=objective, limits=within, reference=first, progress=part, **common)  # type: ignore[arg-type]
        done.append(tuned)
        return done[-1]

    low = add(Objective.PRESSURE, first, limits)
    required = low.limits  # "speed capacity kept" is that of the start, whatever later searches start from
    if not low.met:
        raise StillhookError(f"{first.name}: no setting keeps the limits ({'; '.join(low.stops)}). Relax one of them.")
    high = add(Objective.ERROR, first, required)
    if high.met and not (low.interrupted or high.interrupted):
        for p in np.linspace(low.after.p_max, high.after.p_max, points + 2)[1:-1]:
            bound = replace(required, p_max=min(float(p), required.p_max))
            add(Objective.ERROR, low.controller, bound)
            if done[-1].interrupted:
                break
    names = [c.name for c in done[0].settings]
    return front([t for d in done for t in d.trials if [c.name for c in d.settings] == names], names), done


def trials_dataset(tunings: Sequence[Tuned]) -> xarray.Dataset:
    """Every evaluation of some tunings over "trial": controller, settings (NaN where a controller has none), scores,
    limits broken."""
    import xarray  # heavy: only where results are written

    rows = [(t, dict(zip([c.name for c in t.settings], k.values, strict=True)), k) for t in tunings for k in t.trials]
    scores = ("score", "e_c_pp_mean", "e_c_pp_worst", "p_max", "u_p_max", "v_w_capacity")
    columns = {n: [v.get(n, np.nan) for _, v, _ in rows] for n in dict.fromkeys(n for _, v, _ in rows for n in v)}
    columns |= {n: [getattr(k.score, n) for *_, k in rows] for n in scores}
    data: dict[str, Any] = {
        n: ("trial", column, dict(zip(("units", "long_name"), described(n)[1:], strict=True)))
        for n, column in columns.items()
    }
    broken = ["; ".join(trial.score.broken) for *_, trial in rows]
    data["broken"] = ("trial", broken, {"long_name": "limits that are not kept"})
    return xarray.Dataset(data, coords={"controller": ("trial", [t.start.name for t, *_ in rows])})


class Rating(Protocol):
    """Anything with a mean control error [m] and a highest pressure [Pa]: a score, an outcome, a point of a front."""

    @property
    def e_c_pp_mean(self) -> float: ...

    @property
    def p_max(self) -> float: ...


def pareto_figure(
    fronts: Mapping[str, Sequence[Rating]], marks: Mapping[str, tuple[Rating, Rating]], *, title: str = ""
) -> Figure:
    """Mean control error against highest pressure: a front for each controller, its start hollow, its best filled.

    fronts: controller -> points of `front`; marks: controller -> start and best. Down and left is better.
    """
    figure, ax = kit.panel((8.0, 5.6), title)
    colours = colours_of(marks)
    for name, (start, best) in marks.items():
        at, colour = [_at(p) for p in fronts.get(name, ())], colours[name]
        ax.step([x for x, _ in at], [y for _, y in at], where="post", color=colour, lw=1.4)
        ax.plot(*_at(start), "o", ms=8, mec=colour, mfc="none")
        ax.plot(*_at(best), "o", ms=8, mec=colour, mfc=colour, label=name)
    ax.set(xlabel="highest pressure over all scenarios [bar]", ylabel="mean control error, peak-to-peak [mm]")
    ax.set_ylim(bottom=0.0)
    ax.legend(frameon=False, title="hollow: as it starts, filled: tuned,\nline: what it can trade")
    return figure


def _at(p: Rating) -> tuple[float, float]:
    return in_display(p.p_max, "pressure"), in_display(p.e_c_pp_mean, "diameter")


def bars_figure(rows: Mapping[str, Sequence[Rating]], *, title: str = "") -> Figure:
    """Mean error and highest pressure of every controller: before and after, then the same in scenarios that the tuning
    never saw."""
    without = any(math.isnan(r.p_max) for row in rows.values() for r in row)  # a winch without pressure
    labels = ("mean error p-p [mm]",) if without else ("mean error p-p [mm]", "highest pressure [bar]")
    figure, axes = kit.panels(len(labels), 1, (9.0, 6.4), title, grid="y", sharex=True)
    axes = axes.ravel()
    for i, (ax, label) in enumerate(zip(axes, labels, strict=True)):
        for k, (name, colour, hatch) in enumerate(STYLES):
            at = [j + (k - 1.5) * WIDTH for j in range(len(rows))]
            heights = [_at(row[k])[1 - i] for row in rows.values()]
            bars = ax.bar(at, heights, WIDTH, color=colour, hatch=hatch, edgecolor="white", label=name)
            ax.bar_label(bars, fmt="%.0f", fontsize=7)
        ax.set_ylabel(label)
        ax.margins(y=0.12)
    axes[-1].set_xticks(range(len(rows)), list(rows))
    axes[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, frameon=False, fontsize="small")
    figure.align_ylabels(axes)
    return figure
