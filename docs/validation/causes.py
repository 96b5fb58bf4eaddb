"""The block of causes of a page: what every uncertain factor and every open setting does to the page's figures, alone
and in pairs; and the variants that it tries."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray
from blocks import AS_IT_STANDS, Template, sayings, table

from stillhook import Crane, Scenario, Sine, simulate
from stillhook.analysis.uncertainty.attribution import (
    MATTERS,
    Alternative,
    Attribution,
    Effect,
    Evaluate,
    Figure,
    Numbers,
    Pair,
    Runs,
    Verdict,
)
from stillhook.analysis.uncertainty.attribution import attribute as ranked
from stillhook.analysis.uncertainty.factors import FACTORS
from stillhook.engine.pack.winch import gains
from stillhook.library import changed
from stillhook.sea.motion.motion import Motion

SHORT = {
    Verdict.CLOSES: "**closes**",
    Verdict.NARROWS: "narrows",
    Verdict.WIDENS: "widens",
    Verdict.NONE: "–",
    Verdict.BREAKS: "**breaks**",
    Verdict.KEEPS: "keeps",
}
QUIET = (Verdict.NONE, Verdict.KEEPS)
AT_ONCE = 32
"""Runs with series that are held in memory."""
SHOWN = 8
"""Pairs that are shown."""
RULE = (
    "What each [factor](uncertainty.md#what-is-drawn) and each setting that is not printed does to these"
    " figures{pairs}: the figure at the lower and the upper end, largest effect first ([how to read"
    " it](../how-to/how-sure-is-it.md#5-what-could-be-the-cause)). `friction` is that of gears, bearings, sheaves and"
    " wire; that of the motors is `motor_loss`."
)


LEFT: list[bool] = []
"""Whether rankings are left as they stand: they take most of a page's time."""


def block(found: Attribution | None, rule: str = RULE) -> str:
    """The ranking as a table, the nearest pairs, and what both say in sentences."""
    if found is None:
        return AS_IT_STANDS
    parts = [rule.format(pairs=", alone and two together" if found.pairs else ", one at a time"), ranking(found)]
    if (
        len(found.figures) > 1
        and found.pairs
        and any(f.gap(x) > 0.0 for f, x in zip(found.figures, found.base, strict=True))
    ):
        parts.append("Nearest to print, one change or two:")
        parts.append(nearest(found))
    parts.append("\n".join(f"- {line}" for line in found.words()))
    return "\n\n".join(parts)


def ranking(found: Attribution) -> str:
    head = ("cause", "from, to", *map(_head, found.figures))
    first = ("**as described**", "", *(f"**{f.show(x)}**" for f, x in zip(found.figures, found.base, strict=True)))
    rows, quiet = [first], []
    for row in found.ranking():
        if row.moves < MATTERS and all(v in QUIET for v in row.verdicts):
            quiet.append(row.cause)
            continue
        ends = " … ".join(e.changes[0].end for e in row.effects if e.changes[0].end)
        cells = []
        for k, (f, v) in enumerate(zip(found.figures, row.verdicts, strict=True)):
            values = " … ".join(f.show(e.values[k]) for e in row.effects)
            cells.append(f"{values}, {SHORT[v]}")
        rows.append((_cause(row.cause), ends, *cells))
    out = table(head, rows)
    return f"{out}\n\nNo effect on any of these figures: {'; '.join(map(_cause, quiet))}." if quiet else out


def _cause(name: str) -> str:
    return f"`{name}`" if name in FACTORS else name


def _head(f: Figure) -> str:
    unit = f", {f.unit}" if f.unit else ""
    return f"{f.name}{unit}" + (f" ({f.printed})" if f.printed else "")


def nearest(found: Attribution) -> str:
    def cell(k: int, e: Effect) -> str:
        f = found.figures[k]
        return f.show(e.values[k]) + (" ✓" if f.gap(e.values[k]) == 0.0 else "")

    rows = [(str(e), *(cell(k, e) for k in range(len(found.figures)))) for e in found.nearest(SHOWN)]
    return table(("changes", *map(_head, found.figures)), rows)


def heavier(crane: Crane, part: float) -> dict[str, Any]:
    """Inertia times `part`, all of it in the drum."""
    more = (part - 1.0) * crane.inertia.J_m_eff
    J_drum = crane.inertia.J_drum + more * crane.i_hD**2
    return {"inertia": {"J_m_eff": f"{crane.inertia.J_m_eff + more!r} kg m^2", "J_drum": f"{J_drum!r} kg m^2"}}


def notes(runs: Mapping[str, Any]) -> str:
    """What was foreseen of the runs, by name, as a list; a note of several runs once."""
    by_note: dict[str, list[str]] = {}
    for name, run in runs.items():
        for note in filter(None, str(run["notes"].values).split("; ")):
            by_note.setdefault(note, []).append(name)
    return "\n".join(f"- {', '.join(names)}: {note}." for note, names in by_note.items()) or "Nothing."


def from_series(read: Callable[[xarray.Dataset], Numbers], every: str) -> Evaluate:
    """Numbers that are read off the series of every run, stored with this spacing."""

    def evaluate(pairs: Sequence[Pair]) -> list[Numbers]:
        out: list[Numbers] = []
        for k in range(0, len(pairs), AT_ONCE):
            some = pairs[k : k + AT_ONCE]
            run = simulate([c for c, _ in some], [s for _, s in some], series=True, every=every)
            out += [read(run.isel(case=i).sel(time=slice(None, case.duration))) for i, (_, case) in enumerate(some)]
        return out

    return evaluate


