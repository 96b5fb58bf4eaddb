"""Which alternatives a result distinguishes. Without runs of the twin, closed form and frequency-domain method may give
several the same limits: that is no comparison of controllers, and is not printed as one."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from stillhook.plan.definition.compensation import Alternative
from stillhook.plan.definition.demand import Tier
from stillhook.plan.result.result import CREDITS, PlanResult

if TYPE_CHECKING:
    import xarray

CENTIMETRES = 2
"""Digits after the point of a limit [m], as tables print it."""
PRINTED = {"days_gained": 0.05, "hours_gained": 0.5}
"""Differences [days, hours a year] below which tables print 0."""
CLASSIC = "best-classic"
"""What the gain of a controller over the better classic one is told over."""
NEW = tuple(alternative for alternative in Alternative if alternative.twin and not alternative.classic)
"""Controllers that are held against the classic ones."""
MEANS = {Tier.CLOSED_FORM: "The closed form does", Tier.FREQUENCY: "Closed form and frequency-domain method do"}


def ran(tiers: Collection[str]) -> bool:
    """Whether runs of the twin are among the tiers of an answer."""
    return Tier.TIME.value in tiers


def equal_in_print(data: xarray.Dataset) -> list[list[str]]:
    """Alternatives whose own limits are printed alike in every cell, side by side."""
    groups: dict[bytes, list[str]] = {}
    for name in data["alternative"].values:
        limits = data["Hs_limit"].sel(credit=CREDITS[0], alternative=name).values
        groups.setdefault((np.round(limits, CENTIMETRES) + 0.0).tobytes(), []).append(str(name))
    return list(groups.values())


def columns(result: PlanResult) -> list[list[str]]:
    """Alternatives that share a column of limits: with runs of the twin each has its own."""
    if ran(result.facts.get("tiers", ())):
        return [[str(name)] for name in result.data["alternative"].values]
    return equal_in_print(result.data)


def merged(rows: Iterable[Sequence[str]], result: PlanResult, *, between: str = ", ") -> list[list[str]]:
    """Rows of a table by alternative, its label first; without runs of the twin those that are printed alike are
    one."""
    if ran(result.facts.get("tiers", ())):
        return [list(row) for row in rows]
    groups: dict[tuple[str, ...], list[str]] = {}
    for label, *cells in rows:
        groups.setdefault(tuple(cells), []).append(label)
    return [[between.join(labels), *cells] for cells, labels in groups.items()]


def references(block: xarray.Dataset, tiers: Collection[str]) -> list[str]:
    """What gains are told over: the better classic controller only where the answer tells a new one from it."""
    over = [str(name) for name in block["over"].values] if "over" in block.dims else []
    return over if ran(tiers) or _gains(block) else [name for name in over if name != CLASSIC]


def _gains(block: xarray.Dataset) -> bool:
    """Whether a new controller is told from the better classic one."""
    new = [a.value for a in NEW if a.value in block["alternative"].values]
    if CLASSIC not in block["over"].values or not new:
        return True
    year = block.sel(alternative=new, over=CLASSIC, month=0)
    return any(bool((np.abs(np.nan_to_num(year[name].values)) >= least).any()) for name, least in PRINTED.items())


def not_compared(
    data: xarray.Dataset, weather: xarray.Dataset | None, tiers: Collection[str], *, compensated: bool
) -> str:
    """A line on the controllers that the answer does not tell apart, empty where there are none; compensated: whether
    any phase is."""
    if not compensated:
        return "No phase is compensated: all alternatives are one winch, and no comparison of them is made."
    if ran(tiers):
        return ""
    twins = {a.value for a in Alternative if a.twin}
    groups = [group for group in equal_in_print(data) if len(group) > 1 and twins & set(group)]
    left = weather is not None and "over" in weather.dims and not _gains(weather)
    if not groups and not left:
        return ""
    means = MEANS[Tier.FREQUENCY if Tier.FREQUENCY.value in tiers else Tier.CLOSED_FORM]
    apart = [f"distinguish {' and '.join(filter(None, [', '.join(group[:-1]), group[-1]]))}" for group in groups]
    apart += ["distinguish a new controller's waiting from that of the best classic one"] if left else []
    return (
        f"{means} not {', nor '.join(apart)}: no comparison of them is made. Runs of the twin (--tier time) compare"
        " them."
    )
