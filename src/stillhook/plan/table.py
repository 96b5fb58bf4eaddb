"""From limits of phases, tiers and rules to one table: the least of them in every cell, with what may be credited."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray, IntArray
from stillhook.engine.certificate import NO_CERTIFICATE, objections
from stillhook.errors import PlanError
from stillhook.physics.scalar import G
from stillhook.plan.definition.capacities import at_rest, places
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Seas, Tier
from stillhook.plan.limits import Limits, limited
from stillhook.plan.result import CLAIMABLE, CREDITS, Cause, Credit, cause, grouped
from stillhook.plan.tiers.closed_form import tip_motion
from stillhook.plan.weather.limit_table import SAME, LimitTable
from stillhook.sea.spectra.spectrum import highest_sea
from stillhook.spec.lift.phase import Phase
from stillhook.spec.validity import CAP, Conditions

TIERS = (Tier.CLOSED_FORM, Tier.FREQUENCY, Tier.TIME)
"""From the least to the most that is known; a later one counts before an earlier."""


class End(StrEnum):
    """What a limit is the end of, where no rule is used up there: the certificate's envelope, the load chart, the seas
    that were analysed, the steepest sea of its period."""

    CERTIFICATE = "certificate-end"
    CHART = "chart-end"
    SEAS = "seas-end"
    STEEPNESS = "steepness"


ENDS, BY_RULE = tuple(End), -1
"""Ends by their places in tables, and the place of a limit at which a rule is used up."""


@dataclass(frozen=True)
class Axes:
    """Axes of a plan's tables: heading [rad], period [s], names of alternatives, phases and rules."""

    headings: tuple[float, ...]
    periods: tuple[float, ...]
    alternatives: tuple[Alternative, ...]
    phases: tuple[str, ...]
    rules: tuple[str, ...]

    @classmethod
    def of(cls, plan: LiftPlan) -> Axes:
        """Those of a plan, headings and periods rising."""
        env, rules = plan.environment, tuple(rule.key for rule in plan.rules.rules)
        phases = tuple(phase.name for phase in plan.phases)
        return cls(tuple(sorted(env.headings)), tuple(sorted(env.Tp)), plan.alternatives, phases, rules)

    @property
    def columns(self) -> tuple[int, int]:
        """Number of headings and of periods."""
        return len(self.headings), len(self.periods)

    def place(self, Tp: FloatArray, beta: FloatArray) -> tuple[IntArray, IntArray]:
        """Rows of headings and of periods of columns (c,). Errors: PlanError for a column that is not of this table."""
        rows = [_nearest(x, of) for x, of in ((beta, self.headings), (Tp, self.periods))]
        return rows[0], rows[1]


def _nearest(x: FloatArray, of: Sequence[float]) -> IntArray:
    off = np.abs(np.asarray(x, dtype=float)[:, None] - np.array(of))
    best = off.argmin(axis=1)
    if (off[np.arange(len(off)), best] > SAME * (1.0 + np.abs(x))).any():
        raise PlanError(
            f"limits of periods or headings that are not of the table ({len(of)} of them). Use the plan's own table."
        )
    return np.asarray(best, dtype=np.int64)


def limit_table(plan: LiftPlan, axes: Axes, Hs: FloatArray) -> LimitTable:
    """Limits (heading, period) [m] on the axes of a plan, up to its highest sea."""
    env = plan.environment
    return LimitTable(Hs, np.array(axes.headings), np.array(axes.periods), env.heading_tolerance, max(env.Hs))


@dataclass(frozen=True, eq=False)
class Gathered:
    """Limits of all phases side by side: Hs, low, high (tier, alternative, phase, rule, heading, period) [m], NaN where
    not determined."""

    axes: Axes
    Hs: FloatArray = field(repr=False)
    low: FloatArray = field(repr=False)
    high: FloatArray = field(repr=False)


