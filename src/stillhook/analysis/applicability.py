"""Where on a map a controller can be used, and if not, why: one table of rules, worst first."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

from stillhook.spec.scenario import Mode
from stillhook.winches.registry import WINCH_TYPES

SATURATION_SHARE = 0.1
"""Part of the counted time for which full pumps are tolerated [-]. A sine that is beyond the pumps for a tenth of the
time demands 1.2 % more speed than is available (1 / cos theta, theta = pi/20), and 0.13 % of its stroke is missed (sin
theta - theta cos theta): less than what friction costs."""


class Rule(NamedTuple):
    """cause in words; mark of a few letters for tables; whether it holds, from summary, mode and load over SWL; reason
    in words."""

    cause: str
    mark: str
    holds: Callable[[Mapping[str, Any], Mode, float], bool]
    reason: str


def _status(word: str) -> Callable[[Mapping[str, Any], Mode, float], bool]:
    """Whether the run's status names this limit, however short it was passed."""

    def holds(summary: Mapping[str, Any], mode: Mode, share: float) -> bool:
        return word in summary["status"].split(", ")

    return holds


def _saturated(summary: Mapping[str, Any], mode: Mode, share: float) -> bool:
    return bool(summary["saturation_time"] > SATURATION_SHARE * summary["counted_time"])


def _too_heavy(summary: Mapping[str, Any], mode: Mode, share: float) -> bool:
    return share > mode.law.swl_share * (1.0 + 1e-9)


_LIMITS = (
    Rule("diverged", "div", _status("diverged"), "the run diverged: a state is no longer finite"),
    Rule(
        "energy does not add up",
        "audit",
        _status("audit"),
        "the energy balance is not closed; the results are not reliable",
    ),
    Rule("unstable", "unst", _status("unstable"), "K_p above the gain of marginal stability of the linear loop"),
    Rule("slack wire", "slack", _status("slack"), "the wire is slack for a time; none is tolerated"),
    Rule(
        "wire at its end",
        "wire",
        _status("wire"),
        "last turns of wire, or the hook at the crane tip; none is tolerated",
    ),
    Rule(
        "accumulator at its end",
        "acc",
        _status("accumulator"),
        "the passive circuit stops carrying the load; none is tolerated",
    ),
    Rule(
        "motors too fast",
        "fast",
        _status("overspeed"),
        "above the maker's limit at this displacement; none is tolerated",
    ),
    Rule("cavitation", "cav", _status("cavitation"), "a line at or below zero gauge; none is tolerated"),
    Rule("relief valves", "rel", _status("relief"), "no pressure is left for what was not planned; none is tolerated"),
    Rule(
        "hydraulic power",
        "pow",
        _status("power"),
        "the power units are at their limit, or more is fed back than they take",
    ),
    Rule(
        "boost exhausted",
        "boost",
        _status("boost"),
        "the boost pump is at its limit, cavitation follows; none is tolerated",
    ),
)
_COMMON_STATUS = (
    *("diverged", "audit", "unstable", "slack", "wire"),
    *("accumulator", "overspeed", "cavitation", "relief", "power", "boost"),
)
"""Words of a status that these rules name."""


def _own_limits() -> Iterator[Rule]:
    """A rule for each limit that a winch type alone has; its word in the status is its mark."""
    words = dict.fromkeys(word for winch in WINCH_TYPES.values() for word in winch.causes.values())
    for word in words:
        if word not in _COMMON_STATUS:
            yield Rule(f"{word} limit", word, _status(word), "a limit of this winch type is passed; none is tolerated")


RULES = (
    *_LIMITS,
    *_own_limits(),
    Rule(
        "pumps saturated",
        "sat",
        _saturated,
        "full pumps for more than a tenth of the counted time: the speed demanded is not available",
    ),
    Rule("uncompensated", "unc", _status("uncompensated"), "the error is about as large as the tip's motion"),
    Rule(
        "load above limit of mode",
        "load",
        _too_heavy,
        "more than the controller may carry; HS 60 % of the SWL (paper C)",
    ),
)
"""Why a controller is not applicable, worst first; the first that holds is the cause. A standing offset is not a cause:
it shows in e_c_mean, and pure active winches have one by design. Limits without a tolerated time are passed or not:
what they guard does not
wait."""
MARKS: Mapping[str, str] = {r.cause: r.mark for r in RULES}


def cause_of(summary: Mapping[str, Any], mode: Mode, share: float) -> str:
    """Why this controller cannot be used in this cell, or "" where it can.

    Parameters: summary of the cell's run (keys and SI of `stillhook.variables.SUMMARY`); mode of the controller; share
    load over SWL [-].
    """
    return next((r.cause for r in RULES if r.holds(summary, mode, share)), "")
