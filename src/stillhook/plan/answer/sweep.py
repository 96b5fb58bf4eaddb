"""From which tolerance, payload and depth on a better controller pays: limits of the landing alone, by runs of the
twin.

The tolerance is the limit of the payload's motion over the seabed; where the plan has a rule on the control error of
the wire in that phase, it is held to the same tolerance. The other rules of the phase are not in these limits.

Runs are made on a ladder of heights. Every rung has its own level, from its own runs and the shape of the scatter of
all rungs (`stillhook.statistics.level_fit`): a power of the height holds within a factor of about 1.5, not over the
whole ladder. Between neighbouring rungs what waves add is taken as a power of the height, and a level is never below
that of a lower rung: the limit is the first crossing from below, as everywhere in a plan.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.base.progress import Parts, Progress
from stillhook.engine.pack.capacity import tip_capacity
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import StillhookError
from stillhook.physics.load_path.drum import wire_usable
from stillhook.plan.definition.capacities import at_rest, static_tension
from stillhook.plan.definition.lift_plan import LiftPlan, check_sinks, check_wire
from stillhook.plan.definition.phases import Phase, PhaseKind
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.limits import limited
from stillhook.plan.result import NEW, labelled
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Execution
from stillhook.plan.tiers.time_domain.curves import ColumnRuns, curve_of
from stillhook.plan.tiers.time_domain.lowering import THROUGH, winch_of
from stillhook.plan.tiers.time_domain.placing import Column, LimitSearch, Search, snapped
from stillhook.plan.tiers.time_domain.search import Work
from stillhook.spec.lift.assembly import Assembly
from stillhook.spec.lift.payload import Payload
from stillhook.units import show

if TYPE_CHECKING:
    import xarray


TOLERANCES = (0.05, 0.07, 0.1, 0.14, 0.2, 0.28, 0.36, 0.5)
"""Tolerances that are looked at in addition to the plan's own [m]."""
PAYLOADS = (0.5, 1.5)
"""Factors on the payload's mass that are tried at the plan's depth."""
DEPTHS = (1.0 / 3.0, 2.0)
"""Factors on the depth that are tried with the plan's payload; less where the drum holds less wire."""
LEAST_CHANGE = 1.05
"""Factor below which a depth that the drum's wire allows is not another one."""
LOWEST, HIGHEST, RATIO = 0.4, 5.0, 1.9
"""Ends of the ladder of heights [m], and the largest ratio of neighbours."""
SEEDS, OF_NO_TWIN = 12, 6
"""Runs of every rung, and of one of no controller: its motion grows with the height nearly in proportion, so that an
error of the level makes no larger one of the limit, as it does where friction keeps the level nearly the same."""
TOLERATED = ("load_pp", "e_c_pp")
"""Quantities that a tolerance limits: the payload's motion, and the control error where a rule asks for it."""


class Variant(NamedTuple):
    """A plan with another payload or depth. varied: "payload", "depth", or "" for the plan as it is."""

    varied: str
    plan: LiftPlan

    @property
    def name(self) -> str:
        """Payload and depth in words."""
        return f"{show(self.plan.payload.mass, 'mass', 3)}, {show(self.plan.depth, 'length', 4)}"


@dataclass(frozen=True, eq=False)
class Ladder:
    """Level x of a measure at rising heights H (n,) [m] of all waves: value and ends of its 95 % interval (3, n), none
    below that of a lower rung, inf where too many runs fail; still: x in still water."""

    H: FloatArray = field(repr=False)
    level: FloatArray = field(repr=False)
    still: float

    def heights_at(self, x: FloatArray) -> FloatArray:
        """Heights at which the level passes x (m,): value and ends of the 95 % interval (3, m) [m]. 0 below the lowest
        rung, inf above the highest, and the last rung where those above it fail."""
        added = np.maximum(x - self.still, 0.0)
        return np.stack([self._first(self.level[i], added) for i in (0, 2, 1)])

    def _first(self, level: FloatArray, added: FloatArray) -> FloatArray:
        sound = np.isfinite(level)
        if not sound.any():
            return np.zeros_like(added)
        ln_x = np.log(np.maximum(level[sound] - self.still, 1e-12))
        end = math.inf if sound.all() else math.log(self.H[sound][-1])
        with np.errstate(divide="ignore"):
            ln_H = np.interp(np.log(added), ln_x, np.log(self.H[sound]), left=-math.inf, right=end)
        return np.asarray(np.exp(ln_H))


def ladder_of(of: ColumnRuns, lowest: float = 0.0) -> Ladder:
    """The ladder of one column from its cells above a height [m]."""
    rungs = [replace(of, about=H, cells=((H, runs),)) for H, runs in of.cells if lowest < H]
    curve = curve_of(rungs)
    level = np.array([curve.level(i, rung.about) for i, rung in enumerate(rungs)]).T
    level = np.where(np.isnan(level), level[0], level)  # waves add nothing that is seen
    level[:, [math.isfinite(rung.sound_up_to) for rung in rungs]] = math.inf
    return Ladder(np.array([rung.about for rung in rungs]), np.maximum.accumulate(level, axis=1), of.still)


