"""Rules from a file: the sets that come with Stillhook, and a user's own on top of one of them."""

from __future__ import annotations

import functools
import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from stillhook.base.nearest import nearest
from stillhook.errors import PlanError
from stillhook.formats.toml_fields import Fields, described
from stillhook.library.toml.kinds import FileKind
from stillhook.library.toml.tree import parsed
from stillhook.plan.definition.capacities import CAPACITIES
from stillhook.plan.definition.phases import Phase, PhaseKind
from stillhook.plan.definition.rules import Level, Rule, RuleSet, Sense
from stillhook.units import KINDS, quote
from stillhook.variables import BY_NAME

QUANTITIES = (
    "F_top_static",
    "F_top_max",
    "DAF",
    "sling_ratio",
    "slack_chance",
    "snap_load",
    "v_tip_max",
    "s_tip_pp",
    "v_w_demand",
    "saturation_share",
    "relief_share",
    "power_share",
    "stroke_share",
    "p_a_max",
    "e_c_pp",
    "load_pp",
    "v_landed",
    "v_lift_off",
)
"""What a rule may be about: what the tiers tell of a phase."""
SETTINGS: Mapping[str, tuple[str, str]] = {
    "zeta_a": ("", "amplitude of the characteristic wave over Hs"),
    "T_z_factor": ("", "least T_z of the method over sqrt(Hs/g)"),
    "T_z_most": ("time", "largest T_z of the method"),
    "C_D_least": ("", "least drag coefficient of the method"),
    "duration_least": ("time", "shortest duration for largest motions of the tip"),
}
"""Numbers of the simplified method (closed form): kind and meaning."""
MEANS = ("F_top_static", "slack_chance", "saturation_share", "relief_share", "power_share", "stroke_share")
"""Quantities without a largest value: their level is the mean."""
TOP = ("base", "name", "version", "source", "drop", "simplified", "rule")
WORDS = ("standard", "edition", "clause", "note")
ROW = ("key", "title", "quantity", "at_most", "at_least", "level", "phases", *WORDS)
OFF = "off"
"""What a phase writes in place of a limit that does not hold in it."""
_SENSES = {"at_most": Sense.AT_MOST, "at_least": Sense.AT_LEAST}
_FACTOR = re.compile(r"\s*([0-9]+(?:\.[0-9]*)?)\s*[x*]\s*(\w+)\s*")


@functools.cache
def rule_sets() -> tuple[str, ...]:
    """Names of the sets that come with Stillhook."""
    entries = (files("stillhook.plan.definition") / "rule_sets").iterdir()
    return tuple(sorted(e.name.removesuffix(".toml") for e in entries if e.name.endswith(".toml")))


def load_rules(name_or_path: str | Path) -> RuleSet:
    """Rules of the library by name ("offshore-lift"), or from a TOML file::

        base = "offshore-lift"        # or without: then every rule must be given
        version = "2026-11"
        drop = ["control-error"]
        [[rule]]                      # changes the rule of this key: what is not given stays
        key = "landing-speed"
        at_most = "0.3 m/s"           # a quantity, a number or "5 %", or a capacity of the crane such as "1.2 x
        SWL_tip" standard = "Installation manual of the template"
        [[rule]]                      # a key that the base does not have adds a rule
        key = "slack-chance"
        title = "Chance of slack slings"
        quantity = "slack_chance"
        at_most = "1 %"
        phases = ["splash-zone"]
        standard = "Company rule"
        [[rule]]
        key = "landing-error"
        title = "Error of the wire at touch-down"
        quantity = "e_c_pp"
        at_most = "0.3 m"
        level = "mpm"                 # or "p90", as the other rules of this quantity; none for shares and chances
        phases = ["landing"]
        standard = "Company rule"
        [simplified]                  # numbers of the closed form, see SETTINGS
        zeta_a = 0.9

    Errors: PlanError (SpecError where it is no TOML, UnitError for a limit) of one line that names file, rule, what
    came, what is allowed.
    """
    name = str(name_or_path)
    if name in rule_sets():
        text = (files("stillhook.plan.definition") / "rule_sets" / f"{name}.toml").read_text(encoding="utf-8")
        return _rule_set(parsed(text, f"{name}.toml"), f"{name}.toml", name)
    if not name.endswith(".toml"):
        have = ", ".join(rule_sets())
        raise PlanError(
            f"rules = {quote(name)}: Stillhook has {have}{nearest(name, rule_sets())} A file's name ends in .toml."
        )
    return described(Path(name_or_path), FileKind.RULES, lambda table, path: _rule_set(table, path.name, path.stem))