def gathered(axes: Axes, limits: Sequence[Limits]) -> Gathered:
    """Limits assembled in one array. For a repeated column the later one applies."""
    shape = (len(TIERS), len(axes.alternatives), len(axes.phases), len(axes.rules), *axes.columns)
    result = Gathered(axes, *(np.full(shape, np.nan) for _ in range(3)))
    for each in limits:
        if each.alternative not in axes.alternatives:
            continue
        at = (TIERS.index(each.tier), axes.alternatives.index(each.alternative), axes.phases.index(each.phase))
        heading, period = axes.place(each.Tp, each.beta)
        for into, of in ((result.Hs, each.Hs), (result.low, each.low), (result.high, each.high)):
            for rule, values in of.items():
                into[(*at, axes.rules.index(rule), heading, period)] = values
    return result


@dataclass(frozen=True, eq=False)
class Chosen:
    """What counts: Hs, low, high and tier (alternative, phase, rule, heading, period), tier as a place in `TIERS`, -1
    where there is none; end as a place in `ENDS`, None where every limit is `BY_RULE`."""

    axes: Axes
    Hs: FloatArray = field(repr=False)
    low: FloatArray = field(repr=False)
    high: FloatArray = field(repr=False)
    tier: IntArray = field(repr=False)
    end: IntArray | None = field(default=None, repr=False)

    @property
    def ends(self) -> IntArray:
        """What each limit is the end of."""
        return np.full(self.Hs.shape, BY_RULE, dtype=np.int64) if self.end is None else self.end


def chosen(limits: Gathered) -> Chosen:
    """Of every rule the limit by the highest tier: the twin where it was run, else the frequency-domain method, else
    the closed form. Where a tier shows seas inside, and no limit (`stillhook.plan.limits.Limits.low`), one below
    from a lesser tier is lifted to there."""
    determined = np.isfinite(limits.Hs) | np.isposinf(limits.Hs)
    rank = np.arange(len(TIERS)).reshape(-1, *([1] * (limits.Hs.ndim - 1)))
    tier = np.where(determined, rank, -1).max(axis=0)
    at = np.maximum(tier, 0)[None]

    def taken(a: FloatArray) -> FloatArray:
        return np.asarray(np.where(tier >= 0, np.take_along_axis(a, at, axis=0)[0], np.nan))

    Hs, low, high = (taken(a) for a in (limits.Hs, limits.low, limits.high))
    for k in range(len(TIERS)):
        lifted = ~determined[k] & (tier < k) & (limits.low[k] > Hs)
        Hs, tier = np.where(lifted, limits.low[k], Hs), np.where(lifted, k, tier)
        low, high = (np.where(lifted, np.nan, ends) for ends in (low, high))
    return Chosen(limits.axes, Hs, low, high, tier.astype(np.int64))


APART = 1.5
"""A limit by runs that is more than so many times that of the frequency-domain method does not count."""


BY_RUNS, BY_FREQUENCY = TIERS.index(Tier.TIME), TIERS.index(Tier.FREQUENCY)


def lower_where_apart(plan: LiftPlan, limits: Gathered, modelled: Chosen) -> Chosen:
    """Limits that count, with those of the frequency-domain method in place of limits by runs far above them, unless
    the plan reconciles the two in writing (`LiftPlan.reconciled`).

    The method takes what the winch leaves of a motion about rest. A run in which the wire always goes out has friction
    that never reverses, and says little of the same load as soon as it stops. The closed form lowers no limit by runs:
    it is known to be worse (`stillhook.plan.assessments.quality`).
    """
    far = _apart(plan, limits)
    taken = far & (modelled.tier == BY_RUNS)
    Hs = np.where(taken, limits.Hs[BY_FREQUENCY], modelled.Hs)
    low, high = (np.where(taken, np.nan, ends) for ends in (modelled.low, modelled.high))
    return replace(modelled, Hs=Hs, low=low, high=high, tier=np.where(taken, BY_FREQUENCY, modelled.tier))


