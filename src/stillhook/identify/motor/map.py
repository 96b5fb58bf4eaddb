"""A supplier's map of one motor: torque loss over displacement, speed and pressure drop; read from a table, and
interpolated. A map that is not measured is marked synthetic in the file and in every report."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.base.gateway.guard import reader
from stillhook.errors import LogError, StillhookError
from stillhook.formats.table.columns import ColumnSpec
from stillhook.formats.table.read import Columns, chosen_rows, open_table, read_columns
from stillhook.formats.table.understood import Understood, understood_columns
from stillhook.physics.hydraulics.motor_laws import Measured, map_torque
from stillhook.physics.hydraulics.motor_losses import LossMotor
from stillhook.units import parse, quote, show

FEWEST_CELLS = 10
"""A fit of five parameters needs at least twice as many cells."""
MAX_EXCLUDED = 0.5
"""Part of the rows: a map that loses more than half of them to bad values was misread."""
D_RANGE = (1.0e-7, 1.0e-3)
"""Displacements of motors, about 0.6 to 6000 cm^3/rev [m^3/rad]; outside, the unit in the heading is wrong."""
OMEGA_LARGEST = 2000.0
"""No hydraulic motor turns at 19 000 rev/min [rad/s]."""
OMEGA_SLOWEST = 2.0
"""A map that ends below 19 rev/min had its thousands sign read as a decimal sign [rad/s]."""
DP_LARGEST = 1.0e8
"""Nor withstands 1000 bar [Pa]."""
SPREADSHEET = 0.0101
"""Best efficiency of a column of parts of 1 that is read as per cent."""
MOSTLY_LOST = 0.5
"""Losses beyond half of the nominal torque in the middle of a map are more likely another quantity."""
SAME = 0.01
"""Settings within one per cent of the largest one are one level: a bench sets them no closer."""
WIDE, SLICES = 0.05, 12
"""Widest level, as part of the largest setting, and the number of slices of an axis without levels."""
SYNTHETIC = "synthetic"

SETTINGS = (
    ColumnSpec("D_m", "displacement", ("d", "displacement", "vg", "v_g"), "D_m [cm^3/rev]", required=True),
    ColumnSpec("omega_m", "rotation", ("n", "n_m", "speed", "rpm", "omega"), "n [rev/min]", required=True),
    ColumnSpec("dp_m", "pressure", ("dp", "delta_p", "pressure", "pressure_drop", "p"), "dp [bar]", required=True),
)
LOSSES = (
    ColumnSpec("T_f", "torque", ("t_fm", "loss", "torque_loss"), "T_f [N m]"),
    ColumnSpec("T_shaft", "torque", ("t", "t_m", "torque", "shaft_torque"), "T_shaft [N m]"),
    ColumnSpec("eta_hm", "", ("efficiency", "hydromechanical_efficiency", "eta_mh"), "eta_hm [%]"),
)


@dataclass(frozen=True)
class LossMap:
    """Cells of a map: arrays of one length, D_m [m^3/rad], omega_m [rad/s] and dp_m [Pa] not negative, T_f [N m]."""

    D_m: FloatArray
    omega_m: FloatArray
    dp_m: FloatArray
    T_f: FloatArray
    D_max: float
    source: str
    synthetic: bool = False
    omega_low: float = math.nan
    """Lowest speed of the complete map, of which this may be a part [rad/s]; default its own."""
    findings: tuple[str, ...] = ()
    """What was found, left out or changed while the map was read: nothing is dropped in silence."""

    def __post_init__(self) -> None:
        if math.isnan(self.omega_low) and len(self):
            object.__setattr__(self, "omega_low", float(self.omega_m.min()))

    def __len__(self) -> int:
        return len(self.T_f)

    @property
    def T_N(self) -> FloatArray:
        """Nominal torque D_m dp_m of each cell [N m] (paper A eq. 21)."""
        return self.D_m * self.dp_m

    @property
    def motor(self) -> LossMotor:
        return LossMotor(self.D_max, omega_low=self.omega_low)

    def at(self, rows: NDArray[Any]) -> LossMap:
        """The map with these cells alone (mask or indices)."""
        return replace(self, D_m=self.D_m[rows], omega_m=self.omega_m[rows], dp_m=self.dp_m[rows], T_f=self.T_f[rows])

    def axis(self, name: str) -> FloatArray:
        """The settings on one of `AXES`."""
        settings: FloatArray = getattr(self, name)
        return settings

    def range(self) -> dict[str, tuple[float, float]]:
        """Least and largest setting on each axis, SI."""
        return {name: (float(self.axis(name).min()), float(self.axis(name).max())) for name in AXES}

    def full(self) -> LossMap:
        """The cells at the largest displacement of the map: the fixed motor of paper A figure 3."""
        label = levels(self.D_m)
        return self.at(label == label.max())


AXES: Mapping[str, str] = {"D_m": "displacement", "omega_m": "rotation", "dp_m": "pressure"}
"""Axes of a map and their kinds of quantity."""
AXIS_NAMES = {"D_m": "displacement", "omega_m": "speed", "dp_m": "pressure drop"}


def levels(values: FloatArray) -> NDArray[np.intp]:
    """Number of the level that each value belongs to, rising.

    Values with less than one per cent of the largest one between them are one level. Where that makes a level wider
    than five per cent the settings are scattered, not stepped, and levels are slices of equal width.
    """
    order = np.argsort(values, kind="stable")
    largest = float(np.max(np.abs(values), initial=0.0))
    ranked = values[order]
    steps = np.concatenate(([0], np.cumsum(np.diff(ranked) > SAME * largest)))
    ends = [ranked[steps == i] for i in range(int(steps[-1]) + 1)]
    label = np.empty(len(values), dtype=np.intp)
    label[order] = steps
    if any(float(np.ptp(x)) > WIDE * largest for x in ends):
        part = np.floor((values - ranked[0]) / float(np.ptp(values)) * SLICES)
        label = np.unique(np.minimum(part, SLICES - 1), return_inverse=True)[1].astype(np.intp)
    return label


def blocks(values: FloatArray, most: int) -> NDArray[np.intp]:
    """Levels, put together to at most `most` neighbouring blocks of about the same number of levels."""
    label = levels(values)
    count = int(label.max()) + 1
    return label if count <= most else label * most // count


def understood_map(path: str | os.PathLike[str], columns: Mapping[str, Any] | None = None) -> Understood:
    """What a supplier's map holds. Errors: LogError, UnitError where it has no table."""
    table, specs, problem = open_table(path, LogError), (*SETTINGS, *LOSSES), ""
    read = understood_columns(table, specs, chosen_rows(columns or {}, specs, "columns"))
    notes: tuple[str, ...] = ()
    try:
        notes = read_map(path, columns=columns).findings
    except StillhookError as error:
        problem = str(error)
    used = {row.heading for row in read}
    unused = tuple(h for h in table.headings if h and h not in used)
    return Understood(table.name, "map of a motor", tuple(read), unused, notes, problem=problem)


