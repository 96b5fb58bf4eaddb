"""Campaigns over years: each measured once, every number followed, a crane file for each date, and what may be planned
with."""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from stillhook.base.progress import Progress
from stillhook.errors import LiveError, StillhookError
from stillhook.library.write import crane_toml
from stillhook.live.condition.drift import Drift, TimeToLimit, drift_of, time_to_limit
from stillhook.live.condition.followed import FOLLOWED, Followed, followed_crane
from stillhook.live.condition.measured import Measured, judge, read, save
from stillhook.live.condition.sources import Event, Gathered, gather
from stillhook.live.condition.state import Standing, next_state
from stillhook.live.condition.walk import YEAR, Course, Point, course
from stillhook.report.formatting import change, percent
from stillhook.spec.crane import Crane
from stillhook.spec.validity import Certified
from stillhook.statistics.estimate import NORMAL_95, Estimate
from stillhook.units import quote
from stillhook.validate.data_set.campaign import Campaign

EVIDENCE = "campaigns"
"""Folder of what each campaign says, within that of the output."""


@dataclass(frozen=True)
class NumberCondition:
    """A number after the last campaign, relative to the crane file of the first. dates of its points; today: with the
    yearly wave; trend [1/yr]; drift: None without a certificate; reasons: why campaigns without a point have none."""

    of: Followed
    course: Course
    dates: tuple[datetime.date, ...]
    limit: float | None
    today: Estimate
    trend: Estimate
    to_limit: TimeToLimit | None
    drift: Drift | None
    reasons: Mapping[str, str]

    @property
    def trend_shown(self) -> bool:
        return not self.trend.contains(0.0)

    @property
    def drifted(self) -> bool:
        return self.drift is not None and self.drift.shown


@dataclass(frozen=True)
class DatedCrane:
    """The crane file of a date. campaigns until then; values that it has, relative to that of the first campaign;
    left: why numbers are left as they were; before, after: criteria on what the campaigns of that date hold out."""

    date: datetime.date
    crane: Crane
    campaigns: tuple[Measured, ...]
    values: Mapping[str, Estimate]
    left: Mapping[str, str]
    before: Mapping[str, float]
    after: Mapping[str, float]

    @property
    def name(self) -> str:
        """Name of its file."""
        return f"crane-{self.date.isoformat()}.toml"


@dataclass(frozen=True)
class Condition:
    """What the campaigns say of a crane."""

    reference: Crane
    measured: tuple[Measured, ...]
    numbers: tuple[NumberCondition, ...]
    absent: Mapping[str, str]
    cranes: tuple[DatedCrane, ...]
    standing: Standing
    gathered: Gathered

    @property
    def fine(self) -> bool:
        """Whether nothing has drifted or was refused, and no validity is withdrawn."""
        return not (self.standing.withdrawn or self.gathered.refused or any(n.drifted for n in self.numbers))


def follow_condition(
    sources: Sequence[str | Path],
    out: str | Path | None = None,
    *,
    vanished: bool = False,
    progress: Progress | None = None,
) -> Condition:
    """Follow the condition of a crane through dated campaigns.

    Parameters
    ----------
    sources : sequence of str or Path
        Campaign files of `stillhook validate`, or folders that hold them.
    out : str or Path, optional
        Folder in which what each campaign says is kept, so that it is computed once.
    vanished : bool, default False
        Whether folders may be away, as while they are watched.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Condition
        Numbers with trends, crane files by date, and the state of the certificate; nothing but evidence is written.

    Raises
    ------
    StillhookError
        One line, for what cannot be read, or is not of this crane.
    """
    folder = None if out is None else Path(out)
    gathered = gather(sources, out=folder, vanished=vanished)
    gathered = _of_one_crane(gathered, {Path(s).resolve() for s in sources})
    if not gathered.campaigns:
        lines = (*gathered.refused, *gathered.waiting)
        raise LiveError(f"condition: no campaign to read{f' ({lines[0]})' if lines else ''}. Give campaign files.")
    evidence = None if folder is None else folder / EVIDENCE
    reference = gathered.campaigns[0].crane
    measured, refused = [], list(gathered.refused)
    named = {Path(s).resolve() for s in sources}
    seen: dict[str, Path] = {}
    for i, campaign in enumerate(gathered.campaigns):
        try:
            one = read(_on(campaign, reference), evidence)
            if again := next((seen[d] for d in one.logs.values() if d in seen), None):
                raise LiveError(f"{campaign.file}: its logs are those of {again}. Leave one of the two out.")
        except StillhookError as problem:
            if campaign.file.resolve() in named:
                raise
            refused.append(str(problem))
            continue
        seen |= dict.fromkeys(one.logs.values(), campaign.file)
        measured.append(one)
        if progress is not None:
            progress(0.8 * (i + 1) / len(gathered.campaigns))
    if not measured:
        raise LiveError(f"condition: no campaign could be used ({refused[0]}).")
    gathered = replace(gathered, refused=tuple(refused))
    by_file = {c.file: c for c in gathered.campaigns}
    in_use = [replace(m, campaign=by_file[m.campaign.file]) for m in measured]
    numbers, absent = _numbers(measured, gathered.events, in_use[-1].campaign.crane.certified)
    cranes = _cranes(measured, gathered.events, reference, evidence)
    standing = next_state(in_use, [drift_text(n) for n in numbers if n.drifted])
    if progress is not None:
        progress(1.0)
    return Condition(reference, tuple(measured), numbers, absent, cranes, standing, gathered)


def _on(campaign: Campaign, reference: Crane) -> Campaign:
    """The campaign measured against the first one's crane file, so that all numbers are on one scale."""
    return replace(campaign, crane=reference.model_copy(update={"certified": None}))