def rules_of(rules: RuleSet, phase: Phase) -> tuple[Rule, ...]:
    """Rules that hold in a phase, with the limits that the phase gives in their place.

    Errors: PlanError, UnitError of one line for a rule that there is not in this kind of phase, or a limit that cannot
    be read.
    """
    applicable = dict(rules.of(phase.kind))
    for key, text in phase.limits.items():
        where = f'phase "{phase.name}": limits: '
        if key not in applicable:
            known = {rule.key for rule in rules.rules}
            reason = (
                f"the rule does not belong to {phase.kind}"
                if key in known
                else f"rule set {rules.label} has no such rule"
            )
            raise PlanError(
                f"{where}{quote(key)[1:-1]}: {reason}{nearest(key, applicable)} Allowed: {', '.join(applicable)}."
            )
        if text.strip().lower() == OFF:
            del applicable[key]
            continue
        limit, factor, written = _limit(Fields({key: _bare(text)}, where, PlanError), key, applicable[key].quantity)
        note = f"{applicable[key].note} Limit of phase {phase.name} in place of {applicable[key].requirement}.".strip()
        applicable[key] = replace(applicable[key], limit=limit, factor=factor, written=written, note=note)
    return tuple(applicable.values())


def limit_text(limits: Fields, key: str, rules: RuleSet) -> str:
    """A limit of a phase as it is written, which is a text. Errors: that of the table, for numbers with the unit of the
    rule."""
    value = limits.table[key]
    if isinstance(value, str):
        return value
    rule = next((rule for rule in rules.rules if rule.key == key), None)
    kind = "" if rule is None else BY_NAME[rule.quantity].kind
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise limits.wrong(key, 'give a text, such as "0.3 m/s" or "off".')
    if rule is None or not kind:
        raise limits.wrong(key, f"a bare number; write it as text, {quote(f'{value:g}')}.")
    of_rule = rule.written.partition(" ")[2]
    unit = of_rule if of_rule in KINDS[kind].allowed else KINDS[kind].display
    raise limits.wrong(key, f"a bare number; write it as text with its unit, {quote(f'{value:g} {unit}')}.")


def _bare(text: str) -> str | float:
    """A text that is a number alone as one: the limits of a phase are all texts."""
    try:
        return float(text)
    except ValueError:
        return text


def _rule_set(data: Mapping[str, Any], label: str, stem: str) -> RuleSet:
    top = Fields(data, "", PlanError)
    top.refuse_unknown(TOP)
    top.need("version")
    base = _base(top)
    rows = {r.key: r for r in base.rules} if base else {}
    drop = _drop(top, rows)
    listed = data.get("rule", [])
    if not isinstance(listed, list) or not (listed or base):
        raise PlanError("rule: give one [[rule]] a rule.")
    seen: set[str] = set()
    for i, row in enumerate(listed, 1):
        key = Fields(row, f"rule {i}: ", PlanError).text("key")
        if key in seen or key in drop:
            raise PlanError(
                f"rule {quote(key)}: {'comes twice' if key in seen else 'is dropped as well'}. Write it once."
            )
        seen.add(key)
        rows[key] = _row(Fields(row, f'rule "{key}": ', PlanError), rows.get(key), label)
    kept = tuple(r for r in rows.values() if r.key not in drop)
    if not kept:
        raise PlanError("rule: none is left, so that every sea would pass. Keep one.")
    _one_level(kept)
    source = top.text("source", f"{label}, on {base.label}" if base else label)
    settings = _settings(top, base)
    changes = _changes(base, kept, settings) if base else ()
    return _digested(
        RuleSet(top.text("name", stem), top.text("version"), kept, changes, source=source, settings=settings)
    )