@reader(LogError)
def read_map(
    path: str | os.PathLike[str],
    *,
    mapping: str | os.PathLike[str] | None = None,
    D_max: str | None = None,
    columns: Mapping[str, Any] | None = None,
) -> LossMap:
    """A supplier's map from CSV, Parquet or Excel in long form: a row a cell.

    A row has displacement, speed, pressure drop and a loss.

    Parameters
    ----------
    path : str or path-like
        The file.
    mapping : str or path-like, optional
        Mapping file with columns and units (see `stillhook.formats.table.columns`); default the headings.
    D_max : str, optional
        Full displacement, such as "215 cm^3/rev"; default the largest of the map.
    columns : mapping, optional
        Columns by name, such as {"omega_m": "Drehzahl [1/min]"}, in place of those of the mapping file.

    Returns
    -------
    LossMap
        Its cells [SI].

    Raises
    ------
    LogError, UnitError
        One line with file, row and column.

    Notes
    -----
    Columns: D_m, omega_m (or n), dp_m (or dp), and one of T_f (torque loss), T_shaft (torque at the shaft of the
    driving motor) or eta_hm (hydromechanical efficiency T_shaft / (D_m dp_m)), with the unit in the heading or in the
    mapping file. Rows that cannot be a loss (empty cells, efficiency not in (0, 100 %], negative loss, standstill) are
    left out and reported in `findings`.
    """
    table = read_columns(path, (*SETTINGS, *LOSSES), mapping, columns=columns)
    in_range(table)
    notes: list[str] = []
    loss = _loss(table, notes)
    keep = _good(table, loss, notes)
    D, n, dp = (table.values[w.name][keep] for w in SETTINGS)
    if (n < 0.0).any():
        notes.append(
            f"{int((n < 0.0).sum())} rows have negative speed: taken as positive, the loss is even in the speed"
        )
    D, n, dp, T_f = _single(D, np.abs(n), dp, loss[keep], notes)
    if len(T_f) < FEWEST_CELLS:
        raise LogError(
            f"{table.source}: {len(T_f)} cells are left; a fit needs at least {FEWEST_CELLS}. Give more of the map."
        )
    share = T_f[D * dp > 0.0] / (D * dp)[D * dp > 0.0]
    if len(share) and float(np.median(share)) > MOSTLY_LOST:
        notes.append(
            f"half of the cells lose more than {100.0 * float(np.median(share)):.0f} % of nominal torque: is it a loss?"
        )
    if table.unused:
        notes.append("columns not used: " + ", ".join(quote(h) for h in table.unused))
    full = float(D.max()) if D_max is None else parse(D_max, "displacement", "D_max")
    if full < D.max() * (1.0 - SAME):
        raise LogError(
            f"{table.source}: displacement {show(float(D.max()), 'displacement')} is beyond the motor's full"
            f" {show(full, 'displacement')}. Check the unit in the heading and the motor."
        )
    synthetic = SYNTHETIC in " ".join((table.source, *table.table.comments)).lower()
    m = LossMap(D, n, dp, T_f, full, table.source, synthetic)
    notes += [
        f"one {AXIS_NAMES[name]} only ({show(float(m.axis(name)[0]), kind)}): how the loss depends on it cannot be"
        " determined from this map"
        for name, kind in AXES.items()
        if levels(m.axis(name)).max() == 0
    ]
    return replace(m, findings=tuple(notes))


