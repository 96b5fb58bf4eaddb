"""Which cause brings a figure to the printed one: every uncertain factor at both its ends, every alternative setting,
and pairs of them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from stillhook.analysis.uncertainty.draws import Drawing, Uncertainty
from stillhook.analysis.uncertainty.factors import EXCLUSIVE, FACTORS, Distribution, Law
from stillhook.engine.simulate import run_cases
from stillhook.errors import SpecError
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.units import KINDS, in_display, number

Pair = tuple[Crane, Scenario]
Runs = Mapping[str, Pair]
Numbers = Mapping[str, Any]
Evaluate = Callable[[Sequence[Pair]], Sequence[Numbers]]

SHARE = 0.95
"""Share of a factor's distribution between its two ends."""
LISTED = 8
"""Causes that are named in a sentence; a ranking has them all."""
NAMED = 3
"""Pairs that are named in a sentence."""
MATTERS = 0.1
"""Part of a gap, or of the distance to a limit, from which a change of a figure is an effect."""


@dataclass(frozen=True)
class Figure:
    """A number that follows from runs, and what is printed of it.

    value: from the numbers of every run, by its name; least, most: what is printed, as bounds in the unit of value;
    unit, digits: how it is shown; printed: in words.
    """

    name: str
    value: Callable[[Mapping[str, Numbers]], float]
    least: float = -math.inf
    most: float = math.inf
    unit: str = ""
    digits: int = 1
    printed: str = ""

    def gap(self, value: float) -> float:
        """Distance of a value from the printed range; 0 inside, infinite where there is no value."""
        return math.inf if math.isnan(value) else max(self.least - value, value - self.most, 0.0)

    def show(self, value: float) -> str:
        return f"{value:.{self.digits}f}"


@dataclass(frozen=True)
class Alternative:
    """Another setting that the print allows: change makes the runs with it. Alternatives of one group exclude each
    other."""

    label: str
    change: Callable[[Runs], Runs]
    group: str = ""


class Verdict(StrEnum):
    """What the ends of a cause do to a figure: the first three where it is not as printed, the last two where it is."""

    CLOSES = "closes the gap"
    NARROWS = "narrows the gap"
    WIDENS = "widens the gap"
    NONE = "no effect"
    BREAKS = "breaks it"
    KEEPS = "keeps it"


class Change(NamedTuple):
    """One end of a factor, or an alternative: cause, the end in words, and its value (NaN for an alternative)."""

    cause: str
    end: str
    value: float

    def __str__(self) -> str:
        return f"{self.cause} {self.end}".strip()


class Effect(NamedTuple):
    """The figures under one or several changes, in the order of `Attribution.figures`."""

    changes: tuple[Change, ...]
    values: tuple[float, ...]

    def __str__(self) -> str:
        return " and ".join(str(c) for c in self.changes)


class Row(NamedTuple):
    """A cause in the ranking: its effects (both ends of a factor, or the alternative), a verdict for each figure, and
    how much it moves the figures: the largest change over the gap that is to be closed, or over the distance to the
    limit where there is none.
    """

    cause: str
    effects: tuple[Effect, ...]
    verdicts: tuple[Verdict, ...]
    moves: float