def apart_remarks(plan: LiftPlan, limits: Gathered, modelled: Chosen) -> list[Cause]:
    """A cause for every phase and rule in which the frequency-domain method counts in place of runs."""
    axes = limits.axes
    taken = _apart(plan, limits) & (modelled.tier == BY_FREQUENCY)
    return [
        cause(
            "apart",
            phase=axes.phases[k],
            rule=axes.rules[r],
            alternatives=[a.label for a, each in zip(axes.alternatives, taken[:, k, r], strict=True) if each.any()],
            n=int(taken[:, k, r].sum()),
            of=taken[:, k, r][taken[:, k, r].any(axis=(1, 2))].size,
            factor=APART,
            runs=_ends(limits.Hs[BY_RUNS, :, k, r][taken[:, k, r]]),
            frequency=_ends(limits.Hs[BY_FREQUENCY, :, k, r][taken[:, k, r]]),
        )
        for k, r in zip(*np.nonzero(taken.any(axis=(0, 3, 4))), strict=True)
    ]


def _apart(plan: LiftPlan, limits: Gathered) -> BoolArray:
    """Where both are known and too far apart, and the plan gives no reason (alternative, phase, rule, heading,
    period)."""
    of_runs, other = limits.Hs[BY_RUNS], limits.Hs[BY_FREQUENCY]
    with np.errstate(invalid="ignore"):
        far = np.isfinite(other) & (of_runs > APART * other)
    for phase, rule in plan.reconciled:
        far[:, limits.axes.phases.index(phase), limits.axes.rules.index(rule)] = False
    return np.asarray(far)


def _ends(Hs: FloatArray) -> list[float | None]:
    """Least and largest of heights [m]; None for any."""
    return [float(x) if np.isfinite(x) else None for x in (Hs.min(), Hs.max())]


def to_chart_end(plan: LiftPlan, of: Chosen) -> Chosen:
    """Limits with those that are the last height of the load chart marked as its end."""
    axes, end = of.axes, of.ends
    for i, alternative in enumerate(axes.alternatives):
        for k, phase in enumerate(plan.phases):
            for each in limited(plan, phase, alternative):
                if each.by_Hs:
                    at = (i, k, axes.rules.index(each.rule.key))
                    last = np.isclose(of.Hs[at], each.by_Hs[-1][0], rtol=SAME, atol=0.0)
                    end[at] = np.where(last, ENDS.index(End.CHART), end[at])
    return replace(of, end=end)


@dataclass(frozen=True, eq=False)
class Governed:
    """The table (alternative, heading, period): Hs with low and high [m]; phase, rule and tier as places in their axes,
    -1 where nothing governs: no limit was found below the highest sea state analysed, or none is known; end as of
    `Chosen`."""

    axes: Axes
    Hs: FloatArray = field(repr=False)
    low: FloatArray = field(repr=False)
    high: FloatArray = field(repr=False)
    phase: IntArray = field(repr=False)
    rule: IntArray = field(repr=False)
    tier: IntArray = field(repr=False)
    end: IntArray | None = field(default=None, repr=False)

    @property
    def ends(self) -> IntArray:
        """What each limit is the end of."""
        return np.full(self.Hs.shape, BY_RULE, dtype=np.int64) if self.end is None else self.end


def governing(plan: LiftPlan, limits: Mapping[Credit, Chosen]) -> Mapping[Credit, Governed]:
    """The limits that govern: but for those by the model, none is above the steepest sea of its period."""
    governs = {credit: governed(to_chart_end(plan, of)) for credit, of in limits.items()}
    top = max(plan.environment.Hs)
    return {credit: of if credit == CREDITS[0] else not_steep(of, top) for credit, of in governs.items()}