def _base(top: Fields) -> RuleSet | None:
    if "base" not in top:
        return None
    name = top.text("base")
    if name not in rule_sets():
        raise top.wrong("base", f"Stillhook has {', '.join(rule_sets())}{nearest(name, rule_sets())}")
    return load_rules(name)


def _settings(top: Fields, base: RuleSet | None) -> dict[str, float]:
    table = Fields(top.table.get("simplified", {}), "simplified: ", PlanError)
    table.refuse_unknown(tuple(SETTINGS))
    out = dict(base.settings) if base else {}
    for name in table.table:
        out[name] = table.figure(name, SETTINGS[name][0])[0]
        if not out[name] > 0.0:
            raise table.wrong(name, "must be more than zero.")
    for name, (_, meaning) in SETTINGS.items():
        if name not in out:
            raise PlanError(
                f'simplified: {name}: missing ({meaning}). Give it, or start the file with base = "offshore-lift".'
            )
    return {name: out[name] for name in SETTINGS}


def _drop(top: Fields, rows: Mapping[str, Rule]) -> tuple[str, ...]:
    drop = top.table.get("drop", [])
    if not isinstance(drop, list) or not all(isinstance(x, str) for x in drop):
        raise top.wrong("drop", "give a list of keys.")
    for key in drop:
        if key not in rows:
            raise PlanError(f"drop: the base has no rule {quote(key)}{nearest(key, rows)}")
    return tuple(drop)


def _row(row: Fields, old: Rule | None, label: str) -> Rule:
    """A rule as given, on top of the rule of the base with its key."""
    row.refuse_unknown(ROW)
    if old is None:
        row.need("title", "quantity", "phases", "standard")
    quantity = row.text("quantity", old.quantity if old else None)
    if quantity not in QUANTITIES:
        raise row.wrong(
            "quantity", f"no rule can be about it{nearest(quantity, QUANTITIES)} Known: {', '.join(QUANTITIES)}."
        )
    senses = [k for k in _SENSES if k in row]
    if len(senses) > 1 or (not senses and (old is None or quantity != old.quantity)):
        raise PlanError(f"{row.place}give exactly one of {', '.join(_SENSES)}.")
    if senses:
        sense, (limit, factor, written) = _SENSES[senses[0]], _limit(row, senses[0], quantity)
    else:
        assert old is not None
        sense, limit, factor, written = old.sense, old.limit, old.factor, old.written
    new = Rule(
        key=row.text("key"),
        title=row.text("title", old.title if old else None),
        quantity=quantity,
        limit=limit,
        sense=sense,
        level=_level(row, quantity, old),
        phases=_phases(row, old),
        factor=factor,
        written=written,
        **{word: _word(row, word, getattr(old, word) if old else "") for word in WORDS},
    )
    return new if old is None else _sourced(row, new, old, label)


def _level(row: Fields, quantity: str, old: Rule | None) -> Level:
    """Which largest value counts; none where there is none."""
    if quantity in MEANS:
        if row.table.get("level", Level.MEAN) != Level.MEAN:
            raise row.wrong("level", f"{quantity} has no largest value. Leave level out.")
        return Level.MEAN
    if "level" not in row and old is not None and old.quantity == quantity:
        return old.level
    level = row.text("level")
    if level not in (Level.MPM, Level.P90):
        raise row.wrong(
            "level", "not one of mpm, p90: the most probable largest value, or what 90 % of such phases stay below."
        )
    return Level(level)


def _word(row: Fields, key: str, otherwise: str) -> str:
    """A text that may be empty."""
    value = row.table.get(key, otherwise)
    if not isinstance(value, str):
        raise row.wrong(key, "give a text.")
    return " ".join(value.split())


def _phases(row: Fields, old: Rule | None) -> tuple[PhaseKind, ...]:
    if "phases" not in row:
        assert old is not None
        return old.phases
    names = row.table["phases"]
    if not isinstance(names, list) or not names or any(name not in list(PhaseKind) for name in names):
        raise row.wrong("phases", f"give a list of {', '.join(PhaseKind)}.")
    return tuple(PhaseKind(name) for name in dict.fromkeys(names))


