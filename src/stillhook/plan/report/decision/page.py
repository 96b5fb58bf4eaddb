"""The decision page as parts of a document: one sheet of paper at 9 pt, whatever the plan."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from stillhook.plan.assessments.failures.drive_off import TIMES_ONLY
from stillhook.plan.assessments.hindcast import in_days
from stillhook.plan.assessments.rigging.section import AT_LIMIT
from stillhook.plan.assessments.sensitivity import assumed
from stillhook.plan.report.decision.bands import forecast, headline, label, limit, open_bands, stopped
from stillhook.plan.report.decision.status import SYNTHETIC
from stillhook.plan.report.words import TEXTS, governs, named, write
from stillhook.plan.result import grouped
from stillhook.report.document import Bullets, Cell, Columns, Document, Figure, Part, Section, Table, Text, Verdict
from stillhook.report.formatting import fixed, fmt, hours

NOT_ASSESSED = TEXTS["decision"]["not_assessed"]
LONG, NAME, PHASE = 60, 40, 24
"""Letters of a cell of the page, of a name in a sentence, and of that of a phase in a cell, at most."""
REASON, BASIS = 90, 110
"""Letters of a reason of the status, and of what a capacity is of, at most."""


def page(of: Mapping[str, Any], figure: Figure | None) -> list[Part]:
    """Status and the seven sections of the page; of: `stillhook.plan.report.decision.data.decision`."""
    return [
        status(of["status"]),
        Section("1  Decision", _decision(of, figure)),
        Section("2  AHC lost in the same seas", _ahc_lost(of)),
        Section("3  Loads", _loads(of)),
        Section("4  Failure cases at the limit, worst moment (peaks: section on failure cases)", _failures(of)),
        Section("5  Assumed numbers that govern", [Bullets(_assumed(of))]),
        Section("6  Not covered, unsafe side first, and who covers it", [Text(_not_covered(of["not_covered"]))]),
        Section("7  Quality", [Text(_quality(of))]),
    ]


def _not_covered(of: Sequence[str]) -> str:
    text = "; ".join(of)
    return f"{text[:1].upper()}{text[1:]}."


def status(of: Mapping[str, Any]) -> Verdict:
    """STATUS with the reasons against approval, in as few words as they have."""
    word = TEXTS["decision"]["for_approval" if of["for_approval"] else "not_for_operation"]
    texts = grouped((each["code"], clipped(each["text"], REASON)) for each in of["reasons"])
    reasons = [f"{first}{f' (and {len(others)} more)' if others else ''}" for first, *others in texts.values()]
    line = "; ".join(reasons)
    return Verdict(f"STATUS: {word}", bool(of["for_approval"]), [f"{line[:1].upper()}{line[1:]}."] if line else [])


def clipped(text: str, most: int) -> str:
    """A text in so many letters, cut at a word."""
    return textwrap.shorten(text, most, placeholder=" ...")


def claim_words(of: Mapping[str, Any]) -> str:
    """The claimable limit, in large type."""
    range_ = headline(of["claim"]["bands"])
    return write(TEXTS["decision"]["claim"], range=range_) if range_ else TEXTS["decision"]["no_claim"]


def credit_words(credit: Mapping[str, Any]) -> str:
    """What a claim rests on."""
    return write(TEXTS["credit_by"][credit["by"]], **credit)


def claim_basis(of: Mapping[str, Any]) -> str:
    """Winch, seas, credit and forecast limit of the claim, in a sentence."""
    claim = of["claim"]
    if claim["credit"] is None:
        return f"Claimable limit: {NOT_ASSESSED}."
    bands = claim["bands"]
    seas = open_bands(bands)
    values = {
        "name": named(claim["alternative"]),
        "seas": f"Tp {seas}" if seas else "no Tp",
        "credit": credit_words(claim["credit"]),
    }
    return write(TEXTS["decision"]["claim_by"], op_wf=headline(bands, "op_wf") or "-", no_go=stopped(bands), **values)


def waiting_words(hindcast: Mapping[str, Any] | None) -> list[str]:
    """Waiting by what may be claimed, with its sampling error, and by what is credited where that is more."""
    texts = TEXTS["decision"]
    if hindcast is None or "waiting" not in hindcast:
        return []
    lines = [write(texts["waiting"], window=hours(hindcast["window"]), wait=_fractiles(hindcast))]
    if (credited := hindcast.get("as_credited")) is not None:
        lines.append(write(texts["if_real"], wait=_fractiles(credited)))
    return lines


def _fractiles(of: Mapping[str, Any]) -> str:
    """P50 and P90 of waiting over the whole year."""
    year = next((row for row in of.get("waiting", ()) if row["month"] == 0), None)
    if year is None:
        return str(TEXTS["decision"]["no_window"])
    return ", ".join(f"{name} {in_days(year[key])} d" for name, key in (("P50", "wait_p50"), ("P90", "wait_p90")))


def _decision(of: Mapping[str, Any], figure: Figure | None) -> list[Part]:
    head: list[Part] = [Text(f"{times(of['operation'])} {_rules(of)} {_alpha(of['operation'])}")]
    if not of["claim"]["bands"]:
        return [*head, Text(claim_basis(of))]
    bands = [band_row(band) for band in of["claim"]["bands"]]
    table = Table(("Tp", "OP_LIM", "OP_WF", "alpha", "governs; Hs in m"), bands, bold_columns=(2,))
    claim = Verdict(claim_words(of), None, [claim_basis(of), *waiting_words(of["hindcast"])])
    return [*head, claim, table if figure is None else Columns([table, figure], (8, 5))]


def band_row(band: Mapping[str, Any]) -> list[str]:
    """A band as a row of a table."""
    phase, rule, end = (band[f"governing_{key}"] or "" for key in ("phase", "rule", "end"))
    by = governs(clipped(phase, PHASE), rule, end) if phase or end else ""
    reason = band["no_go"] or ("highest sea analysed" if band["above"] else "")
    text = f"{by} ({reason})" if by and reason else by or reason
    return [label(band), limit(band), forecast(band), fixed(band["alpha"], 2), clipped(text, LONG)]


def times(op: Mapping[str, Any]) -> str:
    """Times of the operation, in a sentence."""
    contingency = "T_C not assessed" if op["T_C"] is None else f"T_C {hours(op['T_C'])}"
    restricted = "Weather restricted" if op["weather_restricted"] else "NOT weather restricted (design for extremes)"
    summed = "" if op.get("T_POP_given", True) else " (sum of the phases)"
    times = {key: hours(op[key]) for key in ("T_POP", "T_R")}
    more = {"restricted": restricted, "summed": summed, "contingency": contingency}
    lead = f" ({hours(op['lead'])} before the start)" if op.get("lead") else ""
    return write(TEXTS["decision"]["times"], lead=lead, **more, **times)


def _rules(of: Mapping[str, Any]) -> str:
    rules, by = of["rules"], of["rules"]["entered_by"]
    editions = write(TEXTS["decision"]["editions"], by=clipped(by, NAME)) if by else TEXTS["decision"]["no_editions"]
    return write(TEXTS["decision"]["rules"], by=editions, **rules)


def _alpha(op: Mapping[str, Any]) -> str:
    table = op.get("alpha_table")
    if table is None:
        return f"alpha: {NOT_ASSESSED}."
    return write(TEXTS["decision"]["alpha"], **{**NOT_STATED, **{key: x for key, x in table.items() if x}})


NOT_STATED = dict.fromkeys(("level", "monitoring", "edition"), "not stated")
"""Of a table of forecast factors, where it does not say."""


def _ahc_lost(of: Mapping[str, Any]) -> list[Part]:
    """Up to which sea loads and touch-down stay within limits on the brake, and the way to a safe state."""
    lost = of["failures"]
    if lost is None:
        return [Text(f"{NOT_ASSESSED.capitalize()}.")]
    texts, own = TEXTS["ahc_lost"], lost["page"]
    highest = own["loads_highest"]
    loads = _loads_on_brake(lost)
    lines = [loads] if trip_assessed(lost) else [f"{texts['no_trip']} {loads[:1].lower()}{loads[1:]}"]
    if own["touch_down_limit"] is not None:
        Hs, limit = own["touch_down_from"], own["touch_down_limit"]
        key = "touch_down" if Hs is not None else "no_touch_down"
        lines.append(write(texts[key], v=limit, Hs=highest if Hs is None else Hs))
    if own["no_stop_below"] is not None:
        lines.append(write(texts["no_stop_below"], depth=own["no_stop_below"]))
    moves = [each for each in lost["actions"] if each["action"] not in (HOLD, "not-assessed")]
    if moves:
        slowest = max(moves, key=lambda each: float(each["time"]))
        lines.append(write(texts["safe"], **action_words(slowest), time=slowest["time"]))
    return [Text(" ".join([*lines, texts["card"]]))]


def _loads_on_brake(failures: Mapping[str, Any]) -> str:
    """Up to which sea loads stay within limits: through the trip as far as it was run, and on the brake after it."""
    texts, own = TEXTS["ahc_lost"], failures["page"]
    to, run_to = own["loads_to"], own.get("trip_run_to") if trip_assessed(failures) else None
    line = write(texts["loads"], Hs=to) if to is not None else write(texts["loads_all"], Hs=own["loads_highest"])
    if run_to is None or (to is not None and to <= run_to):
        return line
    return f"{write(texts['trip'], Hs=run_to)} {line[:1].lower()}{line[1:]}"


def trip_assessed(failures: Mapping[str, Any]) -> bool:
    """Whether a trip of AHC was simulated."""
    return any(case["key"] == "ahc-trip" and case["verdict"] != "not-assessed" for case in failures["cases"])


HOLD = "hold"
"""Action where the payload may hang as it is."""


def action_words(row: Mapping[str, Any]) -> dict[str, str]:
    """Phase, depths and action of a band in which AHC is lost."""
    ends = list(dict.fromkeys(depth_words(row[key]) for key in ("top", "bottom")))
    to = "" if row["to"] is None else f" to {depth_words(row['to'])}"
    return {
        "phase": clipped(row["phase"], NAME),
        "depth": " to ".join(ends),
        "action": f"{TEXTS['actions'][row['action']]}{to}",
    }


def depth_words(z: float) -> str:
    """A height of the payload's underside as a depth."""
    return fmt(round(0.0 - z, 1), "length", 5) if z <= 0.0 else f"{fmt(z, 'length', 3)} above water"


