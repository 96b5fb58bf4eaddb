"""Rules from a file: the sets that come with Stillhook, and a user's own on top of one of them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import Field

from stillhook.base.choice import nearest
from stillhook.errors import PlanError
from stillhook.library.toml.file import (
    RowTable,
    SetFile,
    TomlTable,
    base_name,
    digest_of_set,
    load_set,
    numbers_on_base,
    rows_on_base,
    set_names,
)
from stillhook.library.toml.kinds import FileKind
from stillhook.plan.definition.capacities import CAPACITIES, LEADS
from stillhook.plan.definition.rules import QUANTITIES, Level, Rule, RuleSet, Sense
from stillhook.sea.steady_flow import Current
from stillhook.spec.lift.joining import UNDER_WATER
from stillhook.spec.lift.phase import OFF, Phase, PhaseKind
from stillhook.tables.table import Text
from stillhook.units import KINDS, quote
from stillhook.variables import BY_NAME

SETS = Path(__file__).with_name("rule_sets")
SETTINGS: Mapping[str, tuple[str, str]] = {
    "zeta_a": ("", "amplitude of the characteristic wave over Hs"),
    "T_z_factor": ("", "least T_z of the method over sqrt(Hs/g)"),
    "T_z_most": ("time", "largest T_z of the method"),
    "C_D_least": ("", "least drag coefficient of the method"),
    "duration_least": ("time", "shortest duration for largest motions of the tip"),
    "hold": ("time", "time for which a payload is held at the worst height of a splash zone"),
    "stop": ("time", "time for which a payload is held at the stand-off before it is landed"),
    "stand_off": ("length", "height of the stand-off above the seabed"),
}
"""Numbers of the simplified method (closed form), and of what is assessed: kind and meaning."""
WORDS = ("standard", "edition", "clause", "note")
_SENSES = {"at_most": Sense.AT_MOST, "at_least": Sense.AT_LEAST}
_FACTOR = re.compile(r"\s*([0-9]+(?:\.[0-9]*)?)\s*[x*]\s*(\w+)\s*")


class RuleTable(RowTable):
    """A table [[rule]]; what it leaves out keeps its value of the base."""

    title: Text | None = Field(default=None, description="what is required, in words")
    quantity: Text | None = Field(default=None, description="what the rule is about")
    at_most: Any = Field(default=None, description="limit: a quantity, a share, or a capacity of the crane")
    at_least: Any = Field(default=None, description="limit, in place of at_most")
    level: Level | None = Field(default=None, description="which largest value counts")
    phases: tuple[PhaseKind, ...] | None = Field(default=None, min_length=1, description="phases that it belongs to")
    standard: str | None = Field(default=None, description="what it is from")
    edition: str | None = Field(default=None, description="edition of the standard")
    clause: str | None = Field(default=None, description="clause of the standard")
    note: str | None = Field(default=None, description="reason of the limit, or what it leaves")


class RulesFile(SetFile):
    """A set of rules."""

    entered_by: Text | None = Field(default=None, description="who entered the editions of the project")
    editions: Mapping[str, Text] = Field(default_factory=dict, description="standard = edition that the project uses")
    simplified: Mapping[str, Any] = Field(default_factory=dict, description="numbers of the closed form")
    rule: tuple[RuleTable, ...] = Field(default=(), description="one [[rule]] table for each rule")


def rule_sets() -> tuple[str, ...]:
    """Names of the sets that come with Stillhook."""
    return set_names(SETS)


def load_rules(name_or_path: str | Path) -> RuleSet:
    """Rules of the library by name ("offshore-lift"), or from a TOML file::

        base = "offshore-lift"        # or without: then every rule must be given
        version = "2026-11"
        entered_by = "N. N."          # the editions below
        drop = ["control-error"]
        [[rule]]                      # changes the rule of this key: what is not given stays
        key = "landing-speed"
        at_most = "0.3 m/s"           # a quantity, a number or "5 %", or "1.2 x SWL_tip" of the crane
        standard = "Installation manual of the template"
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
        [editions]                    # of the standards that the project uses
        "EN 13852-1" = "2013"
        [simplified]                  # numbers of the closed form, see SETTINGS
        zeta_a = 0.9

    Parameters
    ----------
    name_or_path : str or Path
        Name in the library, or path of the file.

    Returns
    -------
    RuleSet
        The rules.

    Raises
    ------
    PlanError
        One line that names file, rule, what came, what is allowed; SpecError where it is not TOML, UnitError for a
        limit.
    """
    return load_set(name_or_path, SETS, "rules", FileKind.RULES, PlanError, _rule_set)


def under_water(rules: RuleSet, current: Current | None) -> RuleSet:
    """Rules about the lead of the wire in phases under water as well, where a plan has a current."""
    keys = [rule.key for rule in rules.rules if rule.quantity in LEADS]
    if current is None or not keys:
        return rules
    wider = tuple(
        replace(rule, phases=tuple(dict.fromkeys((*rule.phases, *UNDER_WATER))), note=IN_CURRENT)
        if rule.quantity in LEADS
        else rule
        for rule in rules.rules
    )
    return replace(rules, rules=wider, changes=(*rules.changes, f"{', '.join(keys)}: under water too, in the current"))


IN_CURRENT = (
    "Only with a load chart that has it. In air a pendulum under the moving tip, under water the wire in the current"
    " and a chain of masses in waves; the crane's heel. Tug lines and slewing are left out, and the wave zone."
)


def rules_of(rules: RuleSet, phase: Phase) -> tuple[Rule, ...]:
    """Rules that hold in a phase, with the limits that the phase gives in their place.

    Errors: PlanError, UnitError of one line for a rule that there is not in this kind of phase, or a limit that cannot
    be read.
    """
    applicable = dict(rules.of(phase.kind))
    limits = {key: _bare(text) for key, text in phase.limits.items()}
    data = {"phase": [{"name": phase.name, "limits": limits}]}
    table = TomlTable(Path(), data, PlanError, ("phase", 0, "limits"))
    for key, text in phase.limits.items():
        if key not in applicable:
            keys = {rule.key for rule in rules.rules}
            reason = (
                f"the rule does not belong to {phase.kind}"
                if key in keys
                else f"rule set {rules.label} has no such rule"
            )
            raise PlanError(f"{table.place(key)}: {reason}{nearest(key, applicable)} Allowed: {', '.join(applicable)}.")
        if text.strip().lower() == OFF:
            del applicable[key]
            continue
        limit, factor, written = _limit(limits[key], table, key, applicable[key].quantity)
        note = f"{applicable[key].note} Limit of phase {phase.name} in place of {applicable[key].requirement}.".strip()
        applicable[key] = replace(applicable[key], limit=limit, factor=factor, written=written, note=note)
    return tuple(applicable.values())


def check_limit_texts(limits: Mapping[str, Any], table: TomlTable, rules: RuleSet) -> None:
    """Refuse limits of a phase that are not texts; for numbers with the unit of the rule. table: that of the limits."""
    for key, value in limits.items():
        if isinstance(value, str):
            continue
        rule = next((rule for rule in rules.rules if rule.key == key), None)
        kind = "" if rule is None else BY_NAME[rule.quantity].kind
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise table.wrong('give a text, such as "0.3 m/s" or "off".', key)
        if rule is None or not kind:
            raise table.wrong(f"a bare number; write it as text, {quote(f'{value:g}')}.", key)
        of_rule = rule.written.partition(" ")[2]
        unit = of_rule if of_rule in KINDS[kind].allowed else KINDS[kind].display
        raise table.wrong(f"a bare number; write it as text with its unit, {quote(f'{value:g} {unit}')}.", key)


def _bare(text: str) -> str | float:
    """A text that is a number alone as one: the limits of a phase are all texts."""
    try:
        return float(text)
    except ValueError:
        return text


def _rule_set(table: TomlTable) -> RuleSet:
    file, label = table.read(RulesFile), table.path.name
    name = base_name(file, table, rule_sets())
    base = None if name is None else load_rules(name)
    combined = rows_on_base(
        file,
        table,
        "rule",
        file.rule,
        base.rules if base else (),
        lambda row, old, place: _row(row, old, place, label),
    )
    if not combined:
        raise PlanError("rule: none is left, so that every sea would pass. Keep one.")
    _one_level(combined)
    combined = _with_editions(combined, file, table)
    source = file.source or (f"{label}, on {base.label}" if base else label)
    settings = numbers_on_base(
        table, "simplified", file.simplified, SETTINGS, base.settings if base else {}, example="offshore-lift"
    )
    changes = _changes(base, combined, settings) if base else ()
    entered_by = file.entered_by or (base.entered_by if base else "")
    rules = RuleSet(
        file.name or table.path.stem,
        file.version,
        combined,
        changes,
        source=source,
        settings=settings,
        entered_by=entered_by,
    )
    return replace(rules, digest=digest_of_set(rules.to_dict()))


def _with_editions(rules: tuple[Rule, ...], file: RulesFile, table: TomlTable) -> tuple[Rule, ...]:
    """Rules with the editions of their standards that the file enters."""
    if file.editions and file.entered_by is None:
        raise table.wrong(
            'editions are given without the person who entered them. Write entered_by = "name, company".', "entered_by"
        )
    standards = list(dict.fromkeys(rule.standard for rule in rules))
    for standard in file.editions:
        if standard not in standards:
            near = nearest(standard, standards)
            raise table.at("editions").wrong(f"no rule is from it{near} Standards: {', '.join(standards)}.", standard)
    return tuple(replace(rule, edition=file.editions.get(rule.standard, rule.edition)) for rule in rules)


def _row(row: RuleTable, old: Rule | None, table: TomlTable, label: str) -> Rule:
    """A rule of the file, on top of the rule of the base with its key."""
    for key in ("title", "quantity", "phases", "standard") if old is None else ():
        if getattr(row, key) is None:
            raise table.missing(key)
    quantity = row.quantity or (old.quantity if old else "")
    if quantity not in QUANTITIES:
        near = nearest(quantity, QUANTITIES)
        raise table.wrong(f"no rule can be about it{near} Known: {', '.join(QUANTITIES)}.", "quantity")
    senses = [key for key in _SENSES if getattr(row, key) is not None]
    if len(senses) == 1:
        sense = _SENSES[senses[0]]
        limit, factor, written = _limit(getattr(row, senses[0]), table, senses[0], quantity)
    elif senses or old is None or quantity != old.quantity:
        raise table.wrong(f"give exactly one of {', '.join(_SENSES)}.")
    else:
        sense, limit, factor, written = old.sense, old.limit, old.factor, old.written
    new = Rule(
        key=row.key,
        title=row.title or (old.title if old else ""),
        quantity=quantity,
        limit=limit,
        sense=sense,
        level=_level(row, old, table, quantity),
        phases=tuple(dict.fromkeys(row.phases or (old.phases if old else ()))),
        factor=factor,
        written=written,
        **{word: _word(getattr(row, word), getattr(old, word) if old else "") for word in WORDS},
    )
    return new if old is None else _sourced(row, new, old, label)


def _level(row: RuleTable, old: Rule | None, table: TomlTable, quantity: str) -> Level:
    """Which largest value counts; none where there is none."""
    if QUANTITIES[quantity].mean:
        if row.level not in (None, Level.MEAN):
            raise table.wrong(f"{quantity} has no largest value. Leave level out.", "level")
        return Level.MEAN
    if row.level is None and old is not None and old.quantity == quantity:
        return old.level
    if row.level is None:
        raise table.missing("level")
    if row.level is Level.MEAN:
        raise table.wrong(
            "not one of mpm, p90: the most probable largest value, or what 90 % of such phases stay below.", "level"
        )
    return row.level


def _word(text: str | None, otherwise: str) -> str:
    """A text that may be empty, on one line."""
    return " ".join((otherwise if text is None else text).split())


def _limit(value: Any, table: TomlTable, key: str, quantity: str) -> tuple[float | str, float, str]:
    """A limit: a number in SI, or a capacity by name with its factor; and as written."""
    kind = BY_NAME[quantity].kind
    text = " ".join(value.split()) if isinstance(value, str) else ""
    times = _FACTOR.fullmatch(text)
    name, factor = (times[2], float(times[1])) if times else (text, 1.0)
    if name in CAPACITIES:
        if CAPACITIES[name].kind != kind:
            fits = ", ".join(n for n, c in CAPACITIES.items() if c.kind == kind) or "none"
            raise table.wrong(
                f"{name} is a {CAPACITIES[name].kind}, and {quantity} is not. Capacities that fit: {fits}.", key
            )
        if factor <= 0.0:
            raise table.wrong("the factor must be more than 0.", key)
        return name, factor, text
    if times or text.isidentifier():
        raise table.wrong(f"no such capacity{nearest(name, CAPACITIES)} Known: {', '.join(CAPACITIES)}.", key)
    limit, written = table.quantity(kind, key)
    if limit < 0.0:
        raise table.wrong("no quantity of a rule is below 0. Give 0 or more.", key)
    if quantity == "sling_ratio" and limit >= 1.0:
        raise table.wrong("slings at rest have 1. Give less, such as 0.1.", key)
    return limit, 1.0, written


def _sourced(row: RuleTable, new: Rule, old: Rule, label: str) -> Rule:
    """A rule that was changed no longer bears the standard of what it was."""
    if row.standard is not None:
        return replace(new, edition=_word(row.edition, ""), clause=_word(row.clause, ""))
    if _meaning(new) == _meaning(old):
        return new
    was = f"{old.requirement}, {old.level}" + (f", in {old.clause_of}" if old.clause_of else "")
    return replace(new, standard=f"changed in {label}", edition="", clause="", note=f"{new.note} Was {was}.".strip())


def _meaning(rule: Rule) -> tuple[Any, ...]:
    return rule.quantity, rule.limit, rule.factor, rule.sense, rule.level, rule.phases


def _one_level(rules: tuple[Rule, ...]) -> None:
    """A tier determines a quantity once, so all rules of that quantity use the same largest value."""
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
