"""One motion under several drives of the same winch, with what is not known of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.analysis.drives.energy import Energies, energies, net_energy
from stillhook.analysis.drives.sizing import Sized, library_crane, rule, sized, with_lead
from stillhook.analysis.steady.limits import Direction, Station, top_of_drive
from stillhook.analysis.uncertainty.draws import Drawing, Uncertainty, draws
from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Meter, Progress
from stillhook.engine.arguments import (
    SERIES_STEP,
    STATISTICS_STEP,
    steps_of_cases,
    steps_per_cycle,
    with_usual_controller,
)
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.pack.winch import power_most, wire_speed_max
from stillhook.engine.scenario.checks import check
from stillhook.engine.scenario.summary import ScenarioRun
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.errors import SpecError
from stillhook.kernels.lanes import VL
from stillhook.library.write import items
from stillhook.physics.scalar import G
from stillhook.report.formatting import fmt
from stillhook.spec.crane import Crane, SourceKind
from stillhook.spec.scenario import Scenario
from stillhook.tables.plausible import IMPLAUSIBLE
from stillhook.units import in_unit, number, quote
from stillhook.variables import attributes

if TYPE_CHECKING:
    import xarray

BAND = (0.05, 0.95)
"""Quantiles at the ends of a band of draws."""
LEAST_DRAWS = 2
"""Draws from which there is a band."""
MOST_DRAWS = 4096
"""Draws at most: beyond it the runs take hours."""
BANDED = ("e_c_pp", "energy_net")
"""Numbers that are drawn, and by which drives are distinguished: less is better."""
NUMBERS = ("e_c_pp", "eta_c", "F_w_max", "energy_unaccounted")
"""Numbers of a run that a comparison shows."""
WEIGHTS = (3.0, 1.0, 2.0)
"""Time that sizing, run and draws of a drive take, relative to each other: for progress."""
STORES = 0.05
"""Share of the net energy from which the change of stores is worth a word [-]."""
EVERY = 0.1
"""Spacing of the series that are kept [s]."""
NOT_VALIDATED = "not validated"
"""What is said of every drive: no twin of a sized drive has a certificate."""


class Band(NamedTuple):
    """Ends of the 5 to 95 % band of draws; NaN where there are too few."""

    low: float
    high: float


@dataclass(frozen=True)
class DriveRun:
    """One drive: how it was sized, its run, and what is uncertain of it.

    v_w_top highest steady wire speed at this load, the slower direction [m/s], binds what stops it there; stroke of
    what carries the load, as tip motion peak to peak [m], None where nothing has one; P_installed [W]; D_motors all
    motors together [m^3/rad]; T_motors largest torque of all machines [N m]; NaN where there are none. assumed: share
    of the drive's numbers that are assumed [-]; drawn: result -> value in every draw.
    """

    drive: Sized
    case: Scenario
    result: ScenarioRun
    summary: Mapping[str, Any]
    energy: Energies
    v_w_top: float
    binds: str
    stroke: float | None
    P_installed: float
    D_motors: float
    T_motors: float
    assumed: float
    drawn: Mapping[str, FloatArray] = field(default_factory=dict)
    failed: int = 0

    @property
    def name(self) -> str:
        return self.drive.name

    @property
    def label(self) -> str:
        """Its name, marked where the crane file says that no such winch is built."""
        return f"{self.name} (paper)" if self.drive.crane.paper else self.name

    @property
    def status(self) -> str:
        """Limits that the run passed; sizes beyond any that was built are in `notes`."""
        passed = [word for word in str(self.summary["status"]).split(", ") if word != IMPLAUSIBLE]
        return ", ".join(passed) or "ok"

    @property
    def ok(self) -> bool:
        """Whether the run stayed inside every limit."""
        return self.status == "ok"

    @property
    def notes(self) -> list[str]:
        """Notes of the run, and of energy that came out of stores or went into them."""
        out, E = [*self.drive.beyond, *self.summary["notes"]], self.energy.stored
        if abs(E) > STORES * abs(self.energy.net):
            way = "came out of" if E < 0.0 else "went into"
            kwh = number(in_unit(abs(E), "kWh", "energy"), 3)
            out.append(
                f"{kwh} kWh per hour {way} stores, which the net energy leaves out: run longer, with a longer warm-up"
            )
        return out

    @property
    def short(self) -> str:
        """Why it is not as fast at full command as the drives were to be, "" where it is."""
        of = self.drive
        return f"{fmt(of.v_full, 'speed', 3)} of wire at full command, held by {of.held_by}" if of.held_by else ""

    def value(self, name: str) -> float:
        """One of `BANDED` at the nominal values."""
        return float(self.summary["e_c_pp"] if name == "e_c_pp" else self.energy.net)

    def band(self, name: str) -> Band:
        """Band of the draws, its ends at least as wide as the value itself."""
        x = self.drawn.get(name, np.empty(0))
        x = x[np.isfinite(x)]
        if len(x) < LEAST_DRAWS or self.failed:
            return Band(math.nan, math.nan)
        low, high = np.quantile(x, BAND)
        return Band(min(float(low), self.value(name)), max(float(high), self.value(name)))

    def to_dict(self) -> dict[str, Any]:
        """Its numbers by the names of `stillhook.variables`, SI."""
        of, e = self.drive, self.energy
        return {
            "status": self.status,
            **{name: self.summary[name] for name in NUMBERS},
            "energy_drawn": e.drawn,
            "energy_returned": e.returned,
            "energy_net": e.net,
            "energy_supplied": dict(e.supplied),
            "energy_lost": dict(e.lost),
            "energy_stored": e.stored,
            "bands": {name: self.band(name)._asdict() for name in BANDED},
            "failed_draws": self.failed,
            "v_w_top": self.v_w_top,
            "binds": self.binds,
            "v_w_full": of.v_full,
            "held_by": of.held_by,
            "stroke": self.stroke,
            "P_installed": self.P_installed,
            "D_motors": self.D_motors,
            "T_motors": self.T_motors,
            "controller": of.mode.value,
            "K_p": of.crane.control.K_p,
            "t_lead": of.crane.control.t_lead,
            "gain_follows_from": of.basis,
            "sized_from": of.source,
            "size": of.size,
            "motors": sum(part.motors for part in of.parts) if of.parts else None,
            "assumed_share": self.assumed,
            "twin": NOT_VALIDATED,
            "paper": self.drive.crane.paper,
            "notes": self.notes,
        }


@dataclass(frozen=True)
class DriveComparison:
    """Drives of one winch under one motion. factors: what the draws vary, by name."""

    reference: Crane
    v_top: float
    runs: tuple[DriveRun, ...]
    n: int
    seed: int
    factors: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """Whether at least one drive stayed inside every limit."""
        return any(run.ok for run in self.runs)

    @property
    def rule(self) -> tuple[str, ...]:
        """How the drives were sized, and what the bands are of."""
        drawn = (
            f"Bands: 5 to 95 % of {self.n} draws of {len(self.factors)} uncertain factors, the same draws for all"
            " drives. Drives whose bands overlap are not distinguished."
            if self.n
            else "No draws: drives are not distinguished."
        )
        lines = (*rule(self.reference, self.v_top), f"{drawn} No drive has a certificate: {NOT_VALIDATED}.")
        demand = CycleInputs(self.reference, self.runs[0].case).demand().v_max
        if demand <= self.v_top:
            return lines
        return (
            *lines,
            f"This motion requires {fmt(demand, 'speed', 3)} of wire, more than the {fmt(self.v_top, 'speed', 3)} of"
            " full command that all drives are sized for: those that can be faster than that (motors that swivel back)"
            " are ahead by it alone. Give settings.top_speed as your sea state requires.",
        )

    def better(self, name: str) -> dict[str, list[str]]:
        """Drive -> drives that it is distinguished from, and better than, among those that reach the requested speed of
        full command."""
        bands = {run.name: Band(math.nan, math.nan) if run.short else run.band(name) for run in self.runs}
        return {a: [b for b in bands if bands[a].high < bands[b].low] for a in bands}

    def ranking(self, name: str) -> list[list[str]]:
        """Drives in groups, the best first: those of one group are not distinguished from all others of it. Drives
        without a band, and those that are slower at full command than was asked for, come last, in one group."""
        fast = (r for r in self.runs if math.isfinite(r.band(name).low) and not r.short)
        runs = sorted(fast, key=lambda r: r.value(name))
        groups: list[list[str]] = []
        highest = -math.inf
        for run in sorted(runs, key=lambda r: r.band(name).low):
            band = run.band(name)
            if groups and band.low <= highest:
                groups[-1].append(run.name)
            else:
                groups.append([run.name])
            highest = max(highest, band.high)
        order = {run.name: i for i, run in enumerate(runs)}
        others = [run.name for run in self.runs if run.name not in order]
        return [*(sorted(group, key=order.__getitem__) for group in groups), *([others] if others else [])]

    def verdict(self, name: str) -> str:
        """The ranking by one of `BANDED` in words."""
        by, better = {"e_c_pp": "error", "energy_net": "net energy"}[name], self.better(name)
        if len(self.runs) == 1:
            return f"By {by}: one drive alone; name others to compare it with."
        if not self.n:
            return f"By {by}: not distinguished without draws."
        slow = {run.name: run.short for run in self.runs if run.short}
        fast = [[drive for drive in group if drive not in slow] for group in self.ranking(name)]
        groups = [group for group in fast if group]
        if not groups:
            return f"By {by}: not ranked, as no drive has the {fmt(self.v_top, 'speed', 3)} of full command."
        best, parts = groups[0], []
        if len(best) == 1:
            parts.append(f"{best[0]} is best" if len(groups) > 1 else f"{best[0]} alone is fast enough to be ranked")
        elif len(best) > 1:
            parts.append(f"not distinguished: {', '.join(best)}")
            within = {a: [b for b in better[a] if b in best] for a in best}
            known = [f"{a} is better than {' and '.join(others)}" for a, others in within.items() if others]
            parts[0] += f" (but {', and '.join(known)})" if known else ""
        for group in groups[1:]:
            parts.append(f"then {group[0]}" if len(group) == 1 else f"then, not distinguished: {', '.join(group)}")
        parts += [f"not ranked: {drive}, {short}" for drive, short in slow.items()]
        return f"By {by}: {'; '.join(parts)}."

    def ordered(self) -> list[DriveRun]:
        """Runs by error: the best first where they are distinguished, by their value within a group; without a value
        last."""
        by_name = {run.name: run for run in self.runs}

        def value(name: str) -> float:
            x = by_name[name].value("e_c_pp")
            return x if math.isfinite(x) else math.inf

        return [by_name[name] for group in self.ranking("e_c_pp") for name in sorted(group, key=value)]

    def to_dict(self) -> dict[str, Any]:
        """The comparison, SI."""
        names = {"e_c_pp": "by_error", "energy_net": "by_energy"}
        return {
            "crane": self.reference.name,
            "top_speed": self.v_top,
            "rule": list(self.rule),
            "draws": self.n,
            "seed": self.seed,
            "factors": list(self.factors),
            "drives": {run.name: run.to_dict() for run in self.ordered()},
            "told_apart": {
                key: {"ranking": self.ranking(n), "better_than": self.better(n)} for n, key in names.items()
            },
        }

    def dataset(self) -> xarray.Dataset:
        """Numbers, draws and series over "drive"."""
        import xarray  # heavy

        runs = self.ordered()
        columns: dict[str, Any] = {}
        table = {run.name: run.to_dict() for run in runs}
        for name in (
            "status",
            "e_c_pp",
            "eta_c",
            "F_w_max",
            "energy_drawn",
            "energy_returned",
            "energy_net",
            "v_w_top",
        ):
            columns[name] = ("drive", [table[run.name][name] for run in runs], attributes(name))
        powers = list(dict.fromkeys(p for run in runs for p in (*run.energy.supplied, *run.energy.lost)))
        for name, of in (("energy_supplied", "supplied"), ("energy_lost", "lost")):
            rows = [[getattr(run.energy, of).get(power, math.nan) for power in powers] for run in runs]
            columns[name] = (("drive", "power"), np.array(rows), attributes(name))
        if self.n:
            for name in BANDED:
                columns[f"{name}_with_draws"] = (
                    ("drive", "draw"),
                    np.array([run.drawn[name] for run in runs]),
                    attributes(name),
                )
        stride = max(round(EVERY / runs[0].result.dt), 1)
        for name in ("s_tip", "e_c", "v_w", "F_w", "u_p"):
            rows = [run.result.column(name)[::stride].tolist() for run in runs]
            columns[name] = (("drive", "time"), np.array(rows), attributes(name))
        time = np.arange(len(rows[0])) * stride * runs[0].result.dt
        coords = {"drive": [run.name for run in runs], "power": powers, "time": ("time", time, {"units": "s"})}
        attrs = {"title": f"Stillhook: drives of {self.reference.name}", "rule": " ".join(self.rule), "seed": self.seed}
        return xarray.Dataset(columns, coords, attrs)


def compare_drives(
    reference: Crane,
    case: Scenario,
    names: Sequence[str],
    *,
    n: int = 16,
    seed: int = 0,
    v_top: float | None = None,
    step: str | None = None,
    progress: Progress | None = None,
) -> DriveComparison:
    """Drives of these winch types, each sized for the reference, under one scenario; n draws of what is uncertain (0:
    none), the same for factors that drives share.

    v_top: wire speed at full command and full displacement on the full drum [m/s], default that of the reference. step:
    integration step of the runs with series, default 2 ms, or shorter where a drive needs it.
    Errors: SpecError, ScenarioError of one line before anything runs.
    """
    check_comparison(reference, case, names, n)
    meter = Meter(sum(WEIGHTS) * len(names), progress)
    meter.tell()
    drives = [_counted(meter, 0, lambda name=name: sized(name, reference, v_top)) for name in names]
    cases = [case.model_copy(update={"mode": drive.mode, "name": drive.name}) for drive in drives]
    for drive, each in zip(drives, cases, strict=True):
        check(drive.crane, each)
    runs = [
        _counted(meter, 1, lambda d=drive, c=each: _run(d, c, step)) for drive, each in zip(drives, cases, strict=True)
    ]
    factors: tuple[str, ...] = ()
    if n:
        pairs = [(drive.crane, each) for drive, each in zip(drives, cases, strict=True)]
        uncertain = Uncertainty.default().on(*pairs)
        table, factors = draws(uncertain, n, seed), tuple(uncertain.factors)
        runs = [_counted(meter, 2, lambda r=run: _with_draws(r, table.columns, table.values)) for run in runs]
    meter.done = meter.total
    meter.tell()
    v = wire_speed_max(reference) if v_top is None else v_top
    return DriveComparison(reference, v, tuple(runs), n, seed, factors)


def check_comparison(reference: Crane, case: Scenario, names: Sequence[str], n: int) -> None:
    """Refuse what cannot be compared, before anything is sized.

    Errors: SpecError, ScenarioError of one line.
    """
    if type(n) is not int or not 0 <= n <= MOST_DRAWS:
        raise SpecError(f"draws = {quote(n)}: give a whole number from 0 to {MOST_DRAWS}.")
    check(reference, with_usual_controller(reference, case))
    for name in names:
        library_crane(name, reference)


def _counted(meter: Meter, part: int, work: Any) -> Any:
    done = work()
    meter.done += WEIGHTS[part]
    meter.tell()
    return done


def _run(drive: Sized, case: Scenario, step: str | None) -> DriveRun:
    """A run with its series at every PLC cycle, and what the machine is."""
    drive, result = _best_lead(drive, case, step)
    crane = drive.crane
    v, binds = _top(drive, case)
    stroke = crane.plant.type.stroke(crane, case.weight + crane.hook_mass * G)
    D, T, P = _machines(crane)
    return DriveRun(
        drive=drive,
        case=case,
        result=result,
        summary=result.summary,
        energy=energies(crane.plant.type, result),
        v_w_top=v,
        binds=binds,
        stroke=None if stroke is None else float(stroke.length),
        P_installed=P if crane.hpu is None else power_most(crane),
        D_motors=D,
        T_motors=T,
        assumed=assumed_share(crane),
    )


def _best_lead(drive: Sized, case: Scenario, step: str | None) -> tuple[Sized, ScenarioRun]:
    """The drive with its reference aligned in time or not, whichever leaves the smaller error, and its run: K_2 of some
    drives compensates the PLC's lateness already."""
    longest = steps_of_cases(drive.crane, [case], SERIES_STEP)
    n_sub = longest if step is None else steps_per_cycle(drive.crane, step)
    cranes = [with_lead(drive.crane, lead) for lead in (drive.t_lead, 0.0)]
    results = run_cases(cranes, [case, case], step=n_sub, lanes=1, every=1, keep=unchanged)
    errors = [math.inf if r.diverged else r.span[0] for r in results]
    best = 1 if errors[1] < errors[0] else 0
    return replace(drive, crane=cranes[best]), results[best]


