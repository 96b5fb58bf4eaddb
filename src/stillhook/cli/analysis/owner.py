"""The owner's view of `stillhook compare --drives TABLE.toml`: costs, vessel days, deck area and mass."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from stillhook.analysis.drives.costs import CELLS, NOT_STATED, PAPER, SCALED, omissions, owner_rows
from stillhook.report.formatting import DAY, EMPTY, fmt
from stillhook.units import number

if TYPE_CHECKING:
    from stillhook.analysis.drives.comparison import DriveComparison
    from stillhook.analysis.drives.costs import CostFile, OwnerRow
    from stillhook.plan.definition.lift_plan import LiftPlan

HEADERS = ("drive", "energy", "main-\ntenance", "capital", "vessel", "vessel\ndays", "sum of\nstated", "limits")
MEANINGS = {
    PAPER: "no such winch is built (crane file)",
    SCALED: "the drive of another crane, recalculated for this one",
}
"""What is said of the winches that are not as built."""


def owner_view(
    result: DriveComparison, costs: CostFile, lift_plan: LiftPlan | None, plan: Mapping[str, Any] | None
) -> tuple[OwnerRow, ...]:
    """The owner's table; plan: what `days_gained` answers for the lift plan."""
    days = None
    if plan is not None and lift_plan is not None:
        waits = {name: row["wait"] for name, row in plan["drives"].items()}
        days = {name: None if wait is None else wait + lift_plan.T_POP / DAY for name, wait in waits.items()}
    return owner_rows(result, costs, days)


def owner_json(rows: Sequence[OwnerRow], costs: CostFile) -> dict[str, Any]:
    """The owner's table for JSON."""
    drives = {row.name: row.to_dict() for row in rows}
    return {"currency": costs.currency, "per": "year", "drives": drives, "remarks": omissions(rows)}


def owner_title(costs: CostFile) -> str:
    """Title of the owner's table."""
    unit = f"{costs.currency} per year" if costs.currency else "none stated"
    return f"costs, {unit}; {EMPTY}: {NOT_STATED}"


def owner_remarks(rows: Sequence[OwnerRow]) -> list[str]:
    """What the sums leave out, deck areas and masses, and which winches are not as built."""
    return [" ".join(omissions(rows)), _places(rows), *_bases(rows)]


def owner_row(row: OwnerRow) -> list[str]:
    """A drive by `HEADERS`."""
    return [
        f"{row.name} (paper)" if row.basis == PAPER else row.name,
        *(_amount(row.costs[name]) for name in CELLS),
        EMPTY if row.vessel_days is None else number(row.vessel_days, 3),
        _amount(row.total),
        "within" if row.status == "ok" else "exceeded",
    ]


def _amount(x: float | None) -> str:
    return EMPTY if x is None else f"{float(f'{x:.3g}'):,.0f}".replace(",", " ")


def _places(rows: Sequence[OwnerRow]) -> str:
    """Deck area and mass of each drive with their source."""
    parts = []
    for row in rows:
        stated = [
            f"{fmt(value, kind, 3)} ({row.sources[name]})"
            for name, kind, value in (("footprint", "area", row.footprint), ("mass", "mass", row.mass))
            if value is not None
        ]
        parts += [f"{row.name} {', '.join(stated)}"] if stated else []
    missing = [row.name for row in rows if row.footprint is None and row.mass is None]
    parts += [f"{NOT_STATED} for {', '.join(missing)}"] if missing else []
    return f"Deck area and mass: {'; '.join(parts)}."


def _bases(rows: Sequence[OwnerRow]) -> Iterator[str]:
    for basis, meaning in MEANINGS.items():
        if names := [row.name for row in rows if row.basis == basis]:
            yield f"{basis.capitalize()}: {', '.join(names)}; {meaning}."
