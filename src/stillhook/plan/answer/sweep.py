"""From which tolerance, payload and depth on a better controller pays: limits of the landing and of the stop before it
alone, by runs of the twin.

The tolerance is the limit of the payload's motion over the seabed; where the plan has a rule on the control error of
the wire in those phases, it is held to the same tolerance. The other rules are not in these limits.

Runs are made on a ladder of heights and judged one by one, beyond a tolerance or not, as in the plan's own table
(`stillhook.statistics.crossing_fit`). The plan's own landing is looked at in the periods in which it governs, others
in the middle one of them. There the frequency-domain method counts as it does in the table, where runs allow far more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Parts, Progress
from stillhook.engine.pack.capacity import tip_capacity
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import StillhookError
from stillhook.physics.load_path.drum import wire_usable
from stillhook.plan.definition.capacities import at_rest, static_tension
from stillhook.plan.definition.lift_plan import LiftPlan, check_sinks, check_wire
from stillhook.plan.definition.rules import Alternative, Demand, Limited, Tier
from stillhook.plan.definition.weights import weighing
from stillhook.plan.limits import limited, limits_of
from stillhook.plan.result import NEW, labelled
from stillhook.plan.table import APART, Governed
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Execution, merged
from stillhook.plan.tiers.time_domain.crossings import crosses
from stillhook.plan.tiers.time_domain.curves import ColumnRuns
from stillhook.plan.tiers.time_domain.lowering import THROUGH, SeaState, winch_of
from stillhook.plan.tiers.time_domain.placing import Column, LimitSearch, Search, snapped
from stillhook.plan.tiers.time_domain.search import Work
from stillhook.spec.lift.phase import Phase, PhaseKind
from stillhook.statistics.crossing_fit import share_crossing
from stillhook.units import show

if TYPE_CHECKING:
    import xarray


TOLERATED = ("load_pp", "e_c_pp")
"""Quantities that a tolerance over the seabed limits: motion of the payload, control error of the wire."""
TOLERANCES = (0.05, 0.07, 0.1, 0.14, 0.2, 0.28, 0.36, 0.5)
"""Tolerances that are looked at in addition to the plan's own [m]."""
PAYLOADS = (0.5, 1.5)
"""Factors on the payload's mass that are tried at the plan's depth."""
DEPTHS = (1.0 / 3.0, 2.0)
"""Factors on the depth that are tried with the plan's payload; less where the drum holds less wire."""
LATE = 0.2
"""Delay of the motion signal that is tried in addition to that of the plan [s]."""
LEAST_CHANGE = 1.05
"""Factor below which a depth that the drum's wire allows is not another one."""
LOWEST, HIGHEST, RATIO = 0.4, 5.0, 1.75
"""Ends of the ladder of heights [m], and the largest ratio of neighbours."""
SEEDS, OF_NO_TWIN = 6, 3
"""Runs of every rung, and of one of no controller, whose motion scatters less over its height."""


class Variant(NamedTuple):
    """A landing to look at. varied: "period", "payload", "depth", "delay" of the motion signal, or "" for the plan as
    it is, in its middle period; plan of the phases over the seabed alone; period [s] and direction [rad]."""

    varied: str
    plan: LiftPlan
    column: Column

    @property
    def name(self) -> str:
        """Payload, depth and period in words."""
        mass, depth = show(self.plan.payload.mass, "mass", 3), show(self.plan.depth, "length", 4)
        late = f", signal {show(self.plan.sensors.delay, 'time', 3)} late" if self.varied == "delay" else ""
        return f"{mass}, {depth}, Tp {show(self.column[0], 'time', 3)}{late}"


def rungs_of(plan: LiftPlan) -> FloatArray:
    """Heights of the ladder [m], up to the highest sea of the plan."""
    top = min(HIGHEST, max(plan.environment.Hs))
    low = min(LOWEST, 0.5 * top)
    count = 1 + math.ceil(math.log(top / low) / math.log(RATIO) - 1e-9)
    return np.unique([snapped(float(h)) for h in np.geomspace(low, top, count)])


def over_seabed(plan: LiftPlan) -> tuple[Phase, ...]:
    """The phases over the seabed in which the winch compensates."""
    return tuple(p for p in plan.phases if crosses(p) and p.compensated)