def in_range(table: Columns, unit: str = "a motor") -> None:
    """Refuse values that no motor or pump has: a wrong unit in a heading."""
    limits = {"D_m": D_RANGE, "omega_m": (-OMEGA_LARGEST, OMEGA_LARGEST), "dp_m": (-DP_LARGEST, DP_LARGEST)}
    for w in (w for w in SETTINGS if w.name in table.values):
        x, (lo, hi) = table.values[w.name], limits[w.name]
        bad = (x < lo) | (x > hi)
        if bad.any():
            i = int(np.argmax(bad))
            raise LogError(
                f"{table.source}: row {table.numbers[i]}: column {quote(table.headings[w.name])} reads"
                f" {show(float(x[i]), w.kind)}; {unit} has {show(lo, w.kind)} to {show(hi, w.kind)}. Check the number"
                " and the unit."
            )
    fastest = float(np.nanmax(np.abs(table.values["omega_m"]), initial=0.0))
    if fastest < OMEGA_SLOWEST:
        raise LogError(
            f"{table.source}: column {quote(table.headings['omega_m'])} ends at {show(fastest, 'rotation')}. Check the"
            " unit, and that no thousands sign was read as a decimal sign."
        )


def _loss(table: Columns, notes: list[str]) -> FloatArray:
    """Torque loss of every row [N m] from the first of torque loss, shaft torque and efficiency that the table has."""
    D, dp = table.values["D_m"], table.values["dp_m"]
    available = [w.name for w in LOSSES if w.name in table.values]
    if not available:
        examples = ", ".join(f'"{w.example}"' for w in LOSSES)
        raise LogError(f"{table.source}: no column with the loss. Choose one of {examples}, or map it with --mapping.")
    first, *others = available
    laws = {"T_f": lambda x: x, "T_shaft": lambda x: D * dp - x, "eta_hm": lambda x: D * dp * (1.0 - x)}
    loss: FloatArray = laws[first](table.values[first])
    heading = quote(table.headings[first])
    best = float(np.nanmax(table.values[first])) if np.isfinite(table.values[first]).any() else math.inf
    if first == "eta_hm" and best <= SPREADSHEET:  # parts of 1 under a heading in per cent, as spreadsheets write them
        raise LogError(
            f"{table.source}: column {heading} reads at most {100.0 * best:.2g} %, and no motor is that bad. Where the"
            ' cells hold parts of 1, write the heading as "eta_hm [1]".'
        )
    meaning = {
        "T_f": "torque loss",
        "T_shaft": "shaft torque of the driving motor",
        "eta_hm": "hydromechanical efficiency",
    }
    notes.append(f"column {heading} read as {meaning[first]}")
    for other in others:
        gap = np.abs(laws[other](table.values[other]) - loss)
        most = f"{np.nanmax(gap):.3g} N m" if np.isfinite(gap).any() else "nothing to compare"
        notes.append(f"column {quote(table.headings[other])} not used; losses from it differ by up to {most}")
    return loss