@dataclass(frozen=True)
class Attribution:
    """base: figures of the runs as described; singles: every change alone; pairs: every two changes of different
    causes."""

    figures: tuple[Figure, ...]
    base: tuple[float, ...]
    singles: tuple[Effect, ...]
    pairs: tuple[Effect, ...] = ()

    def ranking(self) -> list[Row]:
        """Every cause, the one that moves the figures most first."""
        causes: dict[str, list[Effect]] = {}
        for effect in self.singles:
            causes.setdefault(effect.changes[0].cause, []).append(effect)
        rows = [
            Row(name, tuple(e), tuple(self._verdict(k, e) for k in range(len(self.figures))), max(map(self._moves, e)))
            for name, e in causes.items()
        ]
        return sorted(rows, key=lambda row: -row.moves)

    def verdict(self, cause: str, figure: str) -> Verdict:
        """What one cause does to one figure."""
        k = [f.name for f in self.figures].index(figure)
        return next(row.verdicts[k] for row in self.ranking() if row.cause == cause)

    def missed(self, effect: Effect) -> float:
        """Parts of the gaps that are left, added up; a figure that was as printed and is no more counts by its distance
        to the limit."""
        gaps = [f.gap(x) for f, x in zip(self.figures, effect.values, strict=True)]
        return sum(gap / self._scale(k) for k, gap in enumerate(gaps))

    def closing(self, figure: str | None = None, effects: Sequence[Effect] | None = None) -> list[Effect]:
        """The changes that bring a figure (None: all of them at once) to what is printed; default: single ones and
        pairs.

        A pair is left out where one of its changes does it alone.
        """
        ks = [k for k, f in enumerate(self.figures) if figure in (None, f.name)]
        done: list[Effect] = []
        for effect in (*self.singles, *self.pairs) if effects is None else effects:
            reached = all(self.figures[k].gap(effect.values[k]) == 0.0 for k in ks)
            if reached and not any(set(e.changes) < set(effect.changes) for e in done):
                done.append(effect)
        return done

    def breaking(self, figure: str) -> list[Effect]:
        """The pairs that take a figure away from what is printed where neither of their changes does it alone."""
        k = [f.name for f in self.figures].index(figure)
        f = self.figures[k]
        alone = {e.changes[0] for e in self.singles if f.gap(e.values[k]) > 0.0}
        return [e for e in self.pairs if f.gap(e.values[k]) > 0.0 and not alone & set(e.changes)]

    def nearest(self, n: int) -> list[Effect]:
        """The n single changes or pairs that leave least of all gaps; a pair has to leave less than each of its changes
        does."""
        alone = {e.changes[0]: self.missed(e) for e in self.singles}
        better = [e for e in self.pairs if self.missed(e) < (1.0 - MATTERS) * min(alone[c] for c in e.changes)]
        return sorted((*self.singles, *better), key=self.missed)[:n]

    def _scale(self, k: int) -> float:
        """What a change of a figure is measured by: its gap, or the distance to the nearer limit where there is
        none."""
        f, x = self.figures[k], self.base[k]
        room = min(x - f.least, f.most - x)
        scale = f.gap(x) or (room if math.isfinite(room) else abs(x))
        return scale if math.isfinite(scale) and scale > 0.0 else 1.0

    def _moves(self, effect: Effect) -> float:
        return max(
            math.inf if math.isnan(x) else abs(x - x_0) / self._scale(k)
            for k, (x, x_0) in enumerate(zip(effect.values, self.base, strict=True))
        )

    def _verdict(self, k: int, effects: Sequence[Effect]) -> Verdict:
        f, before = self.figures[k], self.figures[k].gap(self.base[k])
        after = [f.gap(e.values[k]) for e in effects]
        if before == 0.0:
            return Verdict.BREAKS if max(after) > 0.0 else Verdict.KEEPS
        if min(after) == 0.0:
            return Verdict.CLOSES
        if min(after) < (1.0 - MATTERS) * before:
            return Verdict.NARROWS
        return Verdict.WIDENS if max(after) > (1.0 + MATTERS) * before else Verdict.NONE

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain data, figures in the units that they are shown in."""
        names = [f.name for f in self.figures]

        def values(e: Effect) -> dict[str, Any]:
            return {"changes": [str(c) for c in e.changes], "figures": dict(zip(names, e.values, strict=True))}

        return {
            "as_described": dict(zip(names, self.base, strict=True)),
            "ranking": [
                {
                    "cause": row.cause,
                    "ends": [values(e) for e in row.effects],
                    "verdicts": dict(zip(names, map(str, row.verdicts), strict=True)),
                }
                for row in self.ranking()
            ],
            "closing": {
                f.name: [str(e) for e in self.closing(f.name)]
                for f, x in zip(self.figures, self.base, strict=True)
                if f.gap(x) > 0.0
            },
            "statements": self.words(),
        }

    def words(self) -> list[str]:
        """The ranking of each figure in a sentence, and of all of them together."""
        out = []
        rows = self.ranking()
        for k, f in enumerate(self.figures):
            doing = {v: [row.cause for row in rows if row.verdicts[k] is v] for v in Verdict}
            now = f"{f.name}: {f.show(self.base[k])} {f.unit}".rstrip()
            now += f" (printed: {f.printed})" if f.printed else ""
            if f.gap(self.base[k]) == 0.0:
                broken, pairs = doing[Verdict.BREAKS], self.breaking(f.name)
                text = f"Broken by {listed(broken)}." if broken else "Nothing breaks it alone."
                if self.pairs:
                    text += f" Only together: {_pairs(pairs)}." if pairs else " No other pair does."
                out.append(f"{now}, as printed. {text}")
                continue
            parts = [
                f"{v.value.split(' ')[0]} it: {listed(doing[v])}" for v in (Verdict.CLOSES, Verdict.NARROWS) if doing[v]
            ]
            if not doing[Verdict.CLOSES]:
                parts.insert(0, "nothing closes the gap alone")
                closing = [e for e in self.closing(f.name) if len(e.changes) == 2]
                if self.pairs:
                    parts.append(
                        f"pairs that close it: {_pairs(sorted(closing, key=self.missed))}"
                        if closing
                        else "no pair closes it"
                    )
            out.append(f"{now}. {'. '.join(p[0].upper() + p[1:] for p in parts)}.")
        if len(self.figures) > 1 and any(f.gap(x) > 0.0 for f, x in zip(self.figures, self.base, strict=True)):
            closing = sorted(self.closing(), key=lambda e: len(e.changes))
            some = "; ".join(str(e) for e in closing[:5])
            none = f"no single change{' and no pair of changes' if self.pairs else ''}"
            out.append(f"All figures at once: {some if closing else none}.")
        return out


def _pairs(effects: Sequence[Effect]) -> str:
    """How many pairs, and the first of them."""
    return listed([str(e) for e in effects], NAMED)


def listed(names: Sequence[str], most: int = LISTED) -> str:
    """Names in a sentence, which may hold commas themselves: "a; b; c and 4 more"."""
    return "; ".join(names) if len(names) <= most else f"{'; '.join(names[:most])} and {len(names) - most} more"


def attribute(
    runs: Runs,
    figures: Sequence[Figure],
    alternatives: Sequence[Alternative] = (),
    uncertainty: Uncertainty | None = None,
    *,
    pairs: bool = True,
    evaluate: Evaluate | None = None,
) -> Attribution:
    """What every factor and every alternative, and every two of these together, do to the figures.

    Factors are changed one at a time, to both ends.

    Parameters
    ----------
    runs : mapping
        Crane and scenario by name; one change holds for all of them.
    figures : sequence of Figure
        Numbers of these runs with what is printed of each.
    alternatives : sequence of Alternative, default ()
        Other settings that the print allows.
    uncertainty : Uncertainty, optional
        Default every factor of the table that changes something in one of the runs, also those that are not drawn by
        default unless they count a thing twice.
    pairs : bool, default True
        False leaves the pairs out; two alternatives that do not make a crane together are left out.
    evaluate : callable, optional
        Numbers of each run; default its summary.

    Returns
    -------
    Attribution
        The figures under every change.

    Raises
    ------
    SpecError, ScenarioError
        One line.

    Notes
    -----
    A factor's ends hold 95 % of its distribution; where its distribution does not hold at the working point of a run,
    they are wider (`Factor.outside`).
    """
    if not runs or not figures:
        raise SpecError("attribute: runs or figures: none. Give at least one of each.")
    uncertain = uncertainty.on(*runs.values()) if uncertainty is not None else _everything(runs)
    ends = list(_ends(uncertain, runs))
    options: list[tuple[str, Change, Alternative | None]] = [(c.cause, c, None) for c in ends]
    options += [(a.group or a.label, Change(a.label, "", math.nan), a) for a in alternatives]
    _check_ends(ends, runs)
    wanted = [(), *((o,) for o in options)]
    if pairs:
        wanted += [
            (a, b) for a, b in itertools.combinations(options, 2) if a[0] != b[0] and (a[0], b[0]) not in EXCLUSIVE
        ]
    changed_runs: dict[tuple[str, ...], Runs] = {}
    made, possible = [], []
    for some in wanted:
        try:
            made.append(_changed(runs, [o[1:] for o in some], changed_runs))
        except SpecError:
            if len(some) < 2:
                raise
            continue
        possible.append(some)
    results = (evaluate or _summaries)([pair for one in made for pair in one.values()])
    rows = [
        tuple(f.value(dict(zip(one, results[i * len(runs) : (i + 1) * len(runs)], strict=True))) for f in figures)
        for i, one in enumerate(made)
    ]
    effects = [Effect(tuple(o[1] for o in some), values) for some, values in zip(possible, rows, strict=True)]
    n = len(options)
    return Attribution(tuple(figures), rows[0], tuple(effects[1 : n + 1]), tuple(effects[n + 1 :]))


def _summaries(pairs: Sequence[Pair]) -> Sequence[Numbers]:
    return run_cases([crane for crane, _ in pairs], [case for _, case in pairs])


def _everything(runs: Runs) -> Uncertainty:
    """Every factor of the table that changes something in one of the runs: those drawn by default, and the parts of
    these."""
    factors = dict(Uncertainty.default().on(*runs.values()).factors)
    parts = {
        n: f.default
        for n, f in FACTORS.items()
        if not f.by_default and not all(f.absent(*pair) for pair in runs.values())
    }
    return Uncertainty({n: (factors | parts)[n] for n in FACTORS if n in factors or n in parts})


def _ends(uncertain: Uncertainty, runs: Runs) -> Iterator[Change]:
    u = np.array([0.5 * (1.0 - SHARE), 0.5 * (1.0 + SHARE)])
    for name, law in uncertain.factors.items():
        if not isinstance(law, Distribution):
            raise SpecError(
                f'factor {name}: set "{law.name}" has no two ends. Give a distribution, such as {{ normal = [1.0,'
                " 0.1] }."
            )
        if law.law is Law.FIXED:
            continue
        f = FACTORS[name]
        low, high = law.at(u, f.least, f.most).tolist()
        outside = f.outside if law == f.default and any(f.outside_fit(*pair) for pair in runs.values()) else None
        if outside is not None:
            low, high = min(low, outside[0]), max(high, outside[1])
        for x in (low, high):
            yield Change(name, _shown(x, f.kind), x)


def _check_ends(ends: Sequence[Change], runs: Runs) -> None:
    """Refuse a factor one of whose ends makes no crane or no scenario, by its name; a crane of several runs is looked
    at once."""
    seen: set[int] = set()
    for crane, case in runs.values():
        for name in dict.fromkeys(c.cause for c in ends):
            values = np.array([[c.value] for c in ends if c.cause == name])
            Drawing(crane, case, [name]).check_ends(values, crane=id(crane) not in seen)
        seen.add(id(crane))


def _shown(x: float, kind: str) -> str:
    """A factor's value in words: a multiple, or a quantity."""
    return f"{number(in_display(x, kind), 3)} {KINDS[kind].display}" if kind else f"× {number(x, 3)}"


def _changed(
    runs: Runs, changes: Sequence[tuple[Change, Alternative | None]], changed_runs: dict[tuple[str, ...], Runs]
) -> Runs:
    """The runs with some changes: alternatives first, then factors on what they made; kept: what alternatives made
    before, by labels."""
    others = [alternative for _, alternative in changes if alternative is not None]
    key = tuple(a.label for a in others)
    if key not in changed_runs:
        before = [(c, a) for c, a in changes if a is not None and a is not others[-1]]
        changed_runs[key] = others[-1].change(_changed(runs, before, changed_runs)) if others else runs
    unknown = [c for c, alternative in changes if alternative is None]
    if not unknown:
        return changed_runs[key]
    values, names = np.array([[c.value for c in unknown]]), [c.cause for c in unknown]
    return {name: next(Drawing(*pair, names).pairs(values)) for name, pair in changed_runs[key].items()}