def landing_of(plan: LiftPlan) -> Phase | None:
    """The landing in which the winch compensates; None without one."""
    return next((p for p in over_seabed(plan) if p.kind is PhaseKind.LANDING), None)


def where_it_governs(plan: LiftPlan, table: Governed, otherwise: Column) -> tuple[Column, ...]:
    """Columns in which a tolerance over the seabed limits twins, of each period that in which it limits most of them:
    the middle one first, then the shortest and the longest period. None: the other column given."""
    axes, names = table.axes, [p.name for p in over_seabed(plan)]
    quantity = {rule.key: rule.quantity for rule in plan.rules.rules}
    phases = [i for i, name in enumerate(axes.phases) if name in names]
    rules = [i for i, key in enumerate(axes.rules) if quantity[key] in TOLERATED]
    twins = [i for i, a in enumerate(axes.alternatives) if a.twin]
    limits = np.isin(table.phase, phases) & np.isin(table.rule, rules)
    count = limits[twins].sum(axis=0)
    periods = [i for i in range(len(axes.periods)) if count[:, i].any()]
    if not periods:
        return (otherwise,)
    chosen = dict.fromkeys(periods[i] for i in (len(periods) // 2, 0, -1))
    return tuple((axes.periods[i], axes.headings[int(count[:, i].argmax())]) for i in chosen)


def variants_of(plan: LiftPlan, columns: Sequence[Column]) -> tuple[list[Variant], list[str]]:
    """The plan's landing as it is in each column, and in the first of them with other payloads, at other depths and
    with a motion signal that comes late (in time, where the plan's is late); what was left out, with the reason."""
    first = columns[0]
    result = [_varied(plan, "" if column is first else "period", column) for column in columns]
    left_out = []
    wanted = [_varied(plan, "payload", first, mass=f * plan.payload.mass) for f in PAYLOADS]
    deepest = _deepest(plan, over_seabed(plan)[-1])
    for depth in (f * plan.depth for f in DEPTHS):
        possible = min(depth, deepest)
        if depth > plan.depth and possible < LEAST_CHANGE * plan.depth:
            left_out.append(f"{show(depth, 'length', 4)}: the drum's wire ends at {show(deepest, 'length', 4)}")
            continue
        wanted.append(_varied(plan, "depth", first, depth=possible))
    wanted.append(_varied(plan, "delay", first, delay=0.0 if plan.sensors.delay else LATE))
    for each in wanted:
        reason = _impossible(each.plan)
        if reason:
            left_out.append(f"{each.name}: {reason}")
        else:
            result.append(each)
    return result, left_out


def _varied(
    plan: LiftPlan,
    varied: str,
    column: Column,
    *,
    mass: float | None = None,
    depth: float | None = None,
    delay: float | None = None,
) -> Variant:
    """A plan of the phases over the seabed alone, whose depths move with it."""
    payload = plan.payload if mass is None else weighing(plan.payload, mass, plan.payload.displaced)
    down = 0.0 if depth is None else depth - plan.depth

    def moved(phase: Phase) -> Phase:
        ends = {name: x + down for name in ("start_depth", "depth") if (x := getattr(phase, name)) is not None}
        return phase.model_copy(update=ends)

    phases = tuple(moved(phase) for phase in over_seabed(plan))
    sensors = plan.sensors if delay is None else plan.sensors.model_copy(update={"delay": delay})
    changed = replace(plan, payload=payload, depth=plan.depth + down, phases=phases, sensors=sensors)
    return Variant(varied, changed, column)


def _deepest(plan: LiftPlan, phase: Phase) -> float:
    """Greatest depth that the wire on the drum reaches in a landing [m]."""
    left = float(wire_usable(drum_record(plan.crane))) - at_rest(plan, phase, -plan.depth).s_w
    return plan.depth + left - THROUGH


def _impossible(plan: LiftPlan) -> str:
    """Why a landing cannot be run, in words; empty where it can."""
    if any(phase.z_start is not None and phase.z_start > -plan.payload.reach(plan.rho) for phase in plan.phases):
        return "the landing would begin before the payload is covered"
    try:
        check_sinks(plan.payload, plan.rho)
        check_wire(plan)
    except StillhookError as e:
        return str(e)
    F, most = max(static_tension(plan, phase) for phase in plan.phases), tip_capacity(plan.crane)
    if most < F:
        words = (show(F, "force"), show(most, "force"))
        return f"payload, hook and wire pull {words[0]} at the crane tip, beyond the SWL and hook of {words[1]}"
    return ""


def landing_sweep(
    plan: LiftPlan,
    columns: Sequence[Column],
    execution: Execution,
    demands: Sequence[Demand] = (),
    progress: Progress | None = None,
) -> xarray.Dataset | None:
    """Limiting heights over the seabed by tolerance, payload, depth and delay, by runs in one period [s] and direction
    [rad]; of the plan as it is in several.

    columns: as of `where_it_governs`; demands of the plan by the frequency-domain method: where its limit of a twin is
    less than that of runs over 1.5 it counts, as in the table, and the interval spans both.
    Returns Hs_landing, Hs_landing_low, Hs_landing_high [m] over variant, alternative and landing_tolerance [m]: 0 below
    the lowest height that is run, inf above the highest. Coords height [m], those that were run; Tp [s], beta [rad],
    mass [kg], depth [m], delay [s] and varied ("period", "payload", "depth", "delay", "" as planned in the middle
    period) of every variant.
    attrs: phase, Tp, beta, own (the plan's tolerance [m], NaN without one), quantities, left_out (a line each), n_seeds
    (of a controller), n_runs. None where no landing is compensated.
    Errors: as `stillhook.plan.tiers.time_domain.tier.refine`.
    """
    phase = landing_of(plan)
    if phase is None:
        return None
    rules = {each.rule.quantity: each.limit for a in plan.alternatives for each in limited(plan, phase, a)}
    quantities = tuple(q for q in TOLERATED if q == TOLERATED[0] or q in rules)
    own = rules.get(TOLERATED[0], math.nan)
    tolerance = np.unique([*TOLERANCES, *([own] if math.isfinite(own) else [])])
    variants, left_out = variants_of(plan, columns)
    steps, parts, n_runs = rungs_of(plan), Parts(progress, {v.name: 1.0 for v in variants}), 0
    table = np.empty((len(variants), len(plan.alternatives), 3, len(tolerance)))
    for v, variant in enumerate(variants):
        ladder = Ladder.run(variant, steps, execution, parts(variant.name))
        known = demands if variant.varied in ("", "period") else ()
        for a, alternative in enumerate(plan.alternatives):
            table[v, a] = ladder.limits(alternative, quantities, tolerance, known)
        n_runs += ladder.work.cells.n_runs
    over = ("variant", "alternative", "landing_tolerance")
    tables = {f"Hs_landing{end}": (over, table[:, :, k]) for k, end in enumerate(("", "_low", "_high"))}
    coords = {
        "variant": [v.name for v in variants],
        "alternative": [a.value for a in plan.alternatives],
        "landing_tolerance": tolerance,
        "height": steps,
        "Tp": ("variant", [v.column[0] for v in variants]),
        "beta": ("variant", [v.column[1] for v in variants]),
        "mass": ("variant", [v.plan.payload.mass for v in variants]),
        "depth": ("variant", [v.plan.depth for v in variants]),
        "delay": ("variant", [v.plan.sensors.delay for v in variants]),
        "varied": ("variant", [v.varied for v in variants]),
    }
    Tp, beta = columns[0]
    attrs = {"phase": phase.name, "Tp": Tp, "beta": beta, "own": own, "quantities": ", ".join(quantities)}
    attrs |= {"left_out": "\n".join(left_out), "n_seeds": SEEDS, "n_runs": n_runs}
    return labelled(tables, coords, attrs)


@dataclass(frozen=True, eq=False)
class Ladder:
    """A variant that was run at rising heights (n,) [m] under every alternative."""

    variant: Variant
    rungs: FloatArray = field(repr=False)
    work: Work = field(repr=False)

    @classmethod
    def run(cls, variant: Variant, rungs: FloatArray, execution: Execution, progress: Progress) -> Ladder:
        """All runs requested together, so that blocks of lanes are full."""
        plan = variant.plan
        result = cls(variant, rungs, Work(plan, Search(), Cells(plan, execution), None))
        calm = plan.environment.calm
        asks = [
            CellRequest(phase.name, winch_of(phase, a), SeaState(h, *variant.column), 1 if calm(h) else n)
            for phase in plan.phases
            for a, n in ((a, SEEDS if a.twin else OF_NO_TWIN) for a in plan.alternatives)
            for h in (0.0, *map(float, rungs))
        ]
        result.work.cells.request(merged(asks), progress)
        return result

    def _line(self, phase: Phase, alternative: Alternative) -> LimitSearch:
        return LimitSearch(phase, alternative, winch_of(phase, alternative), self.variant.column, math.nan, 0.0)

    def limits(
        self, alternative: Alternative, quantities: Sequence[str], tolerance: FloatArray, known: Sequence[Demand]
    ) -> FloatArray:
        """The least limits over the phases and quantities (3, tolerance): value and ends of the 95 % interval of the
        wind sea [m]; none above that of a wider tolerance."""
        result = []
        for phase in self.variant.plan.phases:
            line = self._line(phase, alternative)
            rules = {each.rule.quantity: each for each in limited(self.variant.plan, phase, alternative)}
            for quantity in (q for q in quantities if self.work.has(line, q)):
                of = self.work.runs_of(line, quantity, 1.0)
                H = np.array([self._limit(of, float(t)) for t in tolerance]).T
                if alternative.twin and quantity in rules:
                    H = lower_of(H, self._by_frequency(line, rules[quantity], tolerance, known))
                result.append(np.minimum.accumulate(H[:, ::-1], axis=1)[:, ::-1])
        return np.asarray(np.min(result, axis=0))

    def _limit(self, of: ColumnRuns, tolerance: float) -> FloatArray:
        """Limit of one column at a tolerance with its ends (3,) [m]; inf above what was run, 0 below."""
        x, swell = of.measure.to_x(tolerance), self.work.swell
        if of.still > x:
            return np.zeros(3)
        cells = [(h, of.measure.values(runs)) for h, runs in of.cells if h > swell]
        H, n = np.array([h for h, _ in cells]), np.array([len(values) for _, values in cells])
        beyond = np.array([(values > x).sum() for _, values in cells])
        result = self.work.wind_sea(share_crossing(H, n, beyond, 1.0 - of.measure.of_part()))
        result = np.where(result > self.rungs[-1], math.inf, np.where(result < self.rungs[0], 0.0, result))
        return np.minimum(result, [math.inf, self.rungs[-1], math.inf])  # nothing is known above

    def _by_frequency(
        self, line: LimitSearch, rule: Limited, tolerance: FloatArray, known: Sequence[Demand]
    ) -> FloatArray:
        """Limits of a line by the frequency-domain method (tolerance,), NaN where there are none."""
        who = (line.phase.name, line.alternative, Tier.FREQUENCY)
        demand = next((d for d in known if (d.phase, d.alternative, d.tier) == who), None)
        if demand is None:
            return np.full(len(tolerance), np.nan)
        place = [(T, beta) for T, beta, _ in demand.seas.columns].index(line.column)
        at = [limits_of(demand, [replace(rule, limit=float(t), by_Hs=())]) for t in tolerance]
        return np.array([of.Hs[rule.rule.key][place] for of in at])


def lower_of(H: FloatArray, other: FloatArray) -> FloatArray:
    """Limits by runs with their ends (3, n), with those of another method (n,) where runs allow `APART` times as much:
    the interval then spans both."""
    far = np.isfinite(other) & (H[0] > APART * other)
    return np.where(far, np.stack([other, np.minimum(H[1], other), H[2]]), H)


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
    """The best new against the best classic controller at every tolerance of a variant; none without both."""
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
    """The sweep in short, for JSON: where it was made, and the comparison at every tolerance of every variant (rows of
    pays: better 1, 0 where intervals overlap, -1)."""
    rows = []
    for v in range(block.sizes["variant"]):
        at = {name: float(block[name].values[v]) for name in ("Tp", "mass", "depth", "delay")}
        for each in pays_at(block, v):
            limits = {name: [float(x) for x in getattr(each, name)] for name in ("Hs_new", "Hs_classic")}
            who = {"tolerance": each.tolerance, "new": each.new, "classic": each.classic}
            rows.append(at | who | limits | {"better": each.verdict})
    keys = ("phase", "Tp", "beta", "own", "quantities", "n_seeds", "n_runs")
    left_out = [line for line in str(block.attrs["left_out"]).split("\n") if line]
    return {key: block.attrs[key] for key in keys} | {"left_out": left_out, "pays": rows}
