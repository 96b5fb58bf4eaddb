"""Every case under every draw of what is uncertain, in bounded memory and from a record that repeats it."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook._version import __version__
from stillhook.analysis.uncertainty.draws import Drawing, Draws, Pair, Uncertainty, draws
from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress, Relay
from stillhook.engine.arguments import STATISTICS_STEP, paired, steps_per_cycle
from stillhook.engine.certificate import twin_line
from stillhook.engine.scenario.summary import numbers_of
from stillhook.engine.simulate import raise_refused, run_cases
from stillhook.errors import ScenarioError
from stillhook.kernels.build import results_hash
from stillhook.library import crane_toml
from stillhook.library.draws import crane_with
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.units import quote
from stillhook.variables import attributes

if TYPE_CHECKING:
    import xarray


AT_ONCE = 4096
"""Runs that are made at once: their cranes take about 60 MB."""
SAMPLER = "scrambled Sobol sequence (scipy.stats.qmc), one dimension for each factor of the table"


def monte_carlo(
    crane: Crane | Sequence[Crane],
    case: Scenario | Sequence[Scenario],
    uncertainty: Uncertainty | None = None,
    *,
    n: int = 256,
    seed: int = 0,
    labels: Sequence[str] | None = None,
    step: str | None = None,
    threads: int = 2,
    store: str | Path | None = None,
    client: Any = None,
    progress: Progress | None = None,
) -> xarray.Dataset:
    """Every case under n draws of what is uncertain; all cases see the same draws: differences are sharp.

    Parameters
    ----------
    crane : Crane or sequence of Crane
        One or several, in pairs with the cases, as in `stillhook.simulate`.
    case : Scenario or sequence of Scenario
        One or several; two controllers are two cases (on two cranes where their settings differ).
    uncertainty : Uncertainty, optional
        Default `Uncertainty.default`.
    n : int, default 256
        Draws.
    seed : int, default 0
        The same seed gives the same draws.
    labels : sequence of str, optional
        Names along "case".
    step : str, optional
        Integration step, such as "2 ms"; default as in `stillhook.simulate`.
    threads : int, default 2
        Threads that share the runs.
    store : str or Path, optional
        Folder in which statistics are kept as they finish, so that an interrupted run continues; as in
        `stillhook.simulate`.
    client : dask.distributed.Client, optional
        Cluster that shares the runs, with the same numbers.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Dataset
        Over (case, draw) with the summary of every run, and `factor_value` over (draw, factor) [SI]. A draw that
        diverged has status "diverged" and NaN; nothing is dropped. Attributes hold cranes, scenarios, factors and seed,
        from which `pair_of_draw` makes the crane and scenario of any draw; `at_values` is the run of every case at the
        nominal values.

    Raises
    ------
    SpecError, ScenarioError
        One line before anything runs, also where an end of a distribution is not a crane.

    Notes
    -----
    The crane of a draw differs from that of a certificate, so `validated` is 0 in every draw; whether the twin is
    validated for a case follows from `at_values`.
    """
    cranes, cases = paired(crane, case)
    names = case_labels(cases, labels)
    uncertain = (uncertainty or Uncertainty.default()).on(*zip(cranes, cases, strict=True))
    table = draws(uncertain, n, seed)
    drawings = base_drawings(cranes, cases, uncertain, table)
    numbers, status, at_values = run_draws(
        drawings, table.values, step=step, threads=threads, store=store, client=client, progress=progress
    )
    data = _dataset(cranes[0], names, table, numbers, status)
    bases = [d.crane for d in drawings]
    single = all(c is bases[0] for c in bases)
    data.attrs = {
        "title": (
            f"Stillhook: {len(cases)} case{'s' * (len(cases) > 1)} under {n} draws of {len(uncertain.factors)} factors"
        ),
        "crane": crane_toml(bases[0]) if single else json.dumps([crane_toml(c) for c in bases]),
        "twin": twin_line(bases[0]),
        "scenarios": json.dumps([c.to_dict() for c in cases]),
        "factors": json.dumps(uncertain.to_dict()),
        "at_values": json.dumps(dict(zip(names, at_values, strict=True))),
        "seed": seed,
        "sampler": SAMPLER,
        "stillhook_version": __version__,
        "stillhook_code": results_hash(),
        "step": cranes[0].control.t_cycle / steps_per_cycle(cranes[0], step, STATISTICS_STEP),
    }
    return data


def case_labels(cases: Sequence[Scenario], labels: Sequence[str] | None) -> list[str]:
    """Names along "case": those given, those of the cases, their modes, or numbers; whichever distinguish them."""
    candidates = [[c.name for c in cases], [c.mode.value for c in cases], [str(i) for i in range(len(cases))]]
    for names in [list(labels)] if labels is not None else candidates:
        if len(names) == len(set(names)) == len(cases) and all(names):
            return names
    raise ScenarioError(f"labels = {quote(labels)}: give {len(cases)} different names, one for each case.")


def base_drawings(
    cranes: Sequence[Crane], cases: Sequence[Scenario], uncertain: Uncertainty, table: Draws
) -> list[Drawing]:
    """What the draws do to every case; checked at the ends of the distributions, a crane once."""
    based: dict[int, Crane] = {}
    seen: set[int] = set()
    out = []
    for crane, case in zip(cranes, cases, strict=True):
        if id(crane) not in based:
            based[id(crane)] = crane_with(crane, *uncertain.sets) if uncertain.sets else crane
        drawing = Drawing(based[id(crane)], case, table.columns)
        drawing.check_ends(table.values, crane=id(crane) not in seen)
        seen.add(id(crane))
        out.append(drawing)
    return out


def run_draws(
    drawings: Sequence[Drawing], values: FloatArray, *, progress: Progress | None = None, **options: Any
) -> tuple[FloatArray, list[list[str]], list[dict[str, Any]]]:
    """Numbers of shape (case, draw, number), in the order of `numbers_of`, status of every run, and the summary of
    every case with nothing drawn.

    A few thousand runs at a time, so that memory stays bounded; how: keywords of `run_cases`.
    """
    n, total = len(values), len(drawings) * (len(values) + 1)
    work: Iterator[Pair] = itertools.chain(((d.crane, d.case) for d in drawings), *(d.pairs(values) for d in drawings))
    names = numbers_of(drawings[0].crane)
    numbers, status = np.empty((total, len(names))), list[str]()
    at_values: list[dict[str, Any]] = []
    while pairs := list(itertools.islice(work, AT_ONCE)):
        done = len(status)
        part_progress = part_of(progress, done, len(pairs), total)
        part = run_cases([c for c, _ in pairs], [s for _, s in pairs], progress=part_progress, mark=True, **options)
        raise_refused(part[: max(len(drawings) - done, 0)] or part)
        numbers[done : done + len(part)] = [[s[name] for name in names] for s in part]
        status += [s["status"] for s in part]
        at_values += map(dict, part[: max(len(drawings) - done, 0)])
    k = len(drawings)
    rows = [status[k + i * n : k + (i + 1) * n] for i in range(k)]
    return numbers[k:].reshape(k, n, len(names)), rows, at_values


def part_of(progress: Progress | None, before: int, size: int, total: int) -> Progress | None:
    """Progress of some runs of a longer list."""
    if progress is None:
        return None
    return Relay(lambda share: progress((before + share * size) / total), progress, before, total)


def _dataset(
    crane: Crane, names: Sequence[str], table: Draws, numbers: FloatArray, status: list[list[str]]
) -> xarray.Dataset:
    import xarray  # heavy

    dims = ("case", "draw")
    columns: dict[str, Any] = {"status": (dims, np.array(status, dtype=object), attributes("status"))}
    columns |= {name: (dims, numbers[:, :, j], attributes(name)) for j, name in enumerate(numbers_of(crane))}
    columns["factor_value"] = (("draw", "factor"), table.values, attributes("factor_value"))
    return xarray.Dataset(
        columns, coords={"case": list(names), "draw": np.arange(len(table.values)), "factor": list(table.columns)}
    )


def pair_of_draw(run: xarray.Dataset, case: str, i: int) -> Pair:
    """Crane and scenario of draw i of a case, as a crane file has them, with where every number is from."""
    from stillhook.formats.results import origin

    cranes, cases = origin(run)
    k = [str(c) for c in run["case"].values].index(case)
    drawing = Drawing(cranes[k], cases[k], [str(f) for f in run["factor"].values])
    return drawing.checked(run["factor_value"].values[i], f"draw {i} (seed {run.attrs['seed']})")