def _loads(of: Mapping[str, Any]) -> list[Part]:
    """Weights, hook load against the capacity, and rigging by its worst item."""
    rigging = of["rigging"]
    if rigging is None:
        return [Text(f"{NOT_ASSESSED.capitalize()}.")]
    weight, legs, texts = rigging["weight"], rigging["legs"], TEXTS["loads"]
    key = "weight" if weight is not None and weight["stated"] else "no_weight"
    lines = [write(texts[key], **(weight or {"SHL": rigging["SHL"]}))]
    used = [row for row in rigging["hook_loads"] if row["utilisation"] is not None]
    if used:
        row = max(used, key=lambda each: float(each["utilisation"]))
        static = max(float(each["static_high"]) for each in rigging["hook_loads"])
        basis = clipped(row["capacity_basis"], BASIS)
        values = {**row, "phase": clipped(row["phase"], NAME), "static_high": static, "capacity_basis": basis}
        read = texts["at_limit"] if 1.0 < row["utilisation"] <= AT_LIMIT else ""
        lines.append(write(texts["hook_load"], **values, read=read))
    if legs is None:
        return [Text(" ".join([*lines, texts["no_legs"]]))]
    item = legs["worst"]
    lines.append(write(texts["legs"], **legs))
    lines.append(
        texts["no_items"] if item is None else write(texts["item"], **{**item, "name": clipped(item["name"], NAME)})
    )
    return [Text(" ".join(lines))]


