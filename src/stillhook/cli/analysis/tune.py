"""`stillhook tune`: tuned controllers under limits, side by side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import Controllers, Json, Out, SubjectArgument, check_out, present, write_out
from stillhook.cli.runs.simulation import USUAL_CASE
from stillhook.errors import CommandError
from stillhook.report.formatting import argument, wrapped
from stillhook.report.terminal import (
    Answer,
    Cells,
    Line,
    columns,
    print_table,
    progress_bar,
    say,
    say_if_compiling,
    twin_lines,
)
from stillhook.units import show

if TYPE_CHECKING:
    from stillhook.analysis.controllers import Controller
    from stillhook.analysis.tuning.comparison import Outcome, Point
    from stillhook.analysis.tuning.objective import Score
    from stillhook.analysis.tuning.tune import Tuned
    from stillhook.spec.crane import Crane
    from stillhook.spec.scenario import Scenario

INTERRUPTED = 130
BARS, PARETO, NUMBERS, TRIALS = "before-after.png", "pareto.png", "tune.json", "trials.nc"


def tune(
    crane: SubjectArgument,
    controllers: Controllers = None,
    free: Annotated[
        str | None, typer.Option(help="Settings to tune, such as K_p,u_thr (default: all of the motor law).")
    ] = None,
    objective: Annotated[str, typer.Option(help="error, worst-error, pressure or balanced.")] = "balanced",
    limit: Annotated[
        list[str] | None, typer.Option(help='Limit to keep, such as "p_max <= 300 bar"; may be given again.')
    ] = None,
    loads: Annotated[str, typer.Option(help='Loads, such as "50 t, 150 t", or parts of the SWL.')] = "20 %, 60 %",
    speeds: Annotated[
        str | None,
        typer.Option(help='Peak speeds of the tip (default "20 m/min, 50 m/min, 75 m/min", less on a slower winch).'),
    ] = None,
    periods: Annotated[str, typer.Option(help="Wave periods.")] = "8 s, 12 s",
    pareto: Annotated[
        bool, typer.Option("--pareto", help="Also the front of error against pressure (five tunings each).")
    ] = False,
    out: Out = None,
    json: Json = False,
) -> None:
    """Tune controllers on the full twin and compare each as tuned, also on waves and winches that it was not tuned
    on.

    Always kept: gain margin 2, phase margin 45 deg, sensitivity peak 2, speed capacity, no saturation, relief,
    overspeed or cavitation. Exit code 1 if for some controller no setting keeps the limits; the limit that stops it is
    named. Ctrl-C keeps the best found so far. Wire paid out, delay of the motion signal, seed and evaluations of each
    tuning (400) are those of a case file.

    Example: stillhook tune nov-250t --controllers ns,ssc --objective balanced --limit "p_max <= 300 bar" --out tuned
    """
    from stillhook.analysis.tuning.objective import Objective, hold_out, parse_limits, scenarios
    from stillhook.formats.case_file import load_subject
    from stillhook.spec.scenario import Scenario

    subject, limits = load_subject(crane), parse_limits(limit or ())
    case = Scenario(**(USUAL_CASE | dict(subject.scenario)))
    machine, settings, late = subject.crane, subject.settings, case.sensors.delay
    chosen = _chosen(controllers, machine, late)
    if objective not in tuple(Objective):
        raise CommandError(f'--objective "{objective}": choose one of {", ".join(Objective)}.')
    files = (BARS, NUMBERS, TRIALS, *((PARETO,) if pareto else ()), *(f"{c.name}-tuned.toml" for c in chosen))
    check_out(out, files)
    if free is not None and not _split(free):
        raise CommandError(
            f'--free "{free}": name at least one setting, such as K_p,u_thr, or leave it out to tune all.'
        )
    where: dict[str, Any] = {
        "loads": _split(loads),
        "speeds": None if speeds is None else _split(speeds),
        "s_w": f"{case.s_w!r} m",
        "delay": late,
    }
    cases = scenarios(machine, periods=_split(periods), **where)
    unseen = hold_out(machine, seed=settings.seed, **where)
    options = {"free": _split(free or ""), "limits": limits, "cases": cases}
    options |= {"seed": settings.seed, "budget": settings.budget}
    tuned, fronts, trials = _tuned(machine, chosen, objective, options, pareto=pareto)
    report = _Report(machine, tuned, unseen, fronts, cases)
    present(report.data(), brief=report.answer, json=json)
    if out is not None:
        _write(report, trials, out, pareto=pareto, quiet=json)
    raise typer.Exit(INTERRUPTED if any(t.interrupted for t in tuned) else 0 if all(t.met for t in tuned) else 1)


def _split(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]


def _chosen(names: str | None, crane: Crane, delay: float) -> list[Controller]:
    """Where the tunings start; strong SSC is aligned for the delay that is requested."""
    from stillhook.analysis.controllers import STRONG, controllers, strong_ssc, usual_controllers

    return [
        strong_ssc(crane, delay=delay) if c.name == STRONG else c
        for c in controllers(names or usual_controllers(crane))
    ]


def _tuned(
    crane: Crane, chosen: list[Controller], objective: str, options: dict[str, Any], *, pareto: bool
) -> tuple[list[Tuned], dict[str, list[Point]], list[Tuned]]:
    """The tunings, their fronts, and all tunings that were run for either. An interrupt leaves out what has not
    begun."""
    from stillhook.analysis.tuning.comparison import front
    from stillhook.analysis.tuning.comparison import pareto as front_of
    from stillhook.analysis.tuning.tune import tune as tune_one

    tuned, fronts, everything = [], {}, []
    say_if_compiling(crane)
    for selected in chosen:
        with progress_bar(f"tuning {selected.name}") as bar:
            tuning_options = options | {"free": _free_of(selected, options["free"], chosen, crane)}
            tuned.append(tune_one(crane, selected, objective=objective, progress=bar, **tuning_options))
        everything.append(tuned[-1])
        if pareto and tuned[-1].met and not tuned[-1].interrupted:
            with progress_bar(f"front of {selected.name}") as bar:
                _, more = front_of(crane, selected, progress=bar, **tuning_options)
            fronts[selected.name] = front(
                [t for run in (tuned[-1], *more) for t in run.trials], [c.name for c in more[0].settings]
            )
            everything += more
        if everything[-1].interrupted:
            say(f"stopped in {selected.name} after {everything[-1].evaluations} evaluations: the best found so far")
            break
    return tuned, fronts, everything


def _free_of(selected: Controller, free: list[str], chosen: list[Controller], crane: Crane) -> list[str]:
    """Of the settings to tune those of this motor law; one that no controller has is left in, to be refused."""
    from stillhook.analysis.tuning.parameters import nameable

    tunable_names = {n for c in chosen for n in nameable(c.mode, crane)}
    known_to_mode = [n for n in free if n in nameable(selected.mode, crane) or n not in tunable_names]
    if free and not known_to_mode:
        raise CommandError(
            f"--free {','.join(free)}: {selected.name} has none of these settings; it has"
            f" {', '.join(nameable(selected.mode, crane))}."
        )
    return known_to_mode


class _Report:
    """Printed and stored results of several tunings."""

    def __init__(
        self,
        crane: Crane,
        tuned: list[Tuned],
        unseen: list[Scenario],
        fronts: dict[str, list[Point]],
        cases: list[Scenario],
    ) -> None:
        from stillhook.analysis.loop_stability.governing import governing
        from stillhook.analysis.tuning.comparison import outcomes, variations
        from stillhook.engine.scenario.checks import notes_of
        from stillhook.engine.scenario.summary import numbers_of
        from stillhook.spec.settings import left_out

        self.available = numbers_of(crane)
        self.crane, self.tuned, self.fronts, self.cases, self.unseen = crane, tuned, fronts, cases, unseen
        pairs = [k for t in tuned for k in (t.start, t.controller)]
        results = outcomes(crane, pairs, unseen)
        self.held_out = [(results[2 * i], results[2 * i + 1]) for i in range(len(tuned))]
        self.varied = variations(crane, [t.controller for t in tuned], cases)
        load = max(c.load for c in cases)
        self.stable = [governing(t.controller.on(crane), t.controller.mode) for t in tuned]
        machines = [t.controller.on(crane) for t in tuned for _ in cases]
        self.notes = notes_of(machines, [case.with_mode(t.controller.mode) for t in tuned for case in cases])
        self.notes += [f"stability: {note}" for note in left_out(crane.sensors)]
        self.remarks = [*self._stability_remarks(), *self._load_remarks(load), *self.notes]
        if crane.certified is not None:
            self.remarks.append(
                "with other settings the certificate of the crane does not hold: validate the settings before they"
                " are used"
            )

    def _stability_remarks(self) -> list[str]:
        """What the one margin says of each tuned controller, regardless of the limits of the tuning."""
        out = []
        for t, margins in zip(self.tuned, self.stable, strict=True):
            K_p = t.controller.on(self.crane).control.K_p
            if margins.no_gain:
                more = f" and at {n} more places" if (n := len(margins.no_gain) - 1) else ""
                out.append(
                    f"{t.start.name}: No gain K_p stabilises the complete plant at"
                    f" {margins.no_gain[0].place.describe()}{more} of {len(margins.places)}"
                )
            least = margins.limit
            if least is not None and least.gains.high <= K_p:
                out.append(
                    f"{t.start.name}: above {show(least.gains.high, 'gain_per_length', 2)}"
                    " the complete plant oscillates with"
                    f" {least.describe()}, and K_p is {show(K_p, 'gain_per_length', 3)}"
                )
        return out

    def _load_remarks(self, load: float) -> list[str]:
        return [
            f"{t.start.name} carries {t.start.mode.law.swl_share:.0%} of the SWL at most; heavier scenarios were run"
            " all the same"
            for t in self.tuned
            if load > t.start.mode.law.swl_share * self.crane.SWL * (1.0 + 1e-9)
        ]

    def data(self) -> dict[str, Any]:
        """Everything in SI, for machines."""
        from stillhook.engine.certificate import twin_line
        from stillhook.tables.plausible import implausible_values

        first = self.tuned[0]
        return {
            "crane": self.crane.name,
            "twin": twin_line(self.crane),
            "objective": first.objective.value,
            "seed": first.seed,
            "scenarios": [_scenario(c) for c in self.cases],
            "hold_out": [_scenario(c) for c in self.unseen],
            "controllers": {t.start.name: self._entry(i, t) for i, t in enumerate(self.tuned)},
            "notes": [*implausible_values(self.crane), *self.notes],
            "pareto": {name: [p._asdict() for p in points] for name, points in self.fronts.items()},
        }

    def _entry(self, i: int, t: Tuned) -> dict[str, Any]:
        before, after = self.held_out[i]
        return {
            "mode": t.start.mode.value,
            "met": t.met,
            "stops": list(t.stops),
            "active": list(t.active),
            "evaluations": t.evaluations,
            "interrupted": t.interrupted,
            "limits": {n: getattr(t.limits, n) for n in t.limits.__dataclass_fields__},
            "settings": [c._asdict() for c in t.settings],
            "before": self._numbers(t.before),
            "after": self._numbers(t.after),
            "hold_out": {"before": self._numbers(before), "after": self._numbers(after)},
            "stability": {
                "K_p_strong": self.stable[i].K_p,
                "K_p_ms_plc": math.nan if (least := self.stable[i].limit) is None else least.gains.high,
                "least_at": None if least is None else least.place._asdict(),
                "no_gain": [p.place._asdict() for p in self.stable[i].no_gain],
            },
            "variations": {name: self._numbers(results[i]) for name, results in self.varied.items()},
        }

    def _numbers(self, of: Score | Outcome) -> dict[str, Any]:
        """A score or an outcome as JSON has it, in SI."""
        left_out = ("e_c_pp", "pressures", *({"p_max"} - set(self.available)))
        return {name: value for name, value in of._asdict().items() if name not in left_out}

    def answer(self) -> Answer:
        """Score and errors of each controller before and with its best tuning, active limits, and what to distrust."""
        from stillhook.tables.plausible import implausible_values

        rows, outcomes = [], []
        for t, (_, unseen) in zip(self.tuned, self.held_out, strict=True):
            errors = [f"{x.e_c_pp_mean * 1e3:.1f} mm" for x in (t.before, t.after, unseen)]
            outcome = "limits kept" if t.met else f"no setting keeps the limits; exceeded: {'; '.join(t.stops)}"
            active = f"; active: {', '.join(t.active)}" if t.active else ""
            rows.append([t.start.name, *errors, f"{t.after.score:.3f}", outcome + active])
            limits = ", ".join(t.active) or "no limit"
            outcomes.append(
                f"{t.start.name}: {outcome}; active limits: {limits}; {t.evaluations} evaluations, seed {t.seed}"
            )
        heads = ["controller", "before", "tuned", "hold-out", "score", "limits"]
        settings = [
            Cells(f"{t.start.name}: " + ", ".join(f"{c.name} {_change(c.name, c.before, c.after)}" for c in t.settings))
            for t in self.tuned
            if t.met
        ]
        head = "mean error p-p, highest pressure" if "p_max" in self.available else "mean error p-p"
        varied = [[name, *map(_brief, results)] for name, results in self.varied.items()]
        of_outcomes = _outcome_table(self.crane, self.available, self.tuned, self.held_out)
        loads = ", ".join(dict.fromkeys(show(c.load, "mass", 4) for c in self.cases))
        deviating = "Tuned controllers on a winch that deviates from its crane file"
        fronts = [
            f"{name}: front of error and pressure: "
            + ", ".join(f"{p.e_c_pp_mean * 1e3:.1f} mm at {show(p.p_max, 'pressure', 4)}" for p in _few(points))
            for name, points in self.fronts.items()
        ]
        lines: list[Line] = [
            *columns(heads, rows, left=(0, 5)),
            *settings,
            partial(print_table, *_settings_table(self.tuned), title="settings, before → after"),
            partial(print_table, *of_outcomes, title=f"scenarios with {loads}", left=2),
            partial(print_table, (head, *(t.controller.name for t in self.tuned)), varied, title=deviating),
            *(partial(wrapped, outcome) for outcome in (*outcomes, *fronts)),
            *twin_lines(self.crane, *self.cases),
        ]
        title = f"{self.crane.name}: mean control error p-p, objective {self.tuned[0].objective.value},"
        names = ",".join(t.start.name for t in self.tuned)
        step = f"stillhook compare {argument(self.crane.name)} --controllers {names}"
        notes = [*self.remarks, *implausible_values(self.crane)]
        return Answer(f"{title} {len(self.cases)} scenarios", lines, step, "pressures, deviating winches", notes)


def _few(points: list[Point], most: int = 5) -> list[Point]:
    """A few points of a front, its ends among them."""
    if len(points) <= most:
        return points
    return [points[round(i * (len(points) - 1) / (most - 1))] for i in range(most)]


def _scenario(case: Scenario) -> dict[str, Any]:
    return {
        "load": case.load,
        "s_w": case.s_w,
        "tip": case.tip.describe(),
        "duration": case.duration,
        "warm_up": case.warm_up,
    }


def _outcome_table(
    crane: Crane, available: Sequence[str], tuned: list[Tuned], held_out: list[tuple[Outcome, Outcome]]
) -> tuple[list[str], list[list[str]]]:
    """Header and rows: every controller before and after tuning, on the scenarios and on waves that it never saw;
    available: numbers of its runs."""
    errors = [f"{text}\np-p" for text in ("mean error", "worst error")]
    pressure = ["highest\npressure"] if "p_max" in available else []
    use = "pump\nuse" if crane.circuits else "command\nused"
    unseen = [f"hold-out\n{text}" for text in ("mean error", "worst", *(["pressure"] if pressure else []))]
    rows = []
    for t, outcomes in zip(tuned, held_out, strict=True):
        for label, score, outcome in zip(("before", "tuned"), (t.before, t.after), outcomes, strict=True):
            beyond = "; ".join([*score.broken, *(f"hold-out: {b}" for b in outcome.beyond)]) or "ok"
            name = t.start.name if label == "before" else ""
            seen, other = _rating(score), _rating(outcome)
            rows.append([name, label, f"{score.score:.3f}", *seen, f"{score.u_p_max:.0%}", *other, beyond])
    return ["controller", "settings", "score", *errors, *pressure, use, *unseen, "status"], rows


def _rating(of: Score | Outcome) -> list[str]:
    """Mean and worst error, and the highest pressure where the winch has one."""
    errors = [f"{x * 1e3:.1f} mm" for x in (of.e_c_pp_mean, of.e_c_pp_worst)]
    return errors if math.isnan(of.p_max) else [*errors, show(of.p_max, "pressure", 4)]


def _settings_table(tuned: list[Tuned]) -> tuple[list[str], list[list[str]]]:
    """Header and rows: a setting each, before and after for every controller that has it."""
    names = list(dict.fromkeys(c.name for t in tuned for c in t.settings))
    by = [{c.name: c for c in t.settings} for t in tuned]
    rows = [[n, *(_change(n, b[n].before, b[n].after) if n in b else "-" for b in by)] for n in names]
    return ["setting", *(t.start.name for t in tuned)], rows


def _change(name: str, before: float, after: float) -> str:
    from stillhook.analysis.tuning.parameters import text_of

    shown = [f"{x:.4g}" if isinstance(x, float) else _short(x) for x in (text_of(name, before), text_of(name, after))]
    return " → ".join(shown)


def _short(text: str) -> str:
    """A quantity as text, to four digits."""
    number, _, unit = text.partition(" ")
    return f"{float(number):.4g} {unit}"


def _brief(o: Outcome) -> str:
    beyond = f" ({'; '.join(o.beyond)})" if o.beyond else ""
    pressure = "" if math.isnan(o.p_max) else f", {show(o.p_max, 'pressure', 3)}"
    return f"{o.e_c_pp_mean * 1e3:.1f} mm{pressure}{beyond}"


def _write(report: _Report, trials: list[Tuned], out: Path, *, pareto: bool, quiet: bool) -> None:
    """Controller files, pictures, every evaluation, and the numbers."""
    from stillhook.analysis.controllers import controller_toml
    from stillhook.analysis.tuning.comparison import bars_figure, pareto_figure, trials_dataset

    crane, files = report.crane, dict[str, Any]()
    for t in report.tuned:
        if not t.met:
            continue
        comment = (
            f"{t.start.name} tuned for {crane.name}: objective {t.objective}, seed {t.seed}, {t.evaluations}"
            f" evaluations\nscore {t.after.score:.4f} of the start; active limits:"
            f" {', '.join(t.active) or 'no limit'}"
        )
        files[f"{t.start.name}-tuned.toml"] = controller_toml(t.controller, crane, comment)
    rows = {
        t.start.name: (t.before, t.after, *outcome) for t, outcome in zip(report.tuned, report.held_out, strict=True)
    }

    def pictures() -> dict[str, Any]:
        figures = {BARS: bars_figure(rows, title=f"{crane.name}: as they start and tuned")}
        if pareto:
            marks = {t.start.name: (t.before, t.after) for t in report.tuned}
            figures[PARETO] = pareto_figure(report.fronts, marks, title=f"{crane.name}: error against pressure")
        return figures

    files |= {TRIALS: trials_dataset(trials), NUMBERS: report.data()}
    write_out(out, files, pictures=pictures, quiet=quiet, cranes=[crane])