def rungs_of(plan: LiftPlan) -> FloatArray:
    """Heights of the ladder [m], up to the highest sea of the plan."""
    top = min(HIGHEST, max(plan.environment.Hs))
    low = min(LOWEST, 0.5 * top)
    count = 1 + math.ceil(math.log(top / low) / math.log(RATIO) - 1e-9)
    return np.unique([snapped(float(h)) for h in np.geomspace(low, top, count)])


def landing_of(plan: LiftPlan) -> Phase | None:
    """The landing in which the winch compensates; None without one."""
    return next((p for p in plan.phases if p.kind is PhaseKind.LANDING and p.compensated), None)


def variants_of(plan: LiftPlan, phase: Phase) -> tuple[list[Variant], list[str]]:
    """The plan's landing as it is, with other payloads and at other depths; and what was left out, with the reason."""
    found, left_out = [_varied(plan, phase, "")], []
    wanted = [_varied(plan, phase, "payload", mass=f * plan.payload.mass) for f in PAYLOADS]
    deepest = _deepest(plan, phase)
    for depth in (f * plan.depth for f in DEPTHS):
        possible = min(depth, deepest)
        if depth > plan.depth and possible < LEAST_CHANGE * plan.depth:
            left_out.append(f"{show(depth, 'length', 4)}: the drum's wire ends at {show(deepest, 'length', 4)}")
            continue
        wanted.append(_varied(plan, phase, "depth", depth=possible))
    for each in wanted:
        reason = _impossible(each.plan)
        if reason:
            left_out.append(f"{each.name}: {reason}")
        else:
            found.append(each)
    return found, left_out


def _varied(
    plan: LiftPlan, phase: Phase, varied: str, *, mass: float | None = None, depth: float | None = None
) -> Variant:
    """A plan of the landing alone, whose heights move with the seabed."""
    payload = plan.payload if mass is None else _of_mass(plan.payload, mass)
    down = 0.0 if depth is None else depth - plan.depth
    ends = {name: z - down for name in ("start", "end") if (z := getattr(phase, name)) is not None}
    moved = phase.model_copy(update=ends)
    return Variant(varied, replace(plan, payload=payload, depth=plan.depth + down, phases=(moved,)))


def _of_mass(payload: Payload, mass: float) -> Payload:
    """The payload with another mass [kg], parts in proportion; its outside, its volume and what water does to it
    stay."""
    shape, factor = payload.shape, mass / payload.mass
    if shape is None:
        return payload.model_copy(update={"mass": mass})
    if isinstance(shape, Assembly):
        parts = [p.model_copy(update={"mass": None if p.mass is None else factor * p.mass}) for p in shape.parts]
        shape = shape.model_copy(update={"parts": tuple(parts)})
    return payload.model_copy(update={"mass": mass, "volume": payload.displaced, "shape": shape})


def _deepest(plan: LiftPlan, phase: Phase) -> float:
    """Greatest depth that the wire on the drum reaches in a landing [m]."""
    left = float(wire_usable(drum_record(plan.crane))) - at_rest(plan, phase, -plan.depth).s_w
    return plan.depth + left - THROUGH


def _impossible(plan: LiftPlan) -> str:
    """Why a landing cannot be run, in words; empty where it can."""
    (phase,) = plan.phases
    if phase.start is not None and phase.start > -plan.payload.reach(plan.rho):
        return "the landing would begin before the payload is covered"
    try:
        check_sinks(plan.payload, plan.rho)
        check_wire(plan)
    except StillhookError as e:
        return str(e)
    F, most = static_tension(plan, phase), tip_capacity(plan.crane)
    if most < F:
        words = (show(F, "force"), show(most, "force"))
        return f"payload, hook and wire pull {words[0]} at the crane tip, beyond the SWL and hook of {words[1]}"
    return ""