def _top(drive: Sized, case: Scenario) -> tuple[float, str]:
    """Highest steady wire speed of the slower direction, and what stops it."""
    crane = drive.crane
    result: list[tuple[float, str]] = []
    for direction in Direction:
        if crane.plant.type.steady_operation:
            top = Station(crane, case.load, case.s_w, direction).top_of_mode(drive.mode)
            result.append((top.v_w, f"{top.binds}, {direction}"))
        else:
            of_drive = top_of_drive(crane, case.load, case.s_w, direction)
            result.append((of_drive.v_w, f"{of_drive.binds}, {direction}"))
    return min(result, key=lambda pair: pair[0] if math.isfinite(pair[0]) else -math.inf)


def _machines(crane: Crane) -> tuple[float, float, float]:
    """Displacement of all hydraulic motors [m^3/rad], largest torque [N m] and power [W] of all electric machines; NaN
    without any."""
    sets = crane.motors
    D = sum(m.count * m.D_max for m in sets if hasattr(m, "D_max"))
    T = sum(m.count * m.T_max for m in sets if hasattr(m, "T_max"))
    P = sum(m.count * m.P_max for m in sets if hasattr(m, "P_max"))
    return (D or math.nan, T or math.nan, P or math.nan)


def assumed_share(crane: Crane) -> float:
    """Share of the numbers of a drive's own tables and of its power units that are assumed [-]."""
    tables = {*crane.plant.type.tables, "hpu"}
    kinds = [item.source.kind for item in items(crane) if item.path.partition(".")[0] in tables]
    return sum(kind is SourceKind.ASSUMED for kind in kinds) / max(len(kinds), 1)


def _with_draws(run: DriveRun, columns: Sequence[str], values: FloatArray) -> DriveRun:
    crane, winch = run.drive.crane, run.drive.crane.plant.type
    pairs = list(Drawing(crane, run.case, columns).pairs(values))
    cranes, cases = [c for c, _ in pairs], [s for _, s in pairs]
    n_sub = max(steps_of_cases(c, [s], STATISTICS_STEP) for c, s in pairs)
    runs = run_cases(cranes, cases, step=n_sub, lanes=VL, keep=unchanged)
    e_c_pp = np.array([math.nan if r.diverged else r.span[0] for r in runs])
    net = np.array([math.nan if r.diverged else net_energy(winch, r) for r in runs])
    return replace(run, drawn={"e_c_pp": e_c_pp, "energy_net": net}, failed=sum(r.diverged for r in runs))
