"""What the sections of a plan's report have in common: the alternative that leads, its limits, and ranges in words.

Fixed texts of a plan's report: marks, reading of the tables, basis of the numbers, exclusions.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.report.figures.style import CREDITED, TWIN, height, named, names
from stillhook.plan.result import Credit, PlanResult
from stillhook.plan.table import LimitTable
from stillhook.report.formatting import EMPTY, direction, fmt, kind_of
from stillhook.units import number


def leading(result: PlanResult) -> str:
    """The alternative that the first page tells: that of the facts, else the twin alternative with the largest limits,
    as credited."""
    wanted = str(result.facts.get("shown") or "")
    labels = names(result.data)
    if wanted in labels:
        return wanted
    twins = [a.value for a in result.alternatives if a.twin] or labels

    def mean(name: str, credit: Credit) -> float:
        limits = np.minimum(result.data["Hs_limit"].sel(credit=credit, alternative=name).values, highest(result))
        return round(float(np.nan_to_num(limits).mean()), 9)

    return max(twins, key=lambda name: (mean(name, CREDITED), mean(name, TWIN)))


def highest(result: PlanResult) -> float:
    """The highest sea state analysed [m]."""
    return float(result.data.attrs["Hs_highest"])


def limits(result: PlanResult, credit: Credit, alternative: str) -> FloatArray:
    """Limiting heights (heading, period) [m]."""
    return np.asarray(result.data["Hs_limit"].sel(credit=credit, alternative=alternative).values, dtype=float)


def reading(result: PlanResult) -> str:
    """How the table is read between and beyond its cells, in words."""
    data, name = result.data, leading(result)
    tolerance = float(data.attrs.get("heading_tolerance", 0.0))
    cells = limits(result, CREDITED, name)
    return LimitTable(cells, data["heading"].values, data["period"].values, tolerance, highest(result)).described()


def least(Hs: FloatArray) -> FloatArray:
    """Least limit over the headings, of (heading, period) [m]; NaN where one of them is not told."""
    return np.asarray(Hs.min(axis=0))


def worst_heading(Hs: FloatArray) -> list[int]:
    """Place of the heading with the least limit in every period; one that is not told comes first."""
    return [int(i) for i in np.where(np.isnan(Hs), -1.0, Hs).argmin(axis=0)]


def between(Hs: FloatArray, top: float) -> str:
    """Range of limits in words: "1.65 m to 3.24 m", "2.2 m to above 4 m"; "no result" where none is."""
    known = Hs[~np.isnan(Hs)]
    if not known.size:
        return "no result"
    low, high = (_in_words(float(x), top) for x in (known.min(), known.max()))
    return low if low == high else f"{low} to {high}"


def _in_words(Hs: float, top: float) -> str:
    return f"above {number(top, 3)} m" if Hs > top else f"{height(Hs, top)} m"


def over(values: Sequence[float] | FloatArray, kind: str) -> str:
    """Range of values in words: "5 s to 16 s", "150° to 180°"."""
    ends = [direction(x) if kind == "angle" else fmt(float(x), kind) for x in (min(values), max(values))]
    return ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}"


def governs(phase: str, rule: str) -> str:
    """What governs, in words."""
    return f"{phase}: {rule.replace('-', ' ')}" if phase and rule else "-"


def valued(value: object, quantity: str) -> str:
    """A limit in the display unit of its quantity; a name stays what it is."""
    if not isinstance(value, int | float):
        return EMPTY if value is None else str(value)
    kind = kind_of(quantity)
    if kind == "speed":  # at sea motions are told in m/s, winches in m/min
        return f"{fmt(value, digits=3)} m/s ({fmt(value, kind, 3)})"
    return fmt(value, kind)


def of_rule(facts_: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """A rule's row by its key; empty where the facts have none."""
    return next((row for row in facts_["rules"]["rows"] if row["key"] == key), {})


def labelled(alternatives: Iterable[str]) -> str:
    """Alternatives as they are called, in a row."""
    return ", ".join(named(a) for a in alternatives)