def _limit(row: Fields, key: str, quantity: str) -> tuple[float | str, float, str]:
    """A limit: a number in SI, or a capacity by name with its factor; and as written."""
    value, kind = row.table[key], BY_NAME[quantity].kind
    text = " ".join(value.split()) if isinstance(value, str) else ""
    times = _FACTOR.fullmatch(text)
    name, factor = (times[2], float(times[1])) if times else (text, 1.0)
    if name in CAPACITIES:
        if CAPACITIES[name].kind != kind:
            fits = ", ".join(n for n, c in CAPACITIES.items() if c.kind == kind) or "none"
            raise row.wrong(
                key, f"{name} is a {CAPACITIES[name].kind}, and {quantity} is not. Capacities that fit: {fits}."
            )
        if factor <= 0.0:
            raise row.wrong(key, "the factor must be more than 0.")
        return name, factor, text
    if times or text.isidentifier():
        raise row.wrong(key, f"no such capacity{nearest(name, CAPACITIES)} Known: {', '.join(CAPACITIES)}.")
    limit, written = row.figure(key, kind)
    if limit < 0.0:
        raise row.wrong(key, "nothing that a rule is about can be below 0 in a sound lift. Give 0 or more.")
    if quantity == "sling_ratio" and limit >= 1.0:
        raise row.wrong(key, "slings at rest have 1. Give less, such as 0.1.")
    return limit, 1.0, written


def _sourced(row: Fields, new: Rule, old: Rule, label: str) -> Rule:
    """A rule that was changed does not go on bearing the standard of what it was."""
    if "standard" in row:
        return replace(new, edition=_word(row, "edition", ""), clause=_word(row, "clause", ""))
    if _meaning(new) == _meaning(old):
        return new
    was = f"{old.requirement}, {old.level}" + (f", in {old.clause_of}" if old.clause_of else "")
    return replace(new, standard=f"changed in {label}", edition="", clause="", note=f"{new.note} Was {was}.".strip())


def _meaning(rule: Rule) -> tuple[Any, ...]:
    return rule.quantity, rule.limit, rule.factor, rule.sense, rule.level, rule.phases


def _one_level(rules: tuple[Rule, ...]) -> None:
    """A tier tells a quantity once, so that all of its rules ask for the same largest value."""
    for rule in rules:
        first = next(r for r in rules if r.quantity == rule.quantity)
        if rule.level is not first.level:
            other = f'rule "{first.key}" asks {rule.quantity} at "{first.level}"'
            raise PlanError(f'rule "{rule.key}": level = "{rule.level}", and {other}. Give both the same.')


def _changes(base: RuleSet, kept: tuple[Rule, ...], settings: Mapping[str, float]) -> tuple[str, ...]:
    """What a set has otherwise than its base."""
    old, new = {r.key: r for r in base.rules}, {r.key: r for r in kept}
    was = base.settings
    lines = [
        f"simplified method, {n}: {settings[n]:g} in place of {was[n]:g} (SI)"
        for n in settings
        if settings[n] != was[n]
    ]
    lines += [f"{r.key} ({r.title}, {r.requirement}) dropped" for key, r in old.items() if key not in new]
    lines += [f"{r.key} ({r.title}, {r.requirement}) added" for key, r in new.items() if key not in old]
    pairs = [(old[key], r) for key, r in new.items() if key in old]
    lines += [f"{b.key}: {', '.join(_differences(a, b))}" for a, b in pairs if _meaning(a) != _meaning(b)]
    return tuple(lines)


def _differences(old: Rule, new: Rule) -> list[str]:
    """What a rule asks otherwise than the one of the base."""
    pairs = [[r.quantity, r.requirement, str(r.level), ", ".join(r.phases)] for r in (new, old)]
    return [f"{b} in place of {a}" for b, a in zip(*pairs, strict=True) if a != b]


def _digested(rules: RuleSet) -> RuleSet:
    content = {k: v for k, v in rules.to_dict().items() if k != "digest"}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return replace(rules, digest=hashlib.sha256(text.encode()).hexdigest())