def varied(
    label: str,
    tables: Mapping[str, Any] | None = None,
    *,
    only: Sequence[str] = (),
    tip: Motion | None = None,
    more: Mapping[str, Any] | None = None,
    group: str = "",
) -> Alternative:
    """Another crane file, another tip, and fields of the scenario as texts, for the runs named in only, all unless
    named."""
    read = Scenario(**{"load": "200 t", "s_w": "0 m", "duration": "60 s", **more}) if more else None
    fields = {name: getattr(read, name) for name in more or ()} | ({} if tip is None else {"tip": tip})

    def change(runs: Runs) -> dict[str, Pair]:
        made: dict[int, Crane] = {}
        out = dict(runs)
        for name in only or runs:
            crane, case = runs[name]
            if id(crane) not in made:
                made[id(crane)] = changed(crane, tables) if tables else crane
            out[name] = made[id(crane)], case.model_copy(update=fields)
        return out

    return Alternative(label, change, group)


WIRE = {"zeta": 0.95, "zeta_low": 0.95, "zeta_high": 0.95}
STANDARD = (varied("wire damping ratio 0.95, as paper C assumes", {"wire": WIRE}),)
"""Settings of the papers that lie outside what the library draws, tried on every page."""


def attribute(
    runs: Runs,
    figures: Sequence[Figure],
    alternatives: Sequence[Alternative] = (),
    *,
    pairs: bool = True,
    evaluate: Evaluate | None = None,
) -> Attribution | None:
    """`stillhook.analysis.attribute` with the alternatives that every page tries; None where rankings are left."""
    if LEFT:
        return None
    return ranked(runs, figures, (*alternatives, *STANDARD), pairs=pairs, evaluate=evaluate)


class Variant(NamedTuple):
    """What a page tries: changes of the crane, for some runs only where `only` names them; another tip; fields of the
    scenario; those of one group exclude each other; own: what the page alone reads."""

    label: str
    changes: Mapping[str, Any] = {}
    tip: Motion | None = None
    more: Mapping[str, Any] = {}
    only: Sequence[str] = ()
    group: str = ""
    own: Mapping[str, Any] = {}

    def on(self, crane: Crane, run: str = "") -> Crane:
        """The crane of a run."""
        return changed(crane, self.changes) if self.changes and (not self.only or run in self.only) else crane

    def alternative(self) -> Alternative:
        return varied(self.label, self.changes, only=self.only, tip=self.tip, more=self.more, group=self.group)


def below(a: Numbers, b: Numbers, name: str) -> float:
    """By how many per cent a number of one run is below that of another."""
    return 100.0 * (1.0 - float(a[name]) / float(b[name])) if float(b[name]) > 0.0 else math.nan


NAMES = {"below": below, "gains": gains, "heavier": heavier, "math": math, "np": np, "Sine": Sine}
"""What expressions of variants and figures may use beside the names of their page."""


def variants(names: Mapping[str, Any], key: str = "variant") -> tuple[Variant, ...]:
    """Those of a page, in its claims: the label of a common one (claims/causes.toml), or a table; names: the page's, in
    which texts are templates, and tip, changes and more may be expressions."""
    common = {row["label"]: row for row in sayings("causes")["common"]}
    rows = [common[row] if isinstance(row, str) else row for row in sayings(names["__name__"])[key]]
    return tuple(
        _variant({k: x for k, x in {**common.get(row.get("like"), {}), **row}.items() if k != "like"}, names)
        for row in rows
    )


def _variant(row: Mapping[str, Any], names: Mapping[str, Any]) -> Variant:
    names = {**NAMES, **names}
    made = {k: eval(x, names) if k in ("tip", "changes", "more") and isinstance(x, str) else x for k, x in row.items()}
    filled = _filled(made, Template(names).format)
    own = {k: x for k, x in filled.items() if k not in Variant._fields}
    return Variant(**{k: x for k, x in filled.items() if k not in own}, own=own)


def _filled(x: Any, fill: Callable[[str], str]) -> Any:
    """Texts with their templates filled, however deep."""
    if isinstance(x, dict):
        return {k: _filled(y, fill) for k, y in x.items()}
    return fill(x) if isinstance(x, str) else x


def figures(names: Mapping[str, Any], key: str = "figure") -> list[Figure]:
    """Those of a page, in its claims: value, least and most are expressions of the page's names and of the runs `r`;
    with `each` one for every x of that expression, in whose texts x is a name too."""
    out = []
    for row in sayings(names["__name__"])[key]:
        for x in eval(row["each"], dict(names)) if "each" in row else (None,):
            here = {**NAMES, **names, "x": x}
            texts = {k: Template(here).format(row.get(k, "")) for k in ("label", "unit", "printed")}
            ends = {k: float(eval(str(row[k]), here)) for k in ("least", "most") if k in row}
            value = compile(row["value"], row["label"], "eval")
            digits = {"digits": row["digits"]} if "digits" in row else {}
            out.append(
                Figure(texts.pop("label"), lambda r, v=value, n=here: eval(v, {**n, "r": r}), **ends, **texts, **digits)
            )
    return out