def _good(table: Columns, loss: FloatArray, notes: list[str]) -> BoolArray:
    """Rows that hold a loss of a running, driving motor; why the others are left out is added to the notes."""
    D, n, dp = (table.values[w.name] for w in SETTINGS)
    reasons = [
        (~np.isfinite(D + n + dp + loss), "an empty cell"),
        (dp < 0.0, "a negative pressure drop (a motor that is driven)"),
        (n == 0.0, "standstill, where a running loss has no meaning"),
    ]
    if "T_f" not in table.values and "T_shaft" not in table.values:
        eta = table.values["eta_hm"]
        reasons += [
            (dp == 0.0, "no pressure drop, where an efficiency says nothing"),
            (eta > 1.0, "an efficiency above 100 %"),
            (eta <= 0.0, "an efficiency of 0 or below"),
        ]
    keep = without(table, [*reasons, (loss < 0.0, "a negative loss")], notes)
    if keep.sum() < (1.0 - MAX_EXCLUDED) * len(keep):
        raise LogError(
            f"{table.source}: {int((~keep).sum())} of {len(keep)} rows make no sense, {notes[-1]}. Check columns and"
            " units."
        )
    return keep


def without(table: Columns, reasons: Sequence[tuple[BoolArray, str]], notes: list[str]) -> BoolArray:
    """Rows to which none of these reasons applies; how many each takes away is added to the notes."""
    keep = np.ones(len(reasons[0][0]), dtype=bool)
    for bad, reason in reasons:
        new = bad & keep
        if new.any():
            at = ", ".join(str(table.numbers[i]) for i in np.flatnonzero(new)[:3])
            notes.append(f"{int(new.sum())} rows left out for {reason} (row {at}{', ...' if new.sum() > 3 else ''})")
            keep &= ~bad
    return keep


