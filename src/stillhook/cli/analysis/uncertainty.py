"""`stillhook uncertainty`: uncertainty of the winch's data, propagated into error and pressure."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from stillhook.cli.parser import (
    Controllers,
    Draws,
    Duration,
    Json,
    Load,
    MotionText,
    Out,
    SubjectArgument,
    WireOut,
    case_of,
    check_out,
    client_of,
    present,
)
from stillhook.cli.runs import simulation
from stillhook.errors import ScenarioError, SpecError
from stillhook.report.formatting import cell, percent
from stillhook.report.terminal import (
    Answer,
    Cells,
    Line,
    columns,
    print_document,
    progress_bar,
    started,
    twin_lines,
)
from stillhook.units import KINDS, in_display, show

if TYPE_CHECKING:
    from stillhook.analysis.uncertainty.attribution import Attribution
    from stillhook.analysis.uncertainty.draws import Uncertainty
    from stillhook.analysis.uncertainty.report import Limit
    from stillhook.analysis.uncertainty.sobol import Sensitivity
    from stillhook.formats.case_file import Subject
    from stillhook.spec.crane import Crane
    from stillhook.spec.scenario import Scenario

FILES = ("uncertainty.nc", "uncertainty.json", "bands.png")
INDICES = "sensitivity.png"
USUAL_CASE = simulation.USUAL_CASE | {"duration": "60 s"}
"""Case without a case file or options; 60 s hold one complete window of 30 s after the warm-up."""
LEAST_ROWS = 16


class _Request(NamedTuple):
    """Cases side by side, and how they are run."""

    cranes: list[Crane]
    cases: list[Scenario]
    labels: list[str]
    factors_table: Uncertainty


def uncertainty(
    crane: SubjectArgument = "nov-250t",
    load: Load = None,
    s_w: WireOut = None,
    motion: MotionText = None,
    duration: Duration = None,
    controllers: Controllers = None,
    factors: Annotated[
        Path | None, typer.Option(help="TOML file of the uncertain factors; default: the built-in table.")
    ] = None,
    draws: Draws = 256,
    sobol: Annotated[
        bool, typer.Option("--sobol", help="Also the factors that cause the spread (about 8 times the runs).")
    ] = False,
    attribute: Annotated[
        bool,
        typer.Option(
            "--attribute",
            help="Also which factors, alone or two together, cause each --limit to hold or to be exceeded.",
        ),
    ] = False,
    limit: Annotated[
        list[str] | None, typer.Option(help='Bound on a result, such as "e_c_pp <= 10 cm"; repeat it for several.')
    ] = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Uncertainty of a winch (friction, leakage, inertia, oil, servos, delay) propagated into error and pressure,
    mode by mode.

    All modes see the same draws. A case file also gives the tolerated probability of exceeding a limit (5 %), the seed
    and where results are kept. Exit code 1 if every mode goes beyond a --limit with more than that probability, or
    beyond the winch's own limits in every draw.

    Example: stillhook uncertainty nov-250t --load "100 t" --draws 256 --limit "e_c_pp <= 25 cm" --sobol --out bands
    """
    from stillhook.analysis.uncertainty.monte_carlo import monte_carlo
    from stillhook.analysis.uncertainty.report import Limit, report
    from stillhook.engine.scenario.checks import notes_of
    from stillhook.formats.case_file import load_subject

    limits = [Limit.of(text) for text in limit or ()]
    if attribute and not limits:
        raise SpecError('--attribute: a limit is missing. Give it as --limit, such as "e_c_pp <= 10 cm".')
    check_out(out, (*FILES, *((INDICES,) if sobol else ())))
    subject = load_subject(crane)
    request = _request(subject, case_of(subject, USUAL_CASE, load, s_w, motion, duration), controllers, factors)
    for bound in limits:
        bound.check(request.cranes[0])
    settings = subject.settings
    pairs = [(a, b) for a in request.labels for b in request.labels if _fixed(b) and not _fixed(a)]
    with client_of(settings.scheduler) as client:
        options: dict[str, Any] = {"seed": settings.seed, "labels": request.labels, "step": subject.step}
        options |= {"store": settings.store, "client": client}
        with progress_bar("drawing") as bar:
            run = monte_carlo(
                request.cranes,
                request.cases,
                request.factors_table,
                n=draws,
                progress=started(request.cranes[0], bar),
                **options,
            )
        indices = _indices(request, run, pairs, options) if sobol else []
    data = report(run, limits, settings.at_most, pairs, indices) | {"notes": notes_of(request.cranes, request.cases)}
    causes = _causes(request, limits, None if factors is None else request.factors_table) if attribute else None
    if causes is not None:
        data["causes"] = causes.to_dict()
    brief, pictures = lambda: _answer(request, data, indices, causes), lambda: _pictures(run, limits, indices)
    files, cranes = {FILES[0]: run, FILES[1]: data}, [subject.crane]
    present(data, out, files, brief=brief, json=json, pictures=pictures, cranes=cranes)
    cases = data["cases"].values()
    within = [c["beyond_limits"]["share"] < 1.0 and all(v["kept"] for v in c["limits"].values()) for c in cases]
    raise typer.Exit(0 if any(within) else 1)