def _of_one_crane(gathered: Gathered, named: set[Path]) -> Gathered:
    """Campaigns of the crane of the first. Errors: LiveError for another one that was named by its file."""
    if not gathered.campaigns:
        return gathered
    first, kept, refused = gathered.campaigns[0], [], list(gathered.refused)
    for c in gathered.campaigns:
        if (c.crane.name, c.crane.plant) == (first.crane.name, first.crane.plant):
            kept.append(c)
            continue
        line = (
            f'{c.file}: crane "{c.crane.name}" ({c.crane.plant.value}), and {first.file} is of "{first.crane.name}"'
            f" ({first.crane.plant.value}). Follow each crane by itself."
        )
        if c.file.resolve() in named:
            raise LiveError(line)
        refused.append(line)
    return replace(gathered, campaigns=tuple(kept), refused=tuple(refused))


def _years(date: datetime.date | str, first: datetime.date) -> float:
    day = datetime.date.fromisoformat(date) if isinstance(date, str) else date
    return (day - first).days / YEAR


def course_of(
    of: Followed, measured: Sequence[Measured], events: Sequence[Event], first: datetime.date
) -> Course | None:
    """The posterior of a number after some campaigns; None where none of them has it."""
    with_it = [m for m in measured if of.name in m.numbers]
    if not with_it:
        return None
    relevant = [e for e in events if of.name in e.numbers]
    points = []
    for m in with_it:
        x = m.numbers[of.name]
        common = min(max(x.structural, of.calibration), x.half)
        own = max(x.half**2 - common**2, (0.05 * x.half) ** 2) ** 0.5
        period = sum(e.what == "sensor" and e.date <= m.campaign.date for e in relevant)
        t = _years(m.campaign.date, first)
        points.append(Point(t, x.value, own / NORMAL_95, common / NORMAL_95, period))
    repairs = [_years(e.date, first) - 0.5 / YEAR for e in relevant if e.what == "repair"]
    return course(of, points, repairs)


def _numbers(
    measured: Sequence[Measured], events: Sequence[Event], certified: Certified | None
) -> tuple[tuple[NumberCondition, ...], dict[str, str]]:
    first, last = measured[0].campaign.date, measured[-1].campaign.date
    courses = {name: c for name, of in FOLLOWED.items() if (c := course_of(of, measured, events, first)) is not None}
    absent = {name: measured[-1].reasons.get(name, "not in any campaign") for name in FOLLOWED if name not in courses}
    out = []
    for name, x in courses.items():
        of, limit = FOLLOWED[name], FOLLOWED[name].limit(measured[-1].campaign.criteria)
        trend = x.trend(float(x.t[-1]))
        since = certified.date if certified is not None and certified.date < last.isoformat() else None
        drift = None
        if since is not None and limit is not None:
            drift = drift_of(x, _years(since, first), limit, len(courses))
        out.append(
            NumberCondition(
                of,
                x,
                tuple(m.campaign.date for m in measured if name in m.numbers),
                limit,
                x.value(float(x.t[-1])).estimate(len(x.t)),
                trend.estimate(len(x.t)),
                time_to_limit(x, trend, limit) if limit is not None else None,
                drift,
                {m.campaign.date.isoformat(): m.reasons[name] for m in measured if name in m.reasons},
            )
        )
    return tuple(out), absent


def drift_text(n: NumberCondition) -> str:
    """The drift of a number in words."""
    assert n.drift is not None
    level = n.drift.change.half <= n.drift.number.half
    x, end = (n.drift.change, n.drift.margin) if level else (n.drift.number, n.drift.limit)
    return (
        f"{n.of.meaning} {change(x.value)} since the certificate (95 %: {change(x.low)} to {change(x.high)}), shown to"
        f" be beyond {percent(end)}"
    )


def _cranes(
    measured: Sequence[Measured], events: Sequence[Event], reference: Crane, evidence: Path | None
) -> tuple[DatedCrane, ...]:
    """A crane file for each date, of the campaigns until then."""
    first, out = measured[0].campaign.date, []
    for date in sorted({m.campaign.date for m in measured}):
        until = tuple(m for m in measured if m.campaign.date <= date)
        known = [e for e in events if e.date <= date]
        values: dict[str, Estimate] = {}
        left: dict[str, str] = {}
        for name, of in FOLLOWED.items():
            x = course_of(of, until, known, first)
            if x is None:
                continue
            limit, now = of.limit(until[-1].campaign.criteria), x.value(_years(date, first)).estimate(len(x.t))
            if limit is not None and now.half > limit:
                left[name] = f"known to +-{percent(now.half)} only, more than the limit of {percent(limit)}"
            else:
                values[name] = now
        title = quote(until[-1].campaign.title)
        text = f"followed through {len(until)} campaigns until {date} (random walk; the last: {title})"
        crane = followed_crane(reference, values, text)
        today = [m for m in until if m.campaign.date == date]
        pairs = [(judge(m, reference), judge(m, crane)) for m in today]
        for m in today:
            save(m, evidence)
        before, after = (_worst([pair[i] for pair in pairs]) for i in (0, 1))
        out.append(DatedCrane(date, crane, until, values, left, before, after))
    return tuple(out)


def _worst(judged: Sequence[Mapping[str, float]]) -> dict[str, float]:
    return {key: max(j[key] for j in judged if key in j) for key in dict.fromkeys(k for j in judged for k in j)}


def crane_text(dated: DatedCrane) -> str:
    """The crane file of a date."""
    return crane_toml(dated.crane)