def _single(
    D: FloatArray, n: FloatArray, dp: FloatArray, T_f: FloatArray, notes: list[str]
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Cells given more than once are averaged, and reported."""
    settings, inverse, count = np.unique(np.column_stack((D, n, dp)), axis=0, return_inverse=True, return_counts=True)
    if len(settings) == len(T_f):
        return D, n, dp, T_f
    inverse = inverse.ravel()
    mean = np.bincount(inverse, T_f) / count
    apart = float(np.abs(T_f - mean[inverse]).max())
    twice = int((count > 1).sum())
    notes.append(
        f"{twice} cells are given more than once: their mean is used, single rows differ from it by up to"
        f" {apart:.3g} N m"
    )
    return settings[:, 0], settings[:, 1], settings[:, 2], mean


Grid = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...], tuple[float, ...]]
"""Levels of displacement, speed and pressure drop, and the loss at every combination, the pressure fastest, SI."""
MOST_FILLED = 2.0
"""Combinations of levels over cells up to which a map is one with gaps, and not a cloud of settings."""


def grid_of(m: LossMap) -> Grid | None:
    """A map as a complete grid of its levels; None where a combination is missing."""
    axes = [np.unique(m.axis(name)) for name in AXES]
    if np.prod([len(a) for a in axes]) != len(m):
        return None
    order = np.lexsort((m.dp_m, m.omega_m, m.D_m))
    D, omega, dp, T = (tuple(x.tolist()) for x in (*axes, m.T_f[order]))
    return D, omega, dp, T


def gridded(m: LossMap) -> tuple[Grid, int]:
    """A map as the twin takes it: at every combination of its levels, each the mean of its settings, and how many
    combinations no cell gives, which are interpolated between cells. Errors: LogError where settings are scattered."""
    if (grid := grid_of(m)) is not None:
        return grid, 0
    labels = [levels(m.axis(name)) for name in AXES]
    axes = [np.bincount(label, m.axis(n)) / np.bincount(label) for n, label in zip(AXES, labels, strict=True)]
    places = np.ravel_multi_index(labels, [len(a) for a in axes])
    count = int(np.prod([len(a) for a in axes]))
    if count > MOST_FILLED * len(np.unique(places)):
        raise LogError(
            f"{m.source}: {len(m)} cells for {count} combinations of levels: the settings are scattered, and the twin"
            " takes a map of levels. Choose a model (--model), or give more of the map."
        )
    at = np.meshgrid(*axes, indexing="ij")
    T_f = mapped_loss(m)(at[1].ravel(), at[0].ravel(), at[2].ravel())[0]
    D, omega, dp, T = (tuple(x.tolist()) for x in (*axes, T_f))
    return (D, omega, dp, T), count - len(np.unique(places))


SAME_POINT = 1.0e-9
"""Relative: a setting that went through its unit and back is still on the edge of the map."""
MappedLoss = Callable[[Any, Any, Any], tuple[FloatArray, BoolArray]]
"""Torque loss [N m] and whether the point is inside the map, from omega_m, D_m and dp_m: floats or arrays, SI, even in
omega_m and dp_m."""


def mapped_loss(m: LossMap) -> MappedLoss:
    """The map itself as a loss model: linear between its cells; outside, the loss at the edge is held and marked.

    Parameters
    ----------
    m : LossMap
        Cells of the map [SI].

    Returns
    -------
    MappedLoss
        Called with omega_m [rad/s], D_m [m^3/rad] and dp_m [Pa]: loss [N m], and where it is inside the map.

    Raises
    ------
    LogError
        For a map of one cell.

    Notes
    -----
    Held, not continued: a straight line through the last two cells may cross zero or give a loss that was not measured.
    With held values the loss stays inside what the map has. Full grids are interpolated as the twin does it
    (trilinear, `stillhook.physics.hydraulics.motor_laws.map_torque`), others over the simplices between scattered
    cells, with the axes scaled to their range; outside of those the nearest cell counts.
    Source of the comparison: Moslatt 2020 paper D figure 3, section 2.1.
    """
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
    from scipy.spatial import QhullError

    cells = np.column_stack([m.axis(name) for name in AXES])
    lo, hi = cells.min(axis=0), cells.max(axis=0)
    used = np.flatnonzero(hi > lo)
    if not len(used):
        raise LogError(f"{m.source}: one cell cannot be interpolated. Give more of the map.")

    def scaled(points: FloatArray) -> FloatArray:
        return np.asarray((points[:, used] - lo[used]) / (hi[used] - lo[used]))

    x = scaled(cells)
    interpolated: Any
    if (grid := grid_of(m)) is not None:
        law = map_torque(*grid)
        interpolated = lambda points: law(points[:, 1], points[:, 0], points[:, 2], Measured())
    else:
        try:
            between = LinearNDInterpolator(x, m.T_f)
            interpolated = lambda points: between(scaled(points))
        except QhullError:  # the settings move together: nothing is between the cells
            interpolated = lambda points: np.full(len(points), np.nan)
    nearest: Any = NearestNDInterpolator(x, m.T_f) if len(used) > 1 else None  # all of one axis is between its cells
    slack = SAME_POINT * np.maximum(np.abs(lo), np.abs(hi))

    def loss(omega_m: Any, D_m: Any, dp_m: Any) -> tuple[FloatArray, BoolArray]:
        D, n, dp = np.broadcast_arrays(D_m, np.abs(omega_m), np.abs(dp_m))
        points = np.column_stack([a.ravel() for a in (D, n, dp)])
        inside = ((points >= lo - slack) & (points <= hi + slack)).all(axis=1)
        limited = np.clip(points, lo, hi)
        T_f = np.array(interpolated(limited), dtype=np.float64)
        between_no_cells = np.isnan(T_f)
        if between_no_cells.any():
            T_f[between_no_cells] = nearest(scaled(limited[between_no_cells]))
        return T_f.reshape(D.shape), (inside & ~between_no_cells).reshape(D.shape)

    return loss