def _request(subject: Subject, case: Scenario, names: str | None, factors: Path | None) -> _Request:
    """Crane and scenario of every controller, and the uncertain factors."""
    from stillhook.analysis.controllers import controllers, usual_controllers
    from stillhook.analysis.uncertainty.draws import Uncertainty, load_uncertainty

    if case.modes:
        raise ScenarioError("modes: a scenario that changes its mode is not a single controller. Leave its modes out.")
    of_case = case.mode.value if subject.scenario else usual_controllers(subject.crane)
    chosen = controllers(names or of_case)
    return _Request(
        cranes=[c.on(subject.crane) for c in chosen],
        cases=[case.model_copy(update={"mode": c.mode, "name": c.name}) for c in chosen],
        labels=[c.name for c in chosen],
        factors_table=Uncertainty.default() if factors is None else load_uncertainty(factors),
    )


def _indices(request: _Request, run: Any, pairs: list[tuple[str, str]], options: dict[str, Any]) -> list[Sensitivity]:
    """Indices of error and pressure, and of what the new controllers' lead over the best classic one depends on."""
    from stillhook.analysis.uncertainty.sobol import sensitivity

    rows = max(LEAST_ROWS, 2 ** (run.sizes["draw"].bit_length() - 2))
    new, classic = (
        {a for a, _ in pairs},
        sorted({b for _, b in pairs}, key=lambda b: float(run["e_c_pp"].sel(case=b).median())),
    )
    against = classic[0] if classic else None
    with progress_bar("sensitivity") as bar:
        indices = sensitivity(
            request.cranes, request.cases, request.factors_table, n=rows, against=against, progress=bar, **options
        )
    return [s for s in indices if s.case in request.labels or s.case.removesuffix(f" / {against}") in new]


def _causes(request: _Request, limits: list[Limit], factors_table: Uncertainty | None) -> Attribution:
    """What brings each limit about in each mode, or breaks it."""
    from stillhook.analysis.uncertainty.attribution import Figure, attribute
    from stillhook.variables import BY_NAME

    figures = []
    for label in request.labels:
        for limit in limits:
            kind = BY_NAME[limit.name].kind
            bound = in_display(limit.value, kind) if kind else limit.value
            least, most = (-math.inf, bound) if limit.at_most else (bound, math.inf)

            def value(r: Any, label: str = label, name: str = limit.name, kind: str = kind) -> float:
                return in_display(float(r[label][name]), kind) if kind else float(r[label][name])

            unit = KINDS[kind].display if kind else ""
            figures.append(Figure(f"{label}: {limit}", value, least, most, unit, 3))
    pairs = zip(request.cranes, request.cases, strict=True)
    return attribute(dict(zip(request.labels, pairs, strict=True)), figures, uncertainty=factors_table)


OF_BRIEF = {"e_c_pp": "error p-p", "p_max": "peak pressure"}
"""Numbers in the short answer, where the winch type has them."""


def _answer(request: _Request, data: dict[str, Any], indices: list[Sensitivity], causes: Attribution | None) -> Answer:
    """Control error of each controller with its band, chances of limits, and which controller is lower."""
    from stillhook.analysis.uncertainty.report import document

    crane, case = request.cranes[0], request.cases[0]
    names = [name for name in OF_BRIEF if all(name in of["band_90"] for of in data["cases"].values())]
    heads = ["controller", *(f"{OF_BRIEF[name]} (5 to 95 %)" for name in names), "limits exceeded"]
    rows, limits = [], []
    for label, of in data["cases"].items():
        bands = [(name, *(of["band_90"][name][end] for end in ("median", "low", "high"))) for name in names]
        cells = [f"{cell(n, x)} ({cell(n, low).split(' ')[0]} to {cell(n, high)})" for n, x, low, high in bands]
        rows.append([label, *cells, percent(of["beyond_limits"]["share"])])
        limits += [
            f"{label}: {text} {'met' if x['kept'] else 'not met'}, exceeded in {percent(x['share'])} of the draws."
            for text, x in of["limits"].items()
        ]

    def in_full() -> None:
        factors = request.factors_table.on(*zip(request.cranes, request.cases, strict=True)).describe()
        print_document(document(crane, case, factors, data, indices, causes))

    brief = [*limits, *(causes.words()[:2] if causes is not None else ())]
    lines: list[Line] = [
        *columns(heads, rows),
        *map(Cells, brief),
        in_full,
        *twin_lines(crane, *request.cases),
    ]
    title = f"{crane.name}, {show(case.load, 'mass')}, {show(case.s_w, 'length')} of wire out: {data['draws']} draws"
    more = f"factors, differences, limits{', causes' if causes is not None else ''}"
    return Answer(title, lines, more=more, notes=data["notes"])


def _pictures(run: Any, limits: list[Limit], indices: list[Sensitivity]) -> dict[str, Any]:
    from stillhook.analysis.uncertainty.report import band_figure, index_figure

    title = str(run.attrs["title"]).removeprefix("Stillhook: ")
    figures = {FILES[2]: band_figure(run, title, limits)}
    return figures | ({INDICES: index_figure(indices, title)} if indices else {})


def _fixed(label: str) -> bool:
    """Whether this is a controller with motors at a fixed displacement."""
    from stillhook.control.registry import Mode

    return label in list(Mode) and Mode(label).law.family == "classic"