def governed(of: Chosen) -> Governed:
    """The least limit over phases and rules in every cell, and what it is by: of equal ones the first."""
    n_a, n_p, n_r, n_b, n_T = of.Hs.shape
    flat = [a.reshape(n_a, n_p * n_r, n_b, n_T) for a in (of.Hs, of.low, of.high)]
    least = np.where(np.isnan(flat[0]), np.inf, flat[0]).argmin(axis=1)[:, None]

    def at_least(a: IntArray) -> IntArray:
        return np.take_along_axis(a.reshape(flat[0].shape), least, axis=1)[:, 0]

    Hs, low, high = (np.take_along_axis(a, least, axis=1)[:, 0] for a in flat)
    lowest = np.where(np.isnan(flat[1]), np.inf, flat[1]).min(axis=1)
    low = np.where(np.isposinf(Hs) & np.isfinite(lowest), lowest, low)
    nothing = np.isnan(flat[0]).all(axis=1)
    Hs = np.where(nothing, np.nan, np.where(np.isnan(Hs), np.inf, Hs))
    governs = np.isfinite(Hs)
    phase, rule = np.divmod(least[:, 0], n_r)
    phase, rule, tier = (np.where(governs, k, -1).astype(np.int64) for k in (phase, rule, at_least(of.tier)))
    end = np.where(governs, at_least(of.ends), np.where(nothing, BY_RULE, ENDS.index(End.SEAS)))
    return Governed(of.axes, Hs, low, high, phase, rule, tier, end.astype(np.int64))


def not_steep(of: Governed, top: float) -> Governed:
    """Limits cut at the steepest sea of their period where the seas analysed go higher than that, up to top [m]."""
    highest = np.array([highest_sea(T) for T in of.axes.periods])
    cut = (of.Hs > highest * (1.0 + SAME)) & (highest < top)
    Hs = np.where(cut, highest, of.Hs)
    low, high = (np.where(cut, np.nan, ends) for ends in (of.low, of.high))
    phase, rule, tier = (np.where(cut, -1, place) for place in (of.phase, of.rule, of.tier))
    return Governed(of.axes, Hs, low, high, phase, rule, tier, np.where(cut, ENDS.index(End.STEEPNESS), of.ends))


def counting(of: Chosen) -> NDArray[np.str_]:
    """The tier whose limits count in (alternative, phase, heading, period), as text: the most detailed of those
    that determine a rule."""
    names = np.array(["", *(tier.value for tier in TIERS)])
    return np.asarray(names[of.tier.max(axis=2) + 1])


def unreported(of: Chosen) -> Mapping[Alternative, tuple[str, ...]]:
    """Phases that no tier determines in some cell, by alternative, of those that have such phases."""
    silent = np.asarray((of.tier < 0).all(axis=2))
    phases_of = {}
    for i, alternative in enumerate(of.axes.alternatives):
        phases_of[alternative] = tuple(name for k, name in enumerate(of.axes.phases) if silent[i, k].any())
    return {a: phases for a, phases in phases_of.items() if phases}


def inside(
    plan: LiftPlan, phase: Phase, alternative: Alternative, seas: Seas
) -> tuple[NDArray[np.bool_], tuple[str, ...]]:
    """In which seas (n,) the compensation that the twin computes may be credited in full; what prevents it, a
    reason each with the seas that it is of.

    Everywhere for phases without compensation, and for none and the flat cap: there is nothing to credit. For a twin
    where the crane's certificate holds, is of a crane and not synthetic, and its envelope covers load, wire, motion and
    period of the tip, and mode. The load is what hangs at the tip less the hook, as the winch feels it; the tip's
    motion is the most probable largest of the phase, from crest to trough.
    """
    everywhere = np.ones(len(seas), dtype=bool)
    if not (phase.compensated and alternative.twin):
        return everywhere, ()
    against = _against(plan, alternative)
    if against:
        return ~everywhere, against
    assert plan.crane.certified is not None
    reasons = [plan.crane.certified.outside(each) for each in _conditions(plan, phase, alternative, seas)]
    everywhere[:] = [not outside for outside in reasons]
    return everywhere, _counted(reasons)


