"""What drives cost their owner: a table of prices that the user fills in, put on a comparison's energies and days.

Nothing is invented: an empty cell stays empty, and each sum lists what it leaves out.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import BeforeValidator, Field, model_validator

from stillhook import units as u
from stillhook.analysis.drives.comparison import DriveComparison, DriveRun
from stillhook.errors import SpecError
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind
from stillhook.report.formatting import HOUR
from stillhook.tables.table import Count, Number, Spec, Text
from stillhook.winches.registry import WINCH_TYPES

NOT_STATED = "not stated"
LONGEST_YEAR = 366.0
"""[d]"""
PAPER, SCALED, AS_BUILT = "paper", "scaled", "as built"
"""Whether the winch that a drive was sized from is built."""
CELLS = ("energy", "maintenance", "capital", "vessel")
"""Costs of a year that are added up."""
_MONEY = re.compile(r"([0-9]+(?:\.[0-9]+)?(?:e[0-9]+)?) ?([^\W\d_]{1,4}|[€$£])(?:/(kWh|d|year))?")


class Money(NamedTuple):
    """An amount of a currency, by what."""

    amount: float
    currency: str
    per: str


def _empty(value: Any) -> Any:
    return None if isinstance(value, str) and not value.strip() else value


def _money(per: str) -> Any:
    written = f"150 EUR/{per}" if per else "150000 EUR"

    def read(value: Any) -> Any:
        if _empty(value) is None:
            return None
        match = _MONEY.fullmatch(value.strip()) if isinstance(value, str) else None
        if match is None or (match[3] or "") != per:
            raise ValueError(f'give an amount with its currency, such as "{written}", or "" where it is not known.')
        return Money(float(match[1]), match[2], per)

    return BeforeValidator(read)


PerEnergy = Annotated[Money | None, _money("kWh")]
PerDay = Annotated[Money | None, _money("d")]
PerYear = Annotated[Money | None, _money("year")]
Once = Annotated[Money | None, _money("")]
Blank = BeforeValidator(_empty)
"""A cell that may be empty."""


class YearTable(Spec):
    """The table [year]: how the winch is used."""

    hours: Annotated[u.Hours | None, Blank] = Field(
        default=None, gt=0, le=8784 * HOUR, description="hours of a year in heave compensation at this motion"
    )
    operations: Annotated[Number | None, Blank] = Field(
        default=None, gt=0, le=10000, description="operations of the plan (--plan) in a year"
    )
    vessel: PerDay = Field(
        default=None, description='hire of vessel and crew for a day of waiting or operation, such as "150000 EUR/d"'
    )
    write_off: Annotated[Count | None, Blank] = Field(
        default=None, description="years over which capital is spread, evenly and without interest"
    )


class EnergyTable(Spec):
    """The table [energy]: price of a kWh by its source."""

    grid: PerEnergy = Field(default=None, description='electric energy from the vessel\'s grid, such as "0.15 EUR/kWh"')
    hydraulic: PerEnergy = Field(default=None, description="energy at the pump shafts of the hydraulic power units")
    returned: PerEnergy = Field(default=None, description="worth of energy that a drive gives back; empty: nothing")


class DriveTable(Spec):
    """A table [drive.NAME]: a drive of this size, as offered."""

    maintenance: PerYear = Field(default=None, description='such as "60000 EUR/year"')
    capital: Once = Field(default=None, description='purchase and installation, such as "4e6 EUR"')
    footprint: Annotated[u.Area | None, Blank] = Field(default=None, gt=0, description="deck area of winch and drive")
    mass: Annotated[u.Mass | None, Blank] = Field(default=None, gt=0, description="mass of winch and drive")
    source: Annotated[Text | None, Blank] = Field(default=None, description="where these numbers are from")


class CostFile(Spec):
    """Drives that are compared, with what they cost; cells may be empty."""

    year: YearTable = Field(default_factory=YearTable, description="table [year]")
    energy: EnergyTable = Field(default_factory=EnergyTable, description="table [energy]")
    drive: Mapping[str, DriveTable] = Field(min_length=1, description="a table [drive.NAME] for each drive")

    @model_validator(mode="after")
    def _one_currency(self) -> CostFile:
        written = dict(_amounts(self))
        first = next(iter(written.items()), None)
        for place, money in written.items():
            if first is not None and money.currency != first[1].currency:
                raise ValueError(
                    f"{place} is in {money.currency}, {first[0]} in {first[1].currency}. Write one currency."
                )
        return self

    @property
    def currency(self) -> str:
        """Currency of all amounts, "" where there is none."""
        return next((money.currency for _, money in _amounts(self)), "")


def _amounts(file: CostFile) -> Iterator[tuple[str, Money]]:
    tables: dict[str, Spec] = {"year": file.year, "energy": file.energy}
    tables |= {f"drive.{name}": table for name, table in file.drive.items()}
    for where, table in tables.items():
        for name in type(table).model_fields:
            if isinstance(value := getattr(table, name), Money):
                yield f"{where}.{name}", value


def load_costs(path: str | Path) -> CostFile:
    """Read a table of costs. Errors: SpecError, UnitError of one line that names file and field."""
    return read_toml(path, FileKind.COSTS, SpecError, _read, start="Write one with: stillhook new drives FILE.")


def _read(table: TomlTable) -> CostFile:
    file = table.read(CostFile)
    for name in file.drive:
        if name not in WINCH_TYPES:
            raise SpecError(f"{table.place('drive', name)}: unknown drive. Choose {', '.join(WINCH_TYPES)}.")
    return file


@dataclass(frozen=True)
class OwnerRow:
    """A drive from its owner's view; None where a cell is empty.

    costs: amounts of a year by `CELLS`; vessel_days of waiting and operation in a year; footprint [m^2] and mass [kg]
    with where each is from; basis: whether such a winch is built.
    """

    name: str
    basis: str
    status: str
    costs: Mapping[str, float | None]
    vessel_days: float | None
    footprint: float | None
    mass: float | None
    sources: Mapping[str, str]

    @property
    def left_out(self) -> tuple[str, ...]:
        """Costs that the sum leaves out."""
        return tuple(name for name in CELLS if self.costs[name] is None)

    @property
    def total(self) -> float | None:
        """Sum of a year of the costs that are stated; None without any."""
        stated = [x for x in self.costs.values() if x is not None]
        return sum(stated) if stated else None

    def to_dict(self) -> dict[str, Any]:
        """Its numbers, SI; amounts for a year."""
        return {
            "basis": self.basis,
            "status": self.status,
            "costs": dict(self.costs),
            "sum": self.total,
            "left_out": list(self.left_out),
            "vessel_days": self.vessel_days,
            "footprint": self.footprint,
            "mass": self.mass,
            "sources": dict(self.sources),
        }


def owner_rows(
    comparison: DriveComparison, costs: CostFile, days: Mapping[str, float | None] | None = None
) -> tuple[OwnerRow, ...]:
    """The owner's table of a comparison, the lowest sum first among those that leave out the same.

    days: vessel days of one operation by drive, waiting included; None without a plan.
    """
    rows = [_row(run, costs, (days or {}).get(run.name), comparison.reference.name) for run in comparison.runs]
    return tuple(sorted(rows, key=lambda row: (len(row.left_out), row.left_out, row.total or math.inf)))


def basis_of(run: DriveRun, reference: str) -> str:
    """Whether the winch that a drive was sized from is built: "paper" where its crane file says that it is not."""
    if run.drive.crane.paper:
        return PAPER
    return AS_BUILT if run.drive.source == reference and run.drive.size == 1.0 else SCALED


def _row(run: DriveRun, costs: CostFile, days: float | None, reference: str) -> OwnerRow:
    year, table, basis = costs.year, costs.drive.get(run.name, DriveTable()), basis_of(run, reference)
    vessel_days = None if days is None or year.operations is None else days * year.operations
    spread = None if table.capital is None or year.write_off is None else table.capital.amount / year.write_off
    hire = None if vessel_days is None or year.vessel is None else vessel_days * year.vessel.amount
    maintenance = None if table.maintenance is None else table.maintenance.amount
    size: dict[str, float | None] = {}
    sources: dict[str, str] = {}
    for name in ("footprint", "mass"):
        size[name], sources[name] = getattr(table, name), table.source or "table of costs"
        of = run.drive.crane.installation
        if size[name] is None and of is not None and getattr(of, name) is not None:
            size[name] = getattr(of, name)
            sources[name] = run.drive.crane.sources[f"installation.{name}"].text
        if size[name] is None:
            sources[name] = NOT_STATED
    amounts = {"energy": _energy(run, costs), "maintenance": maintenance, "capital": spread, "vessel": hire}
    return OwnerRow(run.name, basis, run.status, amounts, vessel_days, size["footprint"], size["mass"], sources)


def _energy(run: DriveRun, costs: CostFile) -> float | None:
    """Energy of a year at the nominal values: what is drawn at the price of its source, less what is returned."""
    rows = {row.name for row in run.drive.crane.plant.type.rows}
    price = costs.energy.grid if "P_el" in rows else costs.energy.hydraulic
    hours, E = costs.year.hours, run.energy
    if price is None or hours is None or not math.isfinite(E.net):
        return None
    drawn, returned = (u.in_unit(x, "kWh", "energy") for x in (E.drawn, E.returned))
    back = 0.0 if costs.energy.returned is None else costs.energy.returned.amount * returned
    return hours / HOUR * (price.amount * drawn - back)


def omissions(rows: Sequence[OwnerRow]) -> list[str]:
    """What sums leave out, in sentences: one for all drives where it is the same; and operations that no year holds."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for row in rows:
        groups.setdefault(row.left_out, []).append(row.name)
    lines = []
    for left_out, names in groups.items():
        of = "All sums" if len(groups) == 1 else f"Sum of {', '.join(names)}"
        verb = "leave" if len(groups) == 1 or len(names) > 1 else "leaves"
        nothing = f"{of} {'include' if verb == 'leave' else 'includes'} every cost of the table"
        lines.append(f"{of} {verb} out: {', '.join(left_out)}." if left_out else f"{nothing}.")
    if len(groups) > 1:
        lines.append("Sums that leave out different costs do not compare.")
    crowded = [f"{row.name} {row.vessel_days:.0f}" for row in rows if (row.vessel_days or 0.0) > LONGEST_YEAR]
    if crowded:
        lines.append(
            f"Vessel days that no year holds: {', '.join(crowded)}. State fewer operations, or plan for a season."
        )
    return lines
