"""An operability map as Monte Carlo: in every cell bands over what is uncertain, and the chance that a controller is
applicable."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook._version import __version__
from stillhook.analysis.controllers import Controller
from stillhook.analysis.maps.operability import Cells, cells_of
from stillhook.analysis.maps.result import DIMS, cause_of, over_axes
from stillhook.analysis.uncertainty.draws import Drawing, Draws, Uncertainty, draws
from stillhook.analysis.uncertainty.monte_carlo import AT_ONCE, SAMPLER, base_drawings, part_of, run_draws
from stillhook.analysis.uncertainty.report import INSIDE, chance
from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.engine.runner import FAILED
from stillhook.engine.scenario.summary import numbers_of
from stillhook.kernels.build import results_hash
from stillhook.library import crane_toml
from stillhook.spec.crane import Crane
from stillhook.variables import attributes

if TYPE_CHECKING:
    import xarray


SHOWN = ("e_c_pp", "eta_c", "p_max", "alpha_m_min")
"""Numbers whose bands the map holds, where the winch type has them."""
QUANTILES = (0.5 * (1.0 - INSIDE), 0.5, 0.5 * (1.0 + INSIDE))
INTERVAL = ("low", "share", "high")
"""A chance and the ends of its 95 % interval (Wilson)."""


def monte_carlo_map(
    crane: Crane,
    controllers: Sequence[str | Path | Controller] | None = None,
    uncertainty: Uncertainty | None = None,
    *,
    n: int = 64,
    seed: int = 0,
    step: str | None = None,
    threads: int = 2,
    store: str | Path | None = None,
    client: Any = None,
    progress: Progress | None = None,
    **grid: Any,
) -> xarray.Dataset:
    """Every cell of a map under n draws of what is uncertain; all cells and controllers see the same draws.

    Parameters
    ----------
    crane : Crane
        The machine.
    controllers : sequence of str, Path or Controller, optional
        As in `stillhook.analysis.operability_map`.
    uncertainty : Uncertainty, optional
        Default `Uncertainty.default`.
    n : int, default 64
        Draws.
    seed : int, default 0
        The same seed gives the same draws.
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
    **grid : Any
        As in `stillhook.analysis.operability_map`: loads, speeds, period, motion, s_w, layers, periods, duration,
        warm_up.

    Returns
    -------
    Dataset
        Over (controller, load, speed, layer, period), the last two dropped where the map has them not: the numbers of
        `SHOWN` over "quantile" (5, 50, 95 %), `applicable_chance` over "interval", `failed` draws.

    Raises
    ------
    ScenarioError, UnitError, SpecError, MotionError
        As `operability_map` and `monte_carlo`, before anything runs.

    Notes
    -----
    A draw that diverged is in no band and not applicable. Cells are run a few at a time, and only bands are kept, so
    memory does not grow with n times the cells.
    """
    cells = cells_of(crane, controllers, **grid)
    uncertain = (uncertainty or Uncertainty.default()).on(*zip(cells.cranes, cells.cases, strict=True))
    table = draws(uncertain, n, seed)
    drawings = base_drawings(cells.cranes, cells.cases, uncertain, table)
    statistics = _Statistics(cells, n)
    places, at_once = statistics.places(), max(AT_ONCE // (n * len(cells.controllers)), 1)
    options = {"step": step, "threads": threads, "store": store, "client": client}
    for k in range(0, len(places), at_once):
        some = places[k : k + at_once]
        each = n * len(cells.controllers)
        part_progress = part_of(progress, k * each, len(some) * each, len(places) * each)
        rows, status, _ = run_draws(
            [drawings[i] for place in some for i in place], table.values, progress=part_progress, **options
        )
        for j, place in enumerate(some):
            part = slice(j * len(place), (j + 1) * len(place))
            statistics.take(place, rows[part], status[part])
    return _dataset(crane, cells, statistics, table, uncertain, seed, drawings)


class _Statistics:
    """Bands and chances of every cell, flat over (controller, cell)."""

    def __init__(self, cells: Cells, n: int) -> None:
        self.cells, self.n, total = cells, n, len(cells.cases)
        self.names = numbers_of(cells.cranes[0])
        self.values = {name: np.full((total, len(QUANTILES)), np.nan) for name in SHOWN if name in self.names}
        self.chances = np.zeros((total, len(INTERVAL)))
        self.failed = np.zeros(total, dtype=np.int64)

    def places(self) -> list[list[int]]:
        """For every cell the places of its controllers."""
        per = len(self.cells.cases) // len(self.cells.controllers)
        return [[c * per + i for c in range(len(self.cells.controllers))] for i in range(per)]

    def take(self, place: list[int], rows: FloatArray, status: list[list[str]]) -> None:
        """The draws of one cell, all controllers: rows shape (controller, draw, number)."""
        for c, i in enumerate(place):
            for name in self.values:
                self.values[name][i] = _quantiles(rows[c, :, self.names.index(name)])
            probability = chance(self._usable(i, rows[c], status[c]))
            self.chances[i] = probability.low, probability.value, probability.high
            self.failed[i] = sum(s in FAILED for s in status[c])

    def _usable(self, i: int, rows: FloatArray, status: list[str]) -> NDArray[np.bool_]:
        case = self.cells.cases[i]
        summaries = [
            dict(zip(self.names, row, strict=True)) | {"status": s}
            for row, s in zip(rows.tolist(), status, strict=True)
        ]
        return np.array([not cause_of(self.cells.cranes[i], s, case.mode, case.load) for s in summaries])


def _quantiles(values: FloatArray) -> FloatArray:
    finite = values[np.isfinite(values)]
    return np.quantile(finite, QUANTILES) if len(finite) else np.full(len(QUANTILES), np.nan)


def _dataset(
    crane: Crane,
    cells: Cells,
    statistics: _Statistics,
    table: Draws,
    uncertain: Uncertainty,
    seed: int,
    drawings: Sequence[Drawing],
) -> xarray.Dataset:
    axes, labels = cells.axes, [c.name for c in cells.controllers]
    shape, dims = (len(labels), *axes.shape), DIMS
    columns: dict[str, Any] = {}
    for name, flat in statistics.values.items():
        columns[name] = ((*dims, "quantile"), flat.reshape(*shape, -1), attributes(name))
    columns["applicable_chance"] = (
        (*dims, "interval"),
        statistics.chances.reshape(*shape, -1),
        attributes("applicable_chance"),
    )
    columns["failed"] = (dims, statistics.failed.reshape(shape), attributes("failed"))
    columns["factor_value"] = (("draw", "factor"), table.values, attributes("factor_value"))
    coords: dict[str, Any] = {
        "controller": labels,
        "quantile": list(QUANTILES),
        "interval": list(INTERVAL),
        "factor": list(table.columns),
    }
    data = over_axes(columns, coords, axes, "peak speed of the tip")
    bases = [drawings[i].crane for i in statistics.places()[0]]
    data.attrs = {
        "title": f"Stillhook map of {crane.name} under {len(table.values)} draws of {len(uncertain.factors)} factors",
        "crane": crane_toml(crane),
        "controllers": json.dumps({label: crane_toml(base) for label, base in zip(labels, bases, strict=True)}),
        "factors": json.dumps(uncertain.to_dict()),
        "seed": seed,
        "sampler": SAMPLER,
        "stillhook_version": __version__,
        "stillhook_code": results_hash(),
    }
    return data