def _failures(of: Mapping[str, Any]) -> list[Part]:
    """Verdict of every case, with the sea from which it is not within limits."""
    if of["failures"] is None:
        return [Text(f"{NOT_ASSESSED.capitalize()}.")]
    rows = [_case(each) for each in of["failures"]["cases"]]
    half = (len(rows) + 1) // 2
    head = ("case", "verdict", "from Hs")
    tables = [Table(head, part) for part in (rows[:half], rows[half:]) if part]
    return [Columns(tables, [1.0] * len(tables))]


def _case(case: Mapping[str, Any]) -> list[Cell]:
    word, passed = VERDICTS[case["verdict"]] if case.get("reason") != TIMES_ONLY else ("by times", None)
    Hs = case.get("Hs_from")
    from_ = f"{Hs:.2f} m" if Hs is not None else "any" if case["verdict"] == "not-ok" else ""
    return [clipped(case["title"], CASE), Verdict(word, passed), from_]


CASE = 40
"""Letters of the title of a failure case at most."""
VERDICTS = {
    "ok": ("OK", True),
    "not-ok": ("not OK", False),
    "not-assessed": (NOT_ASSESSED, None),
    "does-not-apply": ("no such case", None),
}
"""Words of the verdicts of failure cases, and whether they passed."""


