"""The section of the report on failure cases, from the facts alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from stillhook.plan.assessments.failures.drive_off import TIMES_ONLY
from stillhook.plan.definition.rules import Alternative
from stillhook.report.document import Bullets, Part, Section, Table, Text, Verdict
from stillhook.report.formatting import EMPTY, direction, fixed, fmt, percent

Facts = Mapping[str, Any]

VERDICTS = {
    "ok": ("OK", True),
    "not-ok": ("not OK", False),
    "not-assessed": ("not assessed", None),
    "does-not-apply": ("does not apply", None),
}
REASONS = {
    "no-runs": "not simulated: the plan was made without runs of the twin, or no controller is shown",
    "no-gas": "no gas carries the load on this winch type",
    "no-phase": "no phase of the plan in which this can happen",
    "no-passage": "no phase passes the surface",
    "no-rule": "no rule of the plan limits it",
    "refused": "not simulated",
    "runs-away": "the winch moves the load by itself, and must be stopped manually",
    TIMES_ONLY: "times to the off-lead limit below; compare with the time that your crew and DP need",
}
MINUTE = 60.0
ACTIONS = {"hold": "hold", "hoist": "hoist", "lower-on": "lower further", "not-assessed": "not assessed"}
BASES = {"twin": "runs of the twin", "closed-form": "closed form", "frequency": "frequency domain"}
STOP_REASONS = {"loads": "loads beyond a limit", "touch-down": "touch-down speed beyond its limit"}


def section(of: Facts) -> list[Part]:
    """Text, verdicts, AHC lost, depths, and each case in detail."""
    if not of["seas"]:
        return [Text("No sea state is within the limits of the lift: failure cases were not assessed.")]
    return [
        Text(_basis(of)),
        _verdicts(of),
        *_lost(of),
        _actions(of),
        *_detail(of),
        _drive_off(of),
        Bullets(_not_assessed(of)),
    ]


def _basis(of: Facts) -> str:
    a = of["assumed"]
    return (
        f"In the seas of the claimable limit with {Alternative(of['alternative']).label}, at the worst heading of every"
        f" period, each failure begins at {of['moments']} moments of {of['trains']} wave trains, and the"
        f" {fmt(of['after'], 'time')} after it count."
        " The worst moment is compared with the limits of loads and touch-down of the lift without a failure;"
        " tolerances of the load's motion are not, since the landing is broken off. Other failures are run"
        f" in the sea in which the trip is the worst. A stop in the wave zone lasts {a['hold'] / MINUTE:.0f} min"
        f" ({of['held_runs']} runs). Assumed: drift of the motion unit {fmt(a['drift'], 'speed', 2)}, a load cell that"
        f" reads {a['load_cell_over']:g} times the SWL, one of {a['bottles']} gas bottles. Heights from which a limit"
        " is passed are rounded down to 0.05 m, the seas of the limit to 0.01 m."
    )


def _verdicts(of: Facts) -> Table:
    rows = []
    for case in of["cases"]:
        word, passed = ("by times", None) if case.get("reason") == TIMES_ONLY else VERDICTS[case["verdict"]]
        rows.append((case["title"], Verdict(word, passed), _why(case), _from(case), *_peaks(case)))
    header = ("failure", "verdict", "what governs", "from Hs", "hook load", "least sling", "motion", "touch-down")
    return Table(header, rows, "Verdicts")


def _why(case: Facts) -> str:
    """What governs a case, or why there is no verdict."""
    if case.get("reason"):
        return REASONS[case["reason"]] + (f": {case['text']}" if case.get("text") else "")
    top = case["worst"]
    if case.get("touch_down") == "not-ok":
        loads = "loads within limits" if case["loads"] == "ok" else _worst(top)
        return f"{loads}; touch-down beyond its limit near the seabed"
    return _worst(top)


def _worst(top: Facts) -> str:
    place = "" if top["z"] is None else f" at {_depth(top['z'])}"
    used = "" if top["used"] is None else f", {percent(min(top['used'], 99.0))} used"
    return f"{top['rule'].replace('-', ' ')} in {top['phase']}{place}, Tp {fmt(top['Tp'], 'time')}{used}"


def _from(case: Facts) -> str:
    Hs = case.get("Hs_from")
    return ("any" if case["verdict"] == "not-ok" else EMPTY) if Hs is None else f"{fixed(Hs, 2)} m"


def _peaks(case: Facts) -> tuple[str, str, str, str]:
    """Largest and least numbers of all rows of a case."""
    rows = [*case["rows"], *case.get("by_depth", [])]

    def most(name: str, kind: str, of: Any = max) -> str:
        values = [row[name] for row in rows if row[name] is not None]
        return fmt(of(values), kind, 3) if values else EMPTY

    return (
        most("F_top_max", "force"),
        most("F_sling_min", "force", min),
        most("load_pp", "length"),
        _speed(max((row["v_landed"] for row in rows if row["v_landed"] is not None), default=None)),
    )


def _lost(of: Facts) -> list[Part]:
    """AHC lost: loads and touch-down on the brake."""
    steady, near = of["steady"], of["near_seabed"]
    loads, touch = steady["loads"], steady["touch_down"]
    highest = fmt(steady["highest"], "length")
    text = (
        "The load on the brake after AHC is lost, by the frequency-domain method at all headings; the trip itself is"
        " run up to the limit of the lift, and of both the lower height counts on page 1: "
    )
    if loads["Hs_from"] is None:
        text += f"loads stay within limits up to Hs {highest}, the highest sea state analysed"
    else:
        text += (
            f"loads within limits up to Hs {fixed(loads['Hs_from'], 2)} m ({loads['rule'].replace('-', ' ')} in"
            f" {loads['phase']} at Tp {fmt(loads['Tp'], 'time')}, {direction(loads['beta'])})"
        )
    if touch["limit"] is None:
        return [Text(text + "; no rule limits a touch-down.")]
    limit = _speed(touch["limit"])
    text += (
        f"; touch-down stays below {limit}"
        if touch["Hs_from"] is None
        else f"; touch-down over {limit} from Hs {fixed(touch['Hs_from'], 2)} m"
    )
    if near["depth"] is not None:
        text += (
            f". In the seas of the limit the load moves {fmt(near['fall'], 'length', 3)} down from where it is"
            f" suspended: no stop below {near['depth']:.1f} m"
        )
    if touch["Hs_from"] is None:
        return [Text(f"{text}.")]
    rows = [
        (
            fmt(row["Tp"], "time"),
            f"{fixed(row['Hs_limit'], 2)} m",
            f"> {highest}" if row["Hs_from"] is None else f"{fixed(row['Hs_from'], 2)} m",
        )
        for row in touch["by_period"]
    ]
    return [Text(text + "."), Table(("Tp", "limit of the lift", f"touch-down over {limit} from"), rows)]


def _actions(of: Facts) -> Section:
    rows = [
        (
            row["phase"],
            _span(row["top"], row["bottom"]),
            ACTIONS[row["action"]] + ("" if row["to"] is None else f" to {_depth(row['to'])}"),
            "at once" if row["time"] == 0.0 else fmt(row["time"], "time", 2),
        )
        for row in of["actions"]
    ]
    stops = [
        f"{row['phase']}, {_span(row['top'], row['bottom'])}: {STOP_REASONS[row['reason']]} ({BASES[row['method']]})"
        for row in of["no_stop"]
    ]
    none = "No depth was found in which the load must not be stopped in the seas of the limit."
    return Section(
        "If AHC trips, by depth",
        [
            Table(("phase", "depth of the underside", "action", "safe after"), rows),
            Text("No stop in these depths:" if stops else none),
            Bullets(stops),
            Text(
                "Times are those of the way at the speeds of the phases, from the place of the band that is the"
                " furthest from its end. Hoisting and lowering need power: in a blackout the load stays where it"
                " is until power is back."
            ),
        ],
    )


def _detail(of: Facts) -> Iterator[Part]:
    """Every case by phase and period."""
    for case in of["cases"]:
        if not case["rows"]:
            continue
        parts: list[Part] = [_rows(case["rows"])]
        if case.get("by_depth"):
            parts.append(_rows(case["by_depth"], "By depth, in the period that is the worst"))
        if case.get("time"):
            parts.append(Text("Hoisting back: " + "; ".join(_back(row) for row in case["time"]) + "."))
        yield Section(case["title"], parts)


def _back(row: Facts) -> str:
    return f"from the end of {row['phase']} {fmt(row['time'], 'time', 3)}"


def _rows(rows: Sequence[Facts], title: str = "") -> Table:
    header = (
        "phase",
        "Tp",
        "Hs",
        "rule",
        "used",
        "from Hs",
        "hook load",
        "least sling",
        "motion",
        "down",
        "touch-down",
    )
    cells = []
    for row in sorted(rows, key=_in_order(rows)):
        place = "" if row["z"] is None else f", {_depth(row['z'])}"
        cells.append(
            (
                row["phase"] + place,
                fmt(row["Tp"], "time"),
                f"{fixed(row['Hs'], 2)} m",
                EMPTY if row["rule"] is None else row["rule"].replace("-", " "),
                EMPTY if row["used"] is None else percent(min(row["used"], 99.0)),
                EMPTY if row["Hs_from"] is None else f"{fixed(row['Hs_from'], 2)} m",
                fmt(row["F_top_max"], "force", 3),
                fmt(row["F_sling_min"], "force", 3),
                fmt(row["load_pp"], "length", 3),
                _speed(row["v_down"]),
                _speed(row["v_landed"]),
            )
        )
    return Table(header, cells, title)


def _in_order(rows: Sequence[Facts]) -> Callable[[Facts], tuple[int, float]]:
    """Phases and depths as they come, periods rising."""
    places = list(dict.fromkeys((row["phase"], row["z"]) for row in rows))
    return lambda row: (places.index((row["phase"], row["z"])), row["Tp"])


def _drive_off(of: Facts) -> Section:
    case = next(case for case in of["cases"] if case["key"] == "drive-off")
    a = case["assumed"]
    rows = [
        (
            row["phase"],
            _depth(row["z"]),
            fmt(row["angle"], "angle", 3) + ("" if row["from_chart"] else " (assumed)"),
            fmt(row["way"], "length", 3),
            fmt(row["time_drive_off"], "time", 2),
            fmt(row["time_drift_off"], "time", 2),
        )
        for row in case["off_lead"]
    ]
    header = ("phase", "depth", "off-lead allowed", "way", "drive-off", "drift-off")
    text = (
        "Time until the wire is at its off-lead limit, by closed form: the twin has no horizontal motion. The load is"
        f" taken to stay where it is. Assumed: drive-off {fmt(a['drive_off'], 'acceleration', 2)}, drift-off"
        f" {fmt(a['drift_off'], 'acceleration', 2)} up to {fmt(a['drift_speed'], 'speed', 2)}."
    )
    return Section(case["title"], [Text(text), Table(header, rows)])


def _not_assessed(of: Facts) -> list[str]:
    judged = [case for case in of["cases"] if case.get("reason") != TIMES_ONLY]
    lines = [f"Not assessed: {case['title']}." for case in judged if case["verdict"] == "not-assessed"]
    return [
        *lines,
        "Not assessed: lift-off from and set-down on the vessel's own deck, a brake that slips or does not close,"
        " failures of two things at once,"
        " water that a payload holds as it is hoisted out.",
    ]


def _speed(v: float | None) -> str:
    """A speed at touch-down, which limits state in m/s."""
    return EMPTY if v is None else f"{fixed(v, 2)} m/s"


def _depth(z: float) -> str:
    """A height of the underside as a depth, or a height above the water."""
    return fmt(round(0.0 - z, 1), "length", 5) if z <= 0.0 else f"{fmt(z, 'length', 3)} above water"


def _span(top: float, bottom: float) -> str:
    return _depth(top) if top == bottom else f"{_depth(top)} to {_depth(bottom)}"
