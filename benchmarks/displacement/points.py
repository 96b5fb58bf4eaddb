"""Settings that are tried: the threshold of SSC and FF, and the cost of displacement by an optimum."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Any, NamedTuple

from stillhook import Crane
from stillhook.control.registry import Mode
from stillhook.library import changed

PUBLISHED, STRONG, OPTIMAL, FF = "ssc", "strong-ssc", "ssc-optimal", "ff"
THRESHOLDS = (0.3, 0.45, 0.6, 0.75, 0.9, 0.97)
"""u_thr [-]; 0.6 is that of the crane files."""
SHOWN = (0.3, 0.6, 0.97)
"""Those of the tables."""
COSTS = {"w_Q": (0.0, 0.1, 0.3, 1.0), "u_most": (0.75, 0.9), "w_s": (0.0, 0.3), "k_load": (0.0, 0.7, 1.0)}
"""Settings of `[control.ssc_optimal]`; w_s [s], the others [-]."""
DEFAULT = {"w_Q": 0.0, "u_most": 0.9, "w_s": 0.0, "k_load": 0.7}
LEADS = (0.035, 0.05, 0.065, 0.08, 0.1, 0.12)
"""Leads that are tried [s]; those of SSC as published are the crane file's."""


class Point(NamedTuple):
    """A controller with settings: family as in tables, mode, and what is set, SI."""

    family: str
    mode: str
    settings: tuple[tuple[str, float], ...]

    @property
    def key(self) -> str:
        return " ".join([self.family, *(f"{name}={value:g}" for name, value in self.settings)])

    @property
    def fixed(self) -> bool:
        """Whether gain and lead are those of the crane file."""
        return self.family == PUBLISHED

    def on(self, crane: Crane, lead: float, K_p: float) -> Crane:
        """The crane with these settings, the lead [s] and the gain [1/m]."""
        values: dict[str, Any] = {n: f"{x:g} s" if n == "w_s" else x for n, x in self.settings}
        control: dict[str, Any] = {"ssc_optimal": values} if self.mode == OPTIMAL else values
        if not self.fixed:
            control = {**control, "t_lead": f"{1e3 * lead:g} ms", "K_p": f"{K_p:g} 1/m"}
        return changed(crane, {"control": control})

    @property
    def law(self) -> Mode:
        return Mode(self.mode)


def thresholds(family: str, mode: str) -> list[Point]:
    return [Point(family, mode, (("u_thr", u),)) for u in THRESHOLDS]


def optimal(**settings: float) -> Point:
    """Displacement by an optimum: defaults but for these settings."""
    return Point(OPTIMAL, OPTIMAL, tuple({**DEFAULT, **settings}.items()))


def usual(family: str, mode: str) -> Point:
    return Point(family, mode, (("u_thr", 0.6),))


def grid() -> list[Point]:
    """Displacement by an optimum with all settings."""
    return [optimal(**dict(zip(COSTS, values, strict=True))) for values in product(*COSTS.values())]


def all_points() -> list[Point]:
    """All points of the trade-off curves."""
    return [*thresholds(PUBLISHED, "ssc"), *thresholds(STRONG, "ssc"), *grid(), *thresholds(FF, "ff")]


def point_of(one: Mapping[str, Any]) -> Point:
    """The point of what is stored."""
    family = one["family"]
    return Point(family, "ssc" if family == STRONG else family, tuple(one["settings"].items()))


def usual_and_best(curves: Mapping[str, Mapping[str, Any]]) -> dict[str, Mapping[str, Any]]:
    """Of the stored curves strong SSC and FF with the crane file's threshold, and displacement by an optimum as it
    comes, without pre-load, and with the settings that have the least error, to 0.1 mm, in the seas that settings are
    chosen in."""
    optima = [one for one in curves.values() if one["family"] == OPTIMAL]
    points = {STRONG: usual(STRONG, "ssc"), FF: usual(FF, FF), "default": optimal(), "no pre-load": optimal(k_load=0.0)}
    tuned = min(optima, key=lambda one: round(one["chosen_in"]["e_c_pp"], 4))
    return {label: curves[point.key] for label, point in points.items()} | {"tuned": tuned}