def landing_sweep(
    plan: LiftPlan, Tp: float, beta: float, execution: Execution, progress: Progress | None = None
) -> xarray.Dataset | None:
    """Limiting heights of the landing over tolerance, payload and depth, by runs at one period [s] and direction [rad].

    Returns Hs_landing, Hs_landing_low, Hs_landing_high [m] over variant, alternative and landing_tolerance [m]: 0 below
    the lowest height that is run, inf above the highest; load_pp [m] over variant, alternative and height [m]: level of
    the payload's motion (inf: too many runs fail). Coords mass [kg], depth [m] and varied ("payload", "depth", "" as
    planned) of every variant. attrs: phase, Tp, beta, own (the plan's tolerance [m], NaN without one), quantities,
    left_out (a line each), n_seeds (of a controller), n_runs. None where no landing is compensated.
    Errors: as `stillhook.plan.tiers.time_domain.tier.refine`.
    """
    phase = landing_of(plan)
    if phase is None:
        return None
    rules = {each.rule.quantity: each.limit for a in plan.alternatives for each in limited(plan, phase, a)}
    quantities = tuple(q for q in TOLERATED if q == TOLERATED[0] or q in rules)
    own = rules.get(TOLERATED[0], math.nan)
    tolerance = np.unique([*TOLERANCES, *([own] if math.isfinite(own) else [])])
    variants, left_out = variants_of(plan, phase)
    rungs, parts, n_runs = rungs_of(plan), Parts(progress, {v.name: 1.0 for v in variants}), 0
    limits, motion = [], []
    for variant in variants:
        work = Work(variant.plan, Search(), Cells(variant.plan, execution), None)
        run = _run(work, (Tp, beta), rungs, parts(variant.name))
        rows = [_of_alternative(lines, quantities, tolerance) for lines in run]
        limits.append([row[0] for row in rows])
        motion.append([row[1] for row in rows])
        n_runs += work.cells.n_runs
    over = ("variant", "alternative", "landing_tolerance")
    columns = {f"Hs_landing{end}": (over, np.array(limits)[:, :, k]) for k, end in enumerate(("", "_low", "_high"))}
    columns["load_pp"] = (*over[:2], "height"), np.array(motion)
    coords = {
        "variant": [v.name for v in variants],
        "alternative": [a.value for a in plan.alternatives],
        "landing_tolerance": tolerance,
        "height": rungs,
        "mass": ("variant", [v.plan.payload.mass for v in variants]),
        "depth": ("variant", [v.plan.depth for v in variants]),
        "varied": ("variant", [v.varied for v in variants]),
    }
    attrs = {"phase": phase.name, "Tp": Tp, "beta": beta, "own": own, "quantities": ", ".join(quantities)}
    attrs |= {"left_out": "\n".join(left_out), "n_seeds": SEEDS, "n_runs": n_runs}
    return labelled(columns, coords, attrs)


class Lines(NamedTuple):
    """A landing under one alternative that was run in a column."""

    work: Work
    line: LimitSearch


def _run(work: Work, column: Column, rungs: FloatArray, progress: Progress) -> list[Lines]:
    """Runs of the ladder under every alternative, all requested together so that blocks of lanes are full."""
    (phase,), plan = work.plan.phases, work.plan
    lines = [LimitSearch(phase, a, winch_of(phase, a), column, math.nan, 0.0) for a in plan.alternatives]
    asks = [
        CellRequest(phase.name, line.winch, line.spot(h), 1 if plan.environment.calm(h) else _seeds(line.alternative))
        for line in lines
        for h in (0.0, *map(float, rungs))
    ]
    work.cells.request(list({ask.cell: ask for ask in asks}.values()), progress)
    return [Lines(work, line) for line in lines]


def _seeds(alternative: Alternative) -> int:
    return SEEDS if alternative.twin else OF_NO_TWIN


