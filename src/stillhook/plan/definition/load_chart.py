"""A crane's load chart: SWL and dynamic factor over radius and wave height, limits of side-lead and off-lead, from a
table that users bring; and where the crane is, so that a crane tip has a radius.

One row a point, or a matrix (`stillhook.plan.definition.chart_matrix`), with units in the headings (CSV or XLSX,
`stillhook.formats.table`): `radius [m]` and `SWL [t]`; where the chart has them `Hs [m]`, `DAF [1]`, `side_lead [deg]`
and `off_lead [deg]`. Between radii numbers are interpolated along straight lines. A row of a wave height holds up to
and including that height: in a sea between two rows the next higher one applies, above the last the crane has no
capacity.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import Field

from stillhook import units as u
from stillhook.base.gateway.guard import reader
from stillhook.base.gateway.named_files import named_path
from stillhook.errors import PlanError, StillhookError, all_of
from stillhook.formats.table.columns import ColumnSpec
from stillhook.formats.table.corrections import corrections
from stillhook.formats.table.read import Columns, chosen_rows, columns_of, open_table
from stillhook.formats.table.understood import Understood, understood_columns
from stillhook.plan.definition.chart_matrix import long_form
from stillhook.sea.steady_flow import Current, Wind
from stillhook.sea.vessel.boom import Boom, TipPoint, parse_point
from stillhook.spec.crane import Crane
from stillhook.spec.lift.joining import IN_AIR, UNDER_WATER
from stillhook.spec.lift.phase import Phase
from stillhook.tables.table import Number, Spec, Text
from stillhook.units import quote, show

COLUMNS = (
    ColumnSpec("radius", "length", ("r", "working_radius", "outreach"), "radius [m]", required=True),
    ColumnSpec("SWL", "mass", ("capacity", "safe_working_load", "rated_capacity"), "SWL [t]", required=True),
    ColumnSpec("Hs", "length", ("h_s", "hm0", "significant_wave_height"), "Hs [m]"),
    ColumnSpec("DAF", "", ("dynamic_factor", "design_daf"), "DAF [1]"),
    ColumnSpec("side_lead", "angle", ("side-lead", "sidelead"), "side_lead [deg]"),
    ColumnSpec("off_lead", "angle", ("off-lead", "offlead"), "off_lead [deg]"),
)
"""Columns of a load chart; the first two are required."""
KINDS = {spec.name: spec.kind for spec in COLUMNS}
LARGEST = {"radius": 200.0, "SWL": 2e7, "Hs": 20.0, "DAF": 10.0, "side_lead": math.pi / 4.0, "off_lead": math.pi / 4.0}
"""Largest numbers of a chart [SI]; beyond is a unit that was mistaken."""
LEAST = {"radius": 1.0, "DAF": 1.0}
"""Least numbers; 0 of the others."""
SWING_DAMPING = 0.05
"""Damping of a load that swings in air, part of critical: tugger lines are slack (assumed)."""


class ChartPoint(NamedTuple):
    """What a chart says at one radius in seas up to Hs [m] (inf: of a chart without heights). SWL [kg]; DAF [1],
    side_lead, off_lead [rad]: None where the chart has no such column."""

    Hs: float
    SWL: float
    DAF: float | None = None
    side_lead: float | None = None
    off_lead: float | None = None


@dataclass(frozen=True)
class LoadChart:
    """A load chart: for each wave height [m], rising, its points as (radius [m], point), radii rising. name: that of
    its file; digest: SHA-256 of its numbers; notes: what was left out or made of a matrix."""

    name: str
    rows: tuple[tuple[tuple[float, ChartPoint], ...], ...] = field(repr=False)
    digest: str = field(default="", repr=False)
    notes: tuple[str, ...] = ()

    def at(self, radius: float) -> tuple[ChartPoint, ...]:
        """The chart at a radius [m], a point for each height, rising. It ends below the first height whose rows do not
        reach the radius; empty where none does."""
        points = []
        for row in self.rows:
            radii = np.array([r for r, _ in row])
            if not radii[0] - SAME <= radius <= radii[-1] + SAME:
                break
            values = {
                name: None if column[0] is None else float(np.interp(radius, radii, np.array(column)))
                for name, column in zip(ChartPoint._fields, zip(*(p for _, p in row), strict=True), strict=True)
            }
            points.append(ChartPoint(**values))  # type: ignore[arg-type]
        return tuple(points)

    @property
    def reach(self) -> tuple[float, float]:
        """Least and largest radius of its lowest height [m]."""
        return self.rows[0][0][0], self.rows[0][-1][0]


SAME = 1e-6
"""Radii that differ by less are one [m]."""


class ChartType(StrEnum):
    """What an SWL of a chart is: the load at rest, or one that has the dynamic factor of its wave height in it."""

    STATIC = "static"
    DYNAMIC = "dynamic"


class CapacityStatement(Spec):
    """The table [capacity]: by how much peaks may pass the SWL, and who says so. Without it, or a column DAF of a
    static chart, dynamic loads are held against the SWL itself."""

    dynamic_factor: Number = Field(ge=1.0, le=3.0, description="dynamic factor on the SWL")
    statement: Text = Field(description="who states it: letter or manual of the maker, with date and section")


class LoadChartTable(Spec):
    """The table [load_chart]."""

    file: Text = Field(description="table of the chart, CSV or XLSX")
    mapping: Text | None = Field(default=None, description="mapping file of its columns, seen from this file")
    columns: Mapping[str, Any] = Field(default_factory=dict, description="its columns, as in a mapping file")
    pedestal: Text | None = Field(
        default=None, description="axis of slewing from the vessel's reference point, as text"
    )
    radius: u.Length | None = Field(default=None, gt=0, description="radius of the crane tip, in place of pedestal")
    heel: u.Angle = Field(default=0.0, ge=0.0, le=math.radians(15.0), description="static heel with the load over side")
    trim: u.Angle = Field(default=0.0, ge=0.0, le=math.radians(15.0), description="static trim")
    swing_damping: Number = Field(default=SWING_DAMPING, gt=0.0, le=1.0, description="damping of the swinging load")
    type: ChartType = Field(
        default=ChartType.STATIC, description="dynamic: its SWL has the dynamic factor in it and is not multiplied"
    )


@dataclass(frozen=True)
class CraneChart:
    """A load chart in use: place of the crane. pedestal: its axis of slewing (x, y) from the vessel's reference
    point [m], or radius of the tip [m] in its place; the other fields as of `LoadChartTable`."""

    chart: LoadChart
    pedestal: tuple[float, float] | None = None
    radius: float | None = None
    heel: float = 0.0
    trim: float = 0.0
    swing_damping: float = SWING_DAMPING
    type: ChartType = ChartType.STATIC

    @property
    def states_factor(self) -> bool:
        """Whether the chart states a dynamic factor by which peaks may pass its SWL."""
        return self.type is ChartType.STATIC and self.chart.rows[0][0][1].DAF is not None

    def radius_of(self, tip: TipPoint) -> float:
        """Horizontal distance of a crane tip from the axis of slewing [m]."""
        if self.pedestal is None:
            assert self.radius is not None
            return self.radius
        return math.hypot(tip.x - self.pedestal[0], tip.y - self.pedestal[1])

    def direction_of(self, tip: TipPoint) -> float | None:
        """Where the boom points, counter-clockwise from the bow [rad]; None where only its radius is known."""
        if self.pedestal is None:
            return None
        return math.atan2(tip.y - self.pedestal[1], tip.x - self.pedestal[0])

    def at(self, tip: TipPoint) -> tuple[ChartPoint, ...]:
        """The chart at the radius of a crane tip."""
        return self.chart.at(self.radius_of(tip))

    def inputs(self) -> dict[str, Any]:
        """What results follow from, as plain data."""
        place = {name: getattr(self, name) for name in ("pedestal", "radius", "heel", "trim", "swing_damping")}
        return {
            "chart": self.chart.digest,
            **place,
            **({} if self.type is ChartType.STATIC else {"type": self.type.value}),
        }

    def static_leads(self, tip: TipPoint) -> dict[str, float]:
        """off_lead and side_lead of a wire that hangs still under a crane that heels and trims with the vessel [rad];
        empty where the direction of the boom is not known."""
        psi = self.direction_of(tip)
        if psi is None:
            return {}
        c, s = abs(math.cos(psi)), abs(math.sin(psi))
        return {"off_lead": self.trim * c + self.heel * s, "side_lead": self.trim * s + self.heel * c}

    def judges_leads(self, phase: Phase, current: Current | None = None) -> bool:
        """Whether leads of a phase can be determined: where the direction of the boom is known, in air, and with a
        current under water."""
        return self.pedestal is not None and phase.kind in (IN_AIR if current is None else (*IN_AIR, *UNDER_WATER))

    def notes(
        self, phases: Sequence[Phase], current: Current | None = None, wind: Wind | None = None
    ) -> tuple[str, ...]:
        """What a reader should know of the chart, and of side-lead and off-lead: where they are judged, and where
        not."""
        return (*(f"{self.chart.name}: {note}" for note in self.chart.notes), *self._of_leads(phases, current, wind))

    def _of_leads(self, phases: Sequence[Phase], current: Current | None, wind: Wind | None) -> tuple[str, ...]:
        point = self.chart.rows[0][0][1]
        if point.side_lead is None and point.off_lead is None:
            return (f"side-lead and off-lead NOT JUDGED: {self.chart.name} has no limits of them",)
        if self.pedestal is None:
            return (
                "side-lead and off-lead NOT JUDGED: load_chart.radius does not say where the boom points. Give"
                " load_chart.pedestal",
            )
        wet = ", ".join(p.name for p in phases if self.judges_leads(p, current) and not self.judges_leads(p))
        judged = ", ".join(p.name for p in phases if self.judges_leads(p))
        left = ", ".join(p.name for p in phases if not self.judges_leads(p, current))
        vessel = f"heel {show(self.heel, 'angle')}, trim {show(self.trim, 'angle')}"
        flow, missing = ("", "wind, tug lines") if wind is None else (f", {wind.describe()}", "tug lines")
        how = (
            f"side-lead and off-lead in {judged}: a load that swings freely in air with {self.swing_damping:.2g} of"
            f" critical damping, {vessel}{flow}; {missing} and slewing are left out"
        )
        water = f"side-lead and off-lead in {wet}: {current.describe()}, with the pendulum in waves" if current else ""
        reason = f"side-lead and off-lead NOT JUDGED in {left}: waves and current move the load sideways"
        return tuple(line for line, names in ((how, judged), (water, wet), (reason, left)) if names)


def crane_chart(table: LoadChartTable, file: Path, crane: Crane, boom: Boom | None) -> CraneChart:
    """The chart of a plan file's table [load_chart]; file: its path; boom: of the plan, whose pedestal is then the
    axis of slewing.

    Errors: PlanError, LogError, UnitError of one line: a chart that cannot be read, one that carries more than the
    crane, and an axis of slewing that is missing or given twice.
    """
    wrong = lambda why: PlanError(f"load_chart.mapping = {quote(table.mapping)}: {why}")
    mapping = None if table.mapping is None else named_path(file.parent, table.mapping, wrong)
    chart = read_load_chart(file, mapping, table.columns)
    for radius, point in (each for row in chart.rows for each in row):
        if point.SWL > crane.SWL * (1.0 + SAME):
            raise PlanError(
                f"{chart.name}: SWL {show(point.SWL, 'mass')} at {show(radius, 'length')} is above the SWL"
                f" {show(crane.SWL, 'mass')} of {crane.name}. Correct the chart, or name its crane."
            )
    ways = [name for name in ("pedestal", "radius") if getattr(table, name) is not None]
    if boom is not None and ways:
        raise PlanError(f"load_chart.{ways[0]}: [boom] has the pedestal. Leave {ways[0]} out.")
    if boom is None and len(ways) != 1:
        came = "both are given" if ways else "the axis of slewing is missing"
        raise PlanError(
            f'load_chart: {came}. Give pedestal, such as pedestal = "x=-10 m, y=-6 m", or radius, or a table [boom].'
        )
    pedestal = None if boom is None else (boom.x, boom.y)
    if table.pedestal is not None:
        at = parse_point(table.pedestal, "load_chart.pedestal")
        pedestal = (at.x, at.y)
    return CraneChart(chart, pedestal, table.radius, table.heel, table.trim, table.swing_damping, table.type)


@reader(PlanError)
def read_load_chart(
    path: str | Path, mapping: str | Path | None = None, columns: Mapping[str, Any] | None = None
) -> LoadChart:
    """A load chart from a CSV or XLSX file; mapping, columns: as in `stillhook.formats.table.corrections`.

    Errors: UnitError, PlanError of one line that names file and row: a column that is missing or has no
    unit, an empty cell, numbers that no crane has, radii of a height that do not rise, more SWL in a higher sea.
    """
    read, notes = _columns(path, mapping, columns)
    if problems := [problem for name in read.values for problem in _wrong_numbers(read, name)]:
        raise all_of(problems)
    chart = LoadChart(read.source, _rows(read), _digest(read), notes)
    _check_heights(chart)
    return chart


def _columns(
    path: str | Path, mapping: str | Path | None, columns: Mapping[str, Any] | None
) -> tuple[Columns, tuple[str, ...]]:
    rows = corrections(mapping) | dict(columns or {})
    chosen = chosen_rows(rows, COLUMNS, "columns" if mapping is None else f"{Path(mapping).name}: columns")
    table, notes = long_form(open_table(path, PlanError), {spec.name: spec for spec in COLUMNS}, chosen)
    return columns_of(table, COLUMNS, chosen), notes


def understood_chart(
    path: str | Path, mapping: str | Path | None = None, columns: Mapping[str, Any] | None = None
) -> Understood:
    """What a load chart holds. Errors: as `read_load_chart` where no table of a chart is found."""
    rows = corrections(mapping) | dict(columns or {})
    chosen = chosen_rows(rows, COLUMNS, "columns")
    whole = open_table(path, PlanError)
    table, notes = long_form(whole, {spec.name: spec for spec in COLUMNS}, chosen)
    if table is whole:
        read = understood_columns(table, COLUMNS, chosen)
        used = {row.heading for row in read}
        unused = tuple(h for h in table.headings if h and h not in used)
    else:
        read, unused = understood_columns(table, COLUMNS, {}), ()
    problem = ""
    try:
        read_load_chart(path, mapping, columns)
    except StillhookError as error:
        problem = str(error)
    return Understood(table.name, "load chart", tuple(read), unused, notes, problem=problem, fixed=table is not whole)


def _wrong_numbers(columns: Columns, name: str) -> Iterator[StillhookError]:
    """What to refuse of a column, row by row."""
    values, unit = columns.values[name], KINDS[name]
    for number, value in zip(columns.numbers, values, strict=True):
        where = f"{columns.source}: row {number}: {columns.headings[name]}"
        if math.isnan(value):
            yield PlanError(f"{where}: empty. Write a number; where the crane may not lift, SWL 0 or no row.")
            continue
        low, high = LEAST.get(name, 0.0), LARGEST[name]
        if not low <= value <= high:
            ends = [show(x, unit) if unit else f"{x:g}" for x in (value, low, high)]
            yield PlanError(f"{where} = {ends[0]}: not between {ends[1]} and {ends[2]}. Check number and unit.")


def _rows(columns: Columns) -> tuple[tuple[tuple[float, ChartPoint], ...], ...]:
    """Points by height, rising, in the order of the file within each."""
    values = columns.values
    heights = values["Hs"] if "Hs" in values else np.full(len(columns.numbers), math.inf)
    rows = []
    for Hs in np.unique(heights):
        places = np.flatnonzero(heights == Hs).tolist()
        points = []
        for i in places:
            others = {name: float(values[name][i]) for name in ChartPoint._fields if name in values}
            points.append((float(values["radius"][i]), ChartPoint(**{**others, "Hs": float(Hs)})))
        for (i, j), (a, b) in zip(pairwise(places), pairwise(radius for radius, _ in points), strict=True):
            if b - a <= SAME:
                of = "" if math.isinf(Hs) else f" at Hs {show(float(Hs), 'length')}"
                raise PlanError(
                    f"{columns.source}: row {columns.numbers[j]}: radius {show(b, 'length')} after {show(a, 'length')}"
                    f" in row {columns.numbers[i]}: radii{of} must rise, each once. Put the rows in order."
                )
        rows.append(tuple(points))
    return tuple(rows)


def _check_heights(chart: LoadChart) -> None:
    """Refuse more SWL in a higher sea at one radius."""
    for lower, higher in pairwise(chart.rows):
        below = dict(lower)
        for radius, point in higher:
            if radius in below and point.SWL > below[radius].SWL * (1.0 + SAME):
                raise PlanError(
                    f"{chart.name}: at {show(radius, 'length')} the SWL rises from {show(below[radius].SWL, 'mass')} at"
                    f" Hs {show(below[radius].Hs, 'length')} to {show(point.SWL, 'mass')} at Hs"
                    f" {show(point.Hs, 'length')}: capacity does not rise with Hs. Correct the chart."
                )


def _digest(columns: Columns) -> str:
    parts = [part for name in sorted(columns.values) for part in (name.encode(), columns.values[name].tobytes())]
    return hashlib.sha256(b"\0".join(parts)).hexdigest()
