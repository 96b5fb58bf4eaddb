"""Figures of runs and lowerings, drawn from the Dataset alone: crane and lift are in its attributes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from stillhook.errors import StillhookError
from stillhook.formats.results import cranes_of, lowerings_of, origin
from stillhook.report.plots.run import four_panels
from stillhook.report.save import LOWERING_FILES, lowering_figures
from stillhook.spec.lift.lowering import InSea, Lowering

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from stillhook.spec.crane import Crane

MOST = 8
"""Runs in one figure: as many as there are colours that can be distinguished."""


def run(data: xarray.Dataset, *, title: str | None = None, start: float = 0.0, end: float | None = None) -> Figure:
    """Wire speed, pressure, control error and settings over time, one colour for each case.

    Parameters
    ----------
    data : Dataset
        Runs of scenarios with their series, from `stillhook.simulate`.
    title : str, optional
        Above the figure; default the name of the crane.
    start : float, default 0.0
        First time that is shown [s].
    end : float, optional
        Last time that is shown [s]; default the end of the run.

    Returns
    -------
    Figure
        Of matplotlib.

    Raises
    ------
    StillhookError
        One line, where there are no series, or more than eight cases.
    """
    _check_series(data)
    crane = cranes_of(data)[0]
    if data.sizes.get("case", 1) > MOST:
        raise StillhookError(
            f"plot.run: {data.sizes['case']} cases in one figure; {MOST} can be distinguished. Choose some, such as"
            " run.isel(case=[0, 1])."
        )
    parts = {label: data.isel(case=i) for i, label in enumerate(_labels(data))} if "case" in data.dims else {"": data}
    p_relief = crane.active.relief.p if "active" in crane.circuits else None
    return four_panels(parts, title=crane.name if title is None else title, start=start, end=end, p_relief=p_relief)


def _labels(data: xarray.Dataset) -> list[str]:
    """Names of the cases; where they have none and differ in their controller, the controllers."""
    names = [str(name) for name in data["case"].values]
    cases = {str(i): case for i, case in enumerate(origin(data)[1]) if not case.name}
    modes = [cases[name].mode.value.upper() for name in names if name in cases]
    return modes if len(set(modes)) == len(names) else [f"case {name}" if name in cases else name for name in names]


def lowering(data: xarray.Dataset, *, case: int = 0, title: str | None = None) -> Figure:
    """Depth, tension, dynamic factor, motion, control error and effort of the winch over time, phase by phase.

    Parameters
    ----------
    data : Dataset
        Lowerings with their series, from `stillhook.simulate`.
    case : int, default 0
        Place of the lowering where there are several.
    title : str, optional
        Above the figure; default lift and crane.

    Returns
    -------
    Figure
        Of matplotlib.

    Raises
    ------
    StillhookError
        One line, where there are no series, or no such case.
    """
    return _of_lowering(data, case, title)[LOWERING_FILES[0]]


def moments(data: xarray.Dataset, *, case: int = 0, title: str | None = None) -> Figure:
    """Moments of a lowering side by side, to scale: through the surface, and at the seabed.

    Parameters
    ----------
    data : Dataset
        Lowerings with their series, from `stillhook.simulate`.
    case : int, default 0
        Place of the lowering where there are several.
    title : str, optional
        Above the figure; default the lift.

    Returns
    -------
    Figure
        Of matplotlib.

    Raises
    ------
    StillhookError
        One line, where there are no series, or no such case.
    """
    return _of_lowering(data, case, title)[LOWERING_FILES[1]]


def _of_lowering(data: xarray.Dataset, case: int, title: str | None) -> Mapping[str, Figure]:
    _check_series(data)
    cranes, lifts = lowerings_of(data)
    n = len(lifts)
    if not 0 <= case < n:
        raise StillhookError(f"plot.lowering: case = {case}: the cases are 0 to {n - 1}. Choose one of them.")
    crane: Crane = cranes[case]
    lift = lifts[case]
    of: Lowering = lift.lift if isinstance(lift, InSea) else lift
    one = data.isel(case=case) if "case" in data.dims else data
    return lowering_figures(one, crane, of, f"{of.name}: {crane.name}" if title is None else title)


def _check_series(data: xarray.Dataset) -> None:
    """Errors: StillhookError where nothing is stored over time."""
    if "time" not in data.dims:
        raise StillhookError("plot: the run holds no series over time. Simulate with series=True.")