def _of_alternative(lines: Lines, quantities: Sequence[str], tolerance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Limits (3, tolerance) of the wind sea [m], the least over the quantities, and levels (3, height) of the first
    one."""
    work, line = lines
    found, levels = [], []
    for quantity in (q for q in quantities if work.has(line, q)):
        of = work.runs_of(line, quantity, 1.0)
        ladder = ladder_of(of, work.swell)
        found.append(ladder.heights_at(np.array([of.measure.to_x(float(x)) for x in tolerance])))
        levels.append(ladder.level[0])
    H = np.min(found, axis=0)
    return work.wind_sea(H), levels[0]


class Pays(NamedTuple):
    """What the best new controller is worth at one tolerance of one variant: names, limits with their intervals (3,)
    [m]; verdict 1 where it lands in higher seas by more than the intervals, -1 where the best classic one does."""

    tolerance: float
    new: str
    classic: str
    Hs_new: FloatArray
    Hs_classic: FloatArray

    @property
    def verdict(self) -> int:
        """1, -1, or 0 where intervals overlap."""
        return int(self.Hs_new[1] > self.Hs_classic[2]) - int(self.Hs_classic[1] > self.Hs_new[2])


def pays_at(block: xarray.Dataset, variant: int) -> list[Pays]:
    """The best new against the best classic controller at every tolerance of a variant, rising; none where the plan has
    not both."""
    labels = [str(name) for name in block["alternative"].values]
    new = [labels.index(a.value) for a in NEW if a.value in labels]
    classic = [i for i, name in enumerate(labels) if name in list(Alternative) and Alternative(name).classic]
    if not (new and classic):
        return []
    table = np.stack([block[f"Hs_landing{end}"].values[variant] for end in ("", "_low", "_high")])
    rows = []
    for k, tolerance in enumerate(block["landing_tolerance"].values):

        def best(of: Sequence[int], k: int = k) -> int:
            return max(of, key=lambda i: (table[0, i, k], table[1, i, k]))

        n, c = best(new), best(classic)
        rows.append(Pays(float(tolerance), labels[n], labels[c], table[:, n, k], table[:, c, k]))
    return rows


def answer_of(block: xarray.Dataset) -> dict[str, Any]:
    """The sweep in short, for JSON: where it was made, the answer in a sentence for each variant, and the comparison
    at every tolerance (rows of pays: better 1, 0 where intervals overlap, -1)."""
    attrs, rows, lines = block.attrs, [], []
    heights = float(block["height"].values[0]), float(block["height"].values[-1])
    for v, name in enumerate(block["variant"].values):
        of = pays_at(block, v)
        place = "as planned" if not str(block["varied"].values[v]) else f"other {block['varied'].values[v]}"
        lines += [f"{name} ({place}): {in_words(of, heights)}"] if of else []
        rows += [
            {
                "mass": float(block["mass"].values[v]),
                "depth": float(block["depth"].values[v]),
                "tolerance": each.tolerance,
                "new": each.new,
                "classic": each.classic,
                "Hs_new": [float(x) for x in each.Hs_new],
                "Hs_classic": [float(x) for x in each.Hs_classic],
                "better": each.verdict,
            }
            for each in of
        ]
    keys = ("phase", "Tp", "beta", "own", "quantities", "n_seeds", "n_runs")
    left_out = [line for line in str(attrs["left_out"]).split("\n") if line]
    none = ["the plan does not have a new and a classic controller side by side"]
    return {key: attrs[key] for key in keys} | {"answer": lines or none, "left_out": left_out, "pays": rows}


def in_words(of: Sequence[Pays], heights: tuple[float, float]) -> str:
    """From which tolerance down the best new controller lands in higher seas, from comparisons over rising tolerances,
    one at least; heights: ends of the ladder [m]."""
    better = list(_ranges(of, np.array([each.verdict == 1 for each in of])))
    worse = list(_ranges(of, np.array([each.verdict == -1 for each in of])))
    if better:
        first, last = better[-1]
        text = f"a new controller lands in higher seas {' and '.join(_span(*each) for each in reversed(better))}"
        text += f"; {_against(last, heights)}"
        text += f", and {_against(first, heights)}" if first is not last else ""
    else:
        closest = max(of, key=lambda each: min(each.Hs_new[1], heights[1]) - min(each.Hs_classic[2], heights[1]))
        text = "at no tolerance does a new controller land in higher seas by more than the intervals"
        text += f"; {_against(closest, heights)}"
    if worse:
        text += (
            f". The classic controller lands in higher seas {' and '.join(_span(*each) for each in reversed(worse))}"
        )
    return text


def _ranges(of: Sequence[Pays], true: BoolArray) -> Iterator[tuple[Pays, Pays]]:
    """First and last of every row of neighbours for which something is true."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], true.astype(int), [0]))))
    for begin, end in edges.reshape(-1, 2):
        yield of[int(begin)], of[int(end) - 1]


def _span(first: Pays, last: Pays) -> str:
    if first is last:
        return f"at a tolerance of {first.tolerance:.3g} m"
    return f"from a tolerance of {last.tolerance:.3g} m down to {first.tolerance:.3g} m"


def _against(each: Pays, heights: tuple[float, float]) -> str:
    new, classic = (
        f"{Alternative(name).label} {_limit(Hs, heights)}"
        for name, Hs in ((each.new, each.Hs_new), (each.classic, each.Hs_classic))
    )
    return f"at {each.tolerance:.3g} m: {new} against {classic}"


def _limit(Hs: FloatArray, heights: tuple[float, float]) -> str:
    """A limit with its interval, such as "1.21 m (1.1 to 1.3)"."""
    value, low, high = (height_in_ladder(float(x), heights) for x in Hs)
    return f"{value} m ({low} to {high})" if len({value, low, high}) > 1 else f"{value} m"


def height_in_ladder(Hs: float, heights: tuple[float, float]) -> str:
    """A limit [m] as text: "< 0.4" below the ladder, "> 5" above it."""
    lowest, highest = heights
    if Hs < lowest:
        return f"< {lowest:.3g}"
    return f"> {highest:.3g}" if Hs > highest else f"{Hs:.2f}"


def sweep_blocks(
    plan: LiftPlan, Tp: float, beta: float, execution: Execution, progress: Progress | None = None
) -> dict[str, xarray.Dataset]:
    """The block of a result; none where no landing is compensated."""
    block = landing_sweep(plan, Tp, beta, execution, progress)
    return {} if block is None else {"sweep": block}