def _assumed(of: Mapping[str, Any]) -> list[str]:
    if of["assumed"] is None:
        return [f"{NOT_ASSESSED.capitalize()}."]
    rows = of["assumed"]["rows"][: assumed.MOST]
    lines = [write(TEXTS["decision"]["assumed"], **{**row, "moves": _moves(row)}) for row in rows]
    return [clipped(line, LINE) for line in lines] or ["None."]


def _moves(row: Mapping[str, Any]) -> str:
    """By how much a limit changes with the other value: the limits themselves are simulated, and not claimable."""
    base, other = row.get("Hs_from"), row.get("Hs_to")
    text, _, value = str(row["moves"]).partition(": Hs ")
    if text != row.get("phase"):
        return text
    value = value.partition(" with ")[2]
    change = f"{100.0 * (other / base - 1.0):+.0f} %" if base and other is not None else ""
    return write(TEXTS["decision"]["moved"], phase=text, change=change, value=value)


LINE = 124
"""Letters of a line of the page at most."""


def _quality(of: Mapping[str, Any]) -> str:
    """Agreement of the methods, seeds, and the hindcast."""
    runs, hindcast = of["runs"], of["hindcast"]
    agreement, texts = _agreement(of["quality"]), TEXTS["decision"]
    seeds = runs["seeds_per_cell"]
    ran = "No runs of the twin." if not runs["n"] else f"{runs['n']:,} runs, {seeds[0]} to {seeds[1]} seeds a cell."
    if hindcast is None:
        return " ".join((agreement, ran, texts["no_hindcast"]))
    known = hindcast["source"].startswith(SYNTHETIC) or not hindcast["synthetic"]
    source = hindcast["source"] if known else f"{SYNTHETIC} {hindcast['source']}"
    days = {key: hindcast[key][:10] for key in ("first", "last")}
    return " ".join((agreement, ran, write(texts["hindcast"], **{**hindcast, "source": source, **days})))


def subtitle(about: Mapping[str, Any]) -> str:
    """Lift, field and place of a document, in a line."""
    return clipped("; ".join(filter(None, (about["lift"], about["field"], about["place"]))), SUBTITLE)


SUBTITLE = 230
"""Letters of the line below the title at most."""


def signatures(about: Mapping[str, Any]) -> tuple[str, ...]:
    """Captions of the lines to sign on."""
    names = (("Prepared by", about["prepared_by"]), ("Checked by", about["checked_by"]))
    signed = (f"{caption} {clipped(name, LONG)}".strip() for caption, name in names)
    return (*signed, "Accepted by (marine warranty surveyor), place and date")


def sheet(of: Mapping[str, Any], parts: Sequence[Part], made_by: str, title: str, marks: Sequence[str]) -> Document:
    """One page of its own: this one, or the limits card."""
    about = of["document"]
    return Document(
        title=title,
        name=about["name"],
        subtitle=subtitle(about),
        marks=marks,
        front=parts,
        signatures=signatures(about),
        number=about["number"],
        revision=about["revision"],
        dense=True,
        date=about["date"],
        made_by=made_by,
    )


def _agreement(quality: Mapping[str, Any] | None) -> str:
    """By how much the methods differ, what contradicts its runs, and steep seas."""
    texts = TEXTS["agreement"]
    if quality is None:
        return str(texts["missing"])
    worst = quality["agreement"]
    failed = sum(len(check["failed"]) for check in quality["checks"])
    lines = [
        texts["alone"]
        if worst is None
        else write(texts["within"], **worst, by=governs(clipped(worst["phase"], NAME), worst["rule"]))
    ]
    if rows := quality["tiers"]:
        lower = sum(row["reason"] == "lower" for row in rows)
        lines.append(write(texts["apart"], n=len(rows), lower=lower, reasoned=len(rows) - lower))
    lines.append(write(texts["failed"], n=failed) if failed else "")
    lines.append(write(texts["steep"], n=quality["steep"]["n"], of=quality["steep"]["of"]))
    return " ".join(filter(None, lines))