def _counted(reasons: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """Reasons of every sea in a line for each range that is left: the first of them, and in how many seas."""
    alike = grouped((reason[reason.find(" (") :], reason) for reason in chain.from_iterable(reasons))
    return tuple(
        f"outside the validated envelope in {len(lines)} of {len(reasons)} seas:"
        f" {lines[0]}{' and the like' if len(set(lines)) > 1 else ''}"
        for lines in alike.values()
    )


def _against(plan: LiftPlan, alternative: Alternative) -> tuple[str, ...]:
    """What prevents credit of a certificate in all seas."""
    crane = plan.crane
    if crane.certified is None:
        return (f"{NO_CERTIFICATE}: no more than {CAP:.0%} of compensation is credited",)
    reasons = objections(crane)
    if reasons:
        return tuple(f"certificate does not hold: {reason}" for reason in reasons)
    if crane.certified.synthetic and not plan.credits_synthetic:
        return (f"certificate {crane.certified.short} is SYNTHETIC: no crane was validated",)
    if plan.machine(alternative)[0] != crane:
        return (f"{alternative} runs with other settings of the controller than those that were validated",)
    return ()


def _conditions(plan: LiftPlan, phase: Phase, alternative: Alternative, seas: Seas) -> list[Conditions]:
    """What a phase asks in each sea, in the terms of a certificate."""
    mode = plan.machine(alternative)[1].value
    still = [at_rest(plan, phase, z) for z in places(phase)]
    load, wire = max(s.F_tip for s in still) / G - plan.crane.hook_mass, [s.s_w for s in still]
    tip = tip_motion(plan, phase, seas)
    pp, T = 2.0 * tip.largest(max(phase.duration or 0.0, plan.rules.settings["duration_least"]))[0], tip.T_z
    return [
        Conditions(
            load=load,
            s_w_min=min(wire) - 0.5 * float(s),
            s_w_max=max(wire) + 0.5 * float(s),
            s_tip_pp=float(s),
            period=float(t),
            modes=(mode,),
        )
        for s, t in zip(pp, T, strict=True)
    ]


@dataclass(frozen=True, eq=False)
class Certified:
    """Whether all that the twin computes is credited (alternative, phase, heading, period, height), heights rising; why
    not, by alternative; needs (alternative, phase): whether that takes a certificate, for a twin computes a
    compensation."""

    covers: BoolArray = field(repr=False)
    reasons: Mapping[Alternative, tuple[str, ...]]
    needs: BoolArray = field(repr=False)

    @property
    def claimed(self) -> BoolArray:
        """What is covered without a certificate, of the shape of covers."""
        return np.broadcast_to(~self.needs[:, :, None, None, None], self.covers.shape)

    @property
    def share(self) -> FloatArray:
        """Share of the heights that the certificate covers (alternative, phase, heading, period); NaN where nothing
        takes one."""
        return np.where(self.needs[:, :, None, None], self.covers.mean(axis=-1), np.nan)


def certified_in(plan: LiftPlan, axes: Axes, seas: Seas) -> Certified:
    """What the crane's certificate covers of a full table of seas. Phases that nothing compensates need no certificate,
    and alternatives without a twin have none to need."""
    heights = np.unique(seas.Hs)
    covers = np.ones((len(axes.alternatives), len(axes.phases), *axes.columns, len(heights)), dtype=np.bool_)
    heading, period = axes.place(seas.Tp, seas.beta)
    height = np.searchsorted(heights, seas.Hs)
    reasons: dict[Alternative, list[str]] = {}
    needs = np.zeros(covers.shape[:2], dtype=np.bool_)
    for i, alternative in enumerate(axes.alternatives):
        for k, phase in enumerate(plan.phases):
            if alternative.twin and phase.compensated:
                needs[i, k] = True
                covers[i, k, heading, period, height], against = inside(plan, phase, alternative, seas)
                reasons.setdefault(alternative, []).extend(against)
    return Certified(
        covers, {alternative: tuple(dict.fromkeys(lines)) for alternative, lines in reasons.items()}, needs
    )


def _uncovered(plan: LiftPlan, axes: Axes, alternative: Alternative, certified: BoolArray) -> list[Phase]:
    """Compensated phases in which a certificate does not cover a twin everywhere; none for other alternatives."""
    of = certified[axes.alternatives.index(alternative)]
    return [p for p in plan.phases if alternative.twin and p.compensated and not of[axes.phases.index(p.name)].all()]


def by_credit(plan: LiftPlan, modelled: Chosen, certified: Certified) -> Mapping[Credit, Chosen]:
    """Limits by the model of each alternative as they count under every credit: that of a SYNTHETIC certificate, which
    shows what a validation would be worth, may not be claimed. Errors: PlanError as `check_cap`."""
    heights = np.unique(plan.environment.table().Hs)
    limits = dict(zip(CREDITS, (modelled, credited_of(plan, modelled, heights, certified.covers)), strict=True))
    if plan.credits_synthetic and certified.covers[certified.needs].any():
        limits[CLAIMABLE] = credited_of(plan, modelled, heights, certified.claimed)
    return limits


def check_cap(plan: LiftPlan, axes: Axes, certified: BoolArray) -> None:
    """Errors: PlanError where a certificate does not cover an alternative everywhere, and the plan has no flat cap that
    could be credited in its place."""
    if Alternative.CAP in axes.alternatives:
        return
    open_ = ((a, phases[0]) for a in axes.alternatives if (phases := _uncovered(plan, axes, a, certified)))
    first = next(open_, None)
    if first is not None:
        raise PlanError(
            f"{first[0]}: no certificate covers {first[1].name} everywhere, and what is credited without one is that of"
            f' the flat cap. Add "{Alternative.CAP}" to the alternatives.'
        )


def credited_of(plan: LiftPlan, modelled: Chosen, heights: FloatArray, certified: BoolArray) -> Chosen:
    """Limits that may be credited, of limits by the model of each alternative.

    certified (alternative, phase, heading, period, height) as `Certified.covers` for heights [m] rising. Where a sea is
    not covered, a rule is met only where the flat cap meets it as well: the limit falls to the highest covered sea
    below it, or to the cap's own limit where that is more. So nothing that no certificate covers is credited above the
    limit of the cap, and nothing below the lesser of both. Rules that the cap does not determine (pressures of a winch)
    stay with the twin.
    Errors: PlanError as `check_cap`.
    """
    check_cap(plan, modelled.axes, certified)
    axes, Hs, tier, end = modelled.axes, modelled.Hs.copy(), modelled.tier.copy(), modelled.ends.copy()
    low, high = modelled.low.copy(), modelled.high.copy()
    for i, alternative in enumerate(axes.alternatives):
        for phase in _uncovered(plan, axes, alternative, certified):
            k = axes.phases.index(phase.name)
            at, of_cap = (i, k), (axes.alternatives.index(Alternative.CAP), k)
            cap = modelled.Hs[of_cap]
            reach = np.fmax(cap, _covered_up_to(cap, heights, certified[at]))
            lower = reach < modelled.Hs[at]
            by_cap = lower & (cap == reach)
            Hs[at] = np.where(lower, reach, modelled.Hs[at])
            tier[at] = np.where(by_cap, modelled.tier[of_cap], modelled.tier[at])
            end[at] = np.where(by_cap, modelled.ends[of_cap], end[at])
            end[at] = np.where(lower & ~by_cap, ENDS.index(End.CERTIFICATE), end[at])
            for ends, of in ((low, modelled.low), (high, modelled.high)):
                ends[at] = np.where(by_cap, of[of_cap], np.where(lower, np.nan, ends[at]))
    return replace(modelled, Hs=Hs, low=low, high=high, tier=tier, end=end)


def _covered_up_to(cap: FloatArray, heights: FloatArray, certified: BoolArray) -> FloatArray:
    """Highest sea (rule, heading, period) [m] up to which every sea above the cap's limit (rule, heading, period) is
    covered by certified (heading, period, height); inf where all are, -inf where the first above it is not."""
    beyond = (heights > cap[..., None]) & ~certified[None]
    first = beyond.argmax(axis=-1)
    before = np.where(first > 0, heights[np.maximum(first - 1, 0)], -np.inf)
    return np.asarray(np.where(beyond.any(axis=-1), before, np.inf))