HEADING = "Lift plan"
PURPOSE = "limiting sea states, weather window and credit of heave compensation"
SYNTHETIC = "SYNTHETIC WEATHER: the waiting times below come from a simulated series and say nothing about a real site"
SYNTHETIC_CERTIFICATE = "SYNTHETIC CERTIFICATE: it was made from simulated logs, of no real crane"
CHECK = (
    "Standards are named from memory and were not quoted clause by clause: check every clause and every number against"
    " the edition that your operation is approved by. Rules and their limits are a versioned file that can be edited;"
    " what was changed is listed below."
)
CREDIT = (
    "Without a verified model of the heave compensator no more than 80 % of compensation may be credited. Wherever a"
    " certificate does not cover the sea and the phase, a twin is therefore credited with the less favourable of its"
    " result and that of a flat 80 % compensation, quantity by quantity; where the certificate covers, with its result."
    " Both limits are reported: credited, and simulated (not creditable). (DNV GL as cited by Moslåt 2020, section 2.6;"
    " check against your edition.)"
)
COVERED = (
    "Covered: share of the analysed seas, in phases with compensation, that are inside the certificate's envelope."
)
TIERS: Mapping[str, str] = {
    "closed-form": (
        "simplified method of DNV-RP-N103 in the wave zone (for Tz from 8.9 sqrt(Hs/g) to 13 s), statics and one spring"
        " below; always reported for comparison. Meant to be on the safe side in the wave zone; near resonance in"
        " deep water it is"
        " not, for it sees one period"
    ),
    "frequency": (
        "response amplitude operators, wire as an elastic rod, drag and the winch's residual motion linearised to each"
        " sea; gives the complete table"
    ),
    "time": (
        "the twin in the time domain in irregular seas: hydraulics, control, drum, wire, slack slings, water surface;"
        " for cells near the limit, with one random sea a seed"
    ),
}
COUNTS = (
    "The limit of a rule is that of the highest tier: time domain where it was run, else frequency domain, else"
    " closed form. The limit of a cell is the least over phases and rules."
)
LEVELS: Mapping[str, str] = {"mpm": "most probable largest", "p90": "90 % fractile of the largest", "mean": "mean"}
EXTREMES = (
    "Largest values are those of the duration of the phase, at the level that each rule names. In the time domain the"
    " largest value of each seed is fitted by a Gumbel distribution by maximum likelihood; seeds are added until the 95"
    " % interval of demand over limit closes to a stated width or the stated most of seeds is reached. All alternatives"
    " see the same random seas."
)
READING = (
    "In each cell: limiting Hs in metres, below it phase (P) and rule (R) that govern, by the numbers of the tables of"
    ' phases and rules. "> {highest}" means that the highest sea state analysed is still within the limits: then that'
    " height is"
    " the limit. 0: not even a calm is within them. Headings are directions in which waves travel from the bow: 180°"
    " head"
    " sea, 90° coming from starboard, 0° following."
)
ALPHA = (
    "The operational limit OP_LIM is lowered to OP_WF = alpha OP_LIM because forecasts are uncertain: the forecast"
    " must stay at"
    " or below OP_WF for the whole reference period T_R from the decision to start."
)
PERSISTENCE = (
    "Waiting is counted from every record to the first one that starts a window of T_R with every record at or below"
    " OP_WF of its period and direction; windows break at gaps. Starts without such a window before the series ends are"
    " censored and left out of the statistics: where there are many, true waiting is longer. Vessel days are mean"
    " waiting and T_R together."
)
UNSAFE = (
    (
        "Limited flooding of the payload is not modelled: weight in water is too large at first, and slack slings at"
        " the surface are underrated."
    ),
    (
        "Water draining from the payload on recovery is not modelled: the load is too light. Add the trapped water"
        " manually."
    ),
    "Waves next to the vessel: diffraction and shelter are not modelled, the incident wave is used.",
    (
        "Touch-down speeds from runs are those after the cushion of water over the seabed, a coefficient of the"
        " payload file (assumed, not measured); without it they are higher, in the calm by a third."
    ),
    (
        "Human action, tugger handling, remotely operated vehicles, visibility, survey limits and simultaneous"
        " operations have separate limits that may govern."
    ),
)
"""In addition to the facts of a result; see docs/explanation/payload-in-water.md."""
UNVALIDATED = (
    "The twin of this crane is not validated against tests of the crane: limits by the twin are for information, the"
    " credited ones count."
)
AGAIN = (
    (
        "The same plan, inputs, version and tier give the same numbers; the same result folder gives the same bytes of"
        " this document on any day. Its number is that of all inputs above and of the tiers that were run."
    ),
    (
        "To repeat: {command}, then stillhook report FOLDER. To change a rule: copy the rule set, edit it, name it in"
        " the plan."
    ),
)
