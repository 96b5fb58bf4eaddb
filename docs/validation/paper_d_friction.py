"""Paper D and section 2.3: friction of a winch from crane tests. Logs of the twin, and what the printed numbers say
about each other."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from blocks import Blocks, panel, percent, picture, save
from numpy.typing import NDArray
from trials.campaigns.friction import campaign_plan, write_campaign
from trials.campaigns.plc_log import Instruments, noise_of

from stillhook import identify, load_crane
from stillhook.identify.compare import drum_torque, speeds, split
from stillhook.identify.system_friction.fitting.fit import FrictionFit, cost, fit_system, predicted
from stillhook.identify.system_friction.fitting.model import (
    Y_NAMES,
    Loss,
    Points,
    Y,
    joined,
    loss_of,
    motor_loss_at,
)
from stillhook.identify.system_friction.fitting.second_loop import SecondLoop, second_loop
from stillhook.identify.system_friction.identify import JUDGED_FROM, Friction, held_out_errors, nominal_share
from stillhook.identify.system_friction.measure import measure
from stillhook.identify.system_friction.thesis import on_grid, thesis_check
from stillhook.library import load_friction, motor
from stillhook.library import system_friction as library_friction
from stillhook.library.draws import crane_with
from stillhook.library.parameter_sets import load_losses
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.spec.crane import Crane
from stillhook.thesis.losses import BAR, CC, FIRST, POINTS, RPM, SECOND, staged, two_cranes, two_loops

SLOW_PAGE = True
PICTURE = "paper-d-friction.png"
CRANE = load_crane("nov-150t")
ONE, TWO = loss_of(motor(FIRST)), loss_of(motor(SECOND))
Y_ONE, Y_TWO = (Y.of(library_friction(name)) for name in ("crane-2", "crane-2-second-loop"))
MINUTES = 6.0  # a log: ten steps or so up and down
E_FIRST, E_SECOND = 1345.0, 938.0  # N^2 m^2, paper D table 4
COUNT = 11
SENSOR = 0.5 * BAR
SEEDS = range(10)
CHANCE, LITTLE = 2.0, 1.5  # N m a motor: how much tests differ by chance
UNMODELLED = 60.0  # N m of 11 motors between 145 and 215 cm^3/rev at 1000 rev/min: of the size of D figure 11's 100
THEIRS: Mapping[str, tuple[str, float, str, int]] = {
    "Y_1": ("`Y_1` [1e-7]", 1e-7, "", 1),
    "Y_2": ("`Y_2` [N m]", 1.0, "", 2),
    "Y_3": ("`Y_3` [N m]", 1.0, "", 2),
    "Y_4": ("`Y_4` [rev/min]", RPM, "", 1),
    "Y_5": ("`Y_5` [1e-3 N m s]", 1e-3, "", 2),
    "Y_6": ("`Y_6` [1e-7]", 1e-7, "", 1),
}
TRACE = 0.05  # N m: a parameter that adds less to a hundred is nothing
Array = NDArray[np.float64]


class Costs(NamedTuple):
    """Costs E over the grid points of tests 1 to 7 [N^2 m^2]: of the logs, of 0.5 bar of scatter, between the printed
    sets, of the supplier's motor where the second-loop set is the truth; and how many points these are."""

    points: int
    logs: float
    sensors: float
    apart: float
    between: float


class Results(NamedTuple):
    """Campaigns of the twin: noise-free (L4593 with the thesis's grid), noisy, and one whose motors are other ones than
    its file says; the second loop on points; costs."""

    exact: Mapping[str, FrictionFit]
    grid: Friction
    noisy: Mapping[str, Friction]
    other: Friction
    loops: Mapping[str, list[SecondLoop]]
    costs: Costs


@contextmanager
def logs(plan: str, noise: str, reference: Crane | None = None) -> Iterator[Path]:
    """The campaign file of logs that the twin writes."""
    with TemporaryDirectory() as folder:
        sensors, tests = Instruments(noise=noise_of(noise), seed=1), campaign_plan(plan)
        out = Path(folder) / "tests"
        yield write_campaign(tests, out, instruments=sensors, duration=f"{MINUTES:g} min", reference=reference).campaign


def campaign(plan: str, noise: str, truth: Crane | None = None) -> Friction:
    """Logs of the twin, identified."""
    with logs(plan, noise, truth) as file:
        return identify.friction(file, fit=identify.FitSettings(loops=0 if truth is None else 1), proposals=0)


def fit_alone(plan: str) -> FrictionFit:
    """Noise-free logs of the twin, system friction fitted: no intervals, no checks."""
    with logs(plan, "none") as file:
        tests = identify.load_campaign(file)
        return fit_system(joined([measure(tests, t).points for t in tests.tests]), loss_of(tests.motor))


def run() -> Results:
    grid = campaign("L4593", "none")
    exact = {"L4593": grid.fit, "crane-2-extended": fit_alone("crane-2-extended")}
    noisy = {plan: campaign(plan, "typical") for plan in exact}
    two = noisy["crane-2-extended"]
    other = campaign(
        "crane-2-extended", "typical", crane_with(CRANE, load_losses(SECOND), load_friction("crane-2-second-loop"))
    )
    loops = {name: [loop(points) for points in made(two.grid, name)] for name in EXPERIMENTS}
    return Results(exact, grid, noisy, other, loops, costs_of(two, other))


# Points without logs


def swivelled(size: float) -> Loss:
    """The supplier's loss and drag that grows as the motor swivels in, from 400 rev/min on."""
    return lambda n, D, dp: (
        ONE(n, D, dp) + size / COUNT / (70.0 / 215.0) * (1.0 - D / (215.0 * CC)) * np.minimum(1.0, n / (400.0 * RPM))
    )


def with_flow(size: float) -> Loss:
    """The supplier's loss and one that grows with the flow D omega."""
    return lambda n, D, dp: ONE(n, D, dp) + size / COUNT / (70.0 / 215.0) * D / (215.0 * CC) * n / (1000.0 * RPM)


class Experiment(NamedTuple):
    label: str
    loss: Callable[[], Loss]
    chance: float


EXPERIMENTS = {
    "flow": Experiment("loss that grows with speed and displacement", lambda: with_flow(UNMODELLED), LITTLE),
    "swivel": Experiment("loss that grows as the motors swivel in", lambda: swivelled(UNMODELLED), LITTLE),
    "chance": Experiment("nothing but chance from test to test", lambda: ONE, CHANCE),
}


def made(grid: Points, name: str) -> Iterator[Points]:
    """Campaigns of one experiment: every test has friction of its own, by chance."""
    what = EXPERIMENTS[name]
    points = staged(grid, what.loss(), Y_ONE, CRANE)
    for seed in SEEDS:
        own = what.chance * np.random.default_rng(seed).standard_normal(len(points.names))[points.test] / points.D_m
        yield replace(points, dp_up=points.dp_up + own, dp_down=points.dp_down - own)


def loop(points: Points) -> SecondLoop:
    return second_loop(points, motor(FIRST), fit_system(points, ONE))


def fall(one: SecondLoop) -> tuple[float, float]:
    """Change of the cost on the fitted and on the held-out tests [-]."""
    return one.second.fitted / one.first.fitted - 1.0, one.second.held_out / one.first.held_out - 1.0


# (a) The blind road


def shown(name: str, value: float, digits: int | None = None) -> str:
    _, unit, _, d = THEIRS[name]
    return f"{value / unit:.{d if digits is None else digits}f}"


def parameter_rows(plan: str, truth: Y, r: Results) -> Iterator[tuple[str, ...]]:
    exact, noisy = r.exact[plan], r.noisy[plan]
    for n in Y_NAMES:
        printed = f"{getattr(truth, n) / THEIRS[n][1]:.6f}".rstrip("0").rstrip(".")
        if n in noisy.fit.dropped:
            yield THEIRS[n][0], printed, "left out" if n in exact.dropped else shown(n, getattr(exact.y, n)), "left out"
            continue
        i = noisy.intervals[n]
        interval = f"{shown(n, i.value)} ({shown(n, i.low)} to {shown(n, i.high)})"
        yield THEIRS[n][0], printed, shown(n, getattr(exact.y, n)), interval


def off(plan: str, truth: Y, r: Results) -> float:
    """Largest relative difference of a parameter from noise-free logs, of those that are more than a trace [-]."""
    y = r.exact[plan].y
    return max(
        abs(getattr(y, n) / getattr(truth, n) - 1.0)
        for n in Y_NAMES
        if getattr(truth, n) > (TRACE if n == "Y_3" else 0.0)
    )


def held_rows(r: Results) -> Iterator[tuple[str, ...]]:
    second = r.other.second
    assert second is not None
    after = {h.test: h for h in held_out_errors(r.other.points, loss_of(second.motor), second.system.y)}
    wrong = {h.test: h for h in r.other.held_out}
    for plan, found in r.noisy.items():
        for h in found.held_out:
            test = next(t for t in found.campaign.tests if t.name == h.test)
            D = float(found.points.D_m[found.points.test == found.points.names.index(h.test)].mean()) / CC
            two = (f"{wrong[h.test].worst:.1f} %", f"{after[h.test].worst:.1f} %") if plan != "L4593" else ("", "")
            name = "L4593" if plan == "L4593" else "crane 2"
            yield f"{name}, {h.test}", f"{D:.0f} cm³/rev", f"{test.load / 1e3:.0f} t", f"{h.worst:.2f} %", *two


# (b) The thesis's grid


def from_steps(found: Friction, every: int) -> Points:
    """The thesis's grid points from every so many pairs of steps, both ends of the speeds kept."""
    parts = []
    for m in found.measured:
        pairs = sorted(m.pairs.pairs, key=lambda p: p.speed)
        kept = [*pairs[::every], *([] if (len(pairs) - 1) % every == 0 else pairs[-1:])]
        grid = on_grid([w for p in kept for w in (p.up, p.down)], 25.0 * RPM)
        n, one = len(grid.speed), m.points
        whole = lambda x, n=n: np.full(n, float(np.mean(x)))
        parts.append(
            replace(
                one,
                test=np.zeros(n, dtype=np.intp),
                omega_up=grid.speed,
                omega_down=grid.speed,
                dp_up=grid.up,
                dp_down=grid.down,
                D_m=whole(one.D_m),
                T_d=whole(one.T_d),
                count=whole(one.count),
                u_dp=grid.u_F,
                hold_out=np.full(n, m.test.hold_out),
            )
        )
    return joined(parts)


def grid_rows(r: Results) -> Iterator[tuple[str, ...]]:
    found = r.grid
    steps = len(found.measured[3].pairs.pairs)
    truth = Y.of(library_friction("L4593"))
    half = thesis_check(from_steps(found, 2), found.points, found.loss, found.fit)
    sets = (
        ("printed (table 2.4), the truth of the logs", truth, math.nan),
        (f"pairs, {steps} steps", found.fit.y, math.nan),
        (f"grid, {steps} steps, least squares", found.check.y_grid, found.check.cost_grid),
        (f"grid, {steps} steps, complex method", found.check.y_complex, found.check.optimum.cost),
        (f"grid, {(steps + 2) // 2} steps, least squares", half.y_grid, half.cost_grid),
        (f"grid, {(steps + 2) // 2} steps, complex method", half.y_complex, half.optimum.cost),
    )
    for label, y, E in sets:
        values = [shown(n, getattr(y, n)) for n in Y_NAMES if n != "Y_3"]
        yield label, *values, "" if math.isnan(E) else f"{E:.0f}", f"{worst(found, y):.2f} %"


def worst(found: Friction, y: Y) -> float:
    """Largest error of predicted friction at the pairs from 250 rev/min on, in % of nominal torque."""
    p = found.points.where(found.points.omega >= JUDGED_FROM)
    return float(np.abs(nominal_share(p, found.loss, y)).max())


# (c) The cost in print


def costs_of(found: Friction, other: Friction) -> Costs:
    seen = found.grid.fitted()
    points = staged(seen, ONE, Y_ONE, CRANE)
    e = SENSOR * np.random.default_rng(0).standard_normal((2, len(points)))
    noisy = replace(points, dp_up=points.dp_up + e[0], dp_down=points.dp_down + e[1])
    apart = float(np.sum((predicted(points, ONE, Y_ONE) - predicted(points, TWO, Y_TWO)) ** 2))
    return Costs(
        len(seen), found.check.cost_grid, cost(noisy, ONE, fit_system(noisy, ONE).y), apart, other.check.cost_grid
    )


def cost_rows(r: Results) -> Iterator[dict[str, Any]]:
    c = r.costs
    chance = float(np.median([one.first.fitted for one in r.loops["chance"]]))
    flow = float(np.median([one.first.fitted for one in r.loops["flow"]]))
    for label, E in (
        ("printed, first loop", E_FIRST),
        ("printed, second loop", E_SECOND),
        ("logs of the twin with typical sensors, right motor model, bias of the grid in it", c.logs),
        ("0.5 bar of scatter on every pressure drop of every grid point", c.sensors),
        ("the second-loop set is the truth (logs), least cost with the supplier's motor", c.between),
        (f"tests that differ by chance, {CHANCE:.0f} N m a motor (median of {len(SEEDS)})", chance),
        (f"unmodelled loss of {UNMODELLED:.0f} N m and {LITTLE} N m of chance (median of {len(SEEDS)})", flow),
    ):
        yield {"label": label, "E": E, "points": c.points}


# (d) The second loop


def loop_rows(r: Results) -> Iterator[tuple[str, ...]]:
    other = r.other.second
    assert other is not None
    yield "paper D", "−30 %", "", "", *refined(motor(SECOND).loss)
    of = [signed(x) for x in fall(other)]
    yield "logs: the truth is the second-loop set", *of, other.verdict, *refined(other.motor.loss)
    for name, found in r.loops.items():
        falls = np.array([fall(one) for one in found])
        cells = [f"{signed(np.median(x))} ({signed(x.min())} to {signed(x.max())})" for x in falls.T]
        yield (
            f"points: {EXPERIMENTS[name].label}",
            *cells,
            verdicts(found),
            *refined(*(one.motor.loss for one in found)),
        )


def signed(part: float) -> str:
    return percent(float(part), sign=True)


def verdicts(found: list[SecondLoop]) -> str:
    return ", ".join(
        f"{n} {v}" for v in ("generalised", "no better", "overfitted") if (n := sum(one.verdict == v for one in found))
    )


UNITS = {"X_1": (1e-3, 1), "X_2": (1e10, 1), "X_3": (1e-3, 1), "X_4": (1.0, 1), "X_5": (1e-14, 1)}


def refined(*losses: Any) -> list[str]:
    """Median of each parameter."""
    return [f"{float(np.median([getattr(x, n) for x in losses])) / unit:.{d}f}" for n, (unit, d) in UNITS.items()]


def rounds(r: Results) -> list[float]:
    """Cost on the fitted tests after 0, 1, 2 and 4 rounds where the truth is another MJ4 [N^2 m^2]."""
    loops = [second_loop(r.other.points, motor(FIRST), r.other.fit, rounds=n) for n in (1, 2, 4)]
    return [loops[0].first.fitted, *(one.second.fitted for one in loops)]


def change_rows(r: Results) -> Iterator[tuple[str, ...]]:
    """What the second-loop set changes over paper D's tests."""
    grid = r.noisy["crane-2-extended"].grid
    p = staged(grid, ONE, Y_ONE, CRANE)
    before, after = predicted(p, ONE, Y_ONE), predicted(p, TWO, Y_TWO)
    for k, name in enumerate(p.names[:7]):
        at = p.test == k
        n = p.omega[at] / RPM
        more = (after - before)[at]
        cells = [f"{np.interp(v, n, before[at]):.0f} {minus(np.interp(v, n, more))}" for v in (50.0, 250.0, 1000.0)]
        share = minus(100.0 * np.interp(1000.0, n, more / p.T_N[at]))
        test = campaign_plan("crane-2").tests[k]
        yield name, f"{test.D_m / CC:.0f} cm³/rev", f"{test.load / 1e3:.0f} t", *cells, f"{share} %"


def minus(x: float) -> str:
    return f"{x:+.1f}".replace("-", "−")


def _at(loss: Loss, n: float, D: float, dp: float) -> float:
    return float(loss(np.array([n * RPM]), np.array([D * CC]), np.array([dp * BAR]))[0])


def spread() -> tuple[float, float]:
    """Loss of 11 motors at 215 less that at 145 cm^3/rev, 58 t and 1000 rev/min, by both sets [N m]."""
    D = np.array([215.0, 145.0]) * CC
    at = Points.planned(np.full(2, 1000.0 * RPM), drum_torque(CRANE, 58e3), D, count=COUNT)
    p = staged(at, ONE, Y_ONE, CRANE)
    first, second = (COUNT * -np.diff(motor_loss_at(p, loss))[0] for loss in (ONE, TWO))
    return float(first), float(second)


# (e) Two cranes


def crane_rows() -> Iterator[dict[str, Any]]:
    for name, label in (("crane-1", "crane 1"), ("crane-2", "crane 2")):
        for layer, where in ((None, "outermost layer"), (1, "innermost layer")):
            s = split(load_friction(name), drum_torque(CRANE, 100e3, layer), speeds())
            fast = float(np.interp(1000.0, s.omega / RPM, s.viscous))
            total = [float(np.interp(n, s.omega / RPM, s.total)) for n in (0.0, 250.0, 1000.0)]
            yield {"label": label, "where": where, "s": s, "fast": fast, "total": total}


# Printed arithmetic


def ahc_share(D: float) -> float:
    """10 bar on three active motors of D [cm^3/rev] over the torque of eight passive ones at 70 cm^3/rev and 275 bar
    [-]."""
    return 3.0 * D * 10.0 / (8.0 * 70.0 * 275.0)


def passive() -> float:
    """Displacement of each of eight passive motors that holds 55 t on the outermost layer at 275 bar [cm^3/rev]."""
    return drum_torque(CRANE, 55e3) / CRANE.i_hD / 8.0 / (275.0 * BAR) / CC


def in_ahc() -> float:
    """What eight passive motors that lose less by the second set take off the pressure of three active ones at 215
    cm^3/rev [bar]."""
    less = 8.0 * (_at(ONE, 500.0, 70.0, 275.0) - _at(TWO, 500.0, 70.0, 275.0))
    return less / (3.0 * 215.0 * CC) / BAR


def claims(r: Results) -> dict[str, Any]:
    """Numbers of the claims."""
    truths = {"L4593": Y.of(library_friction("L4593")), "crane-2-extended": Y_ONE}
    most = max(off(plan, y, r) for plan, y in truths.items())
    held = {plan: max(h.worst for h in found.held_out) for plan, found in r.noisy.items()}
    kept = "Y_2" in r.noisy["L4593"].fit.names, "Y_2" in r.noisy["crane-2-extended"].fit.names
    told = [i.contains(getattr(truths[plan], n)) for plan, found in r.noisy.items() for n, i in found.intervals.items()]
    inside, asked = sum(told), len(told)
    c, gap, steps = r.costs, spread(), rounds(r)
    medians = {name: float(np.median([fall(one)[0] for one in found])) for name, found in r.loops.items()}
    less = 1.0 - _at(TWO, 100.0, 70.0, 275.0) / _at(ONE, 100.0, 70.0, 275.0)
    shares = [100.0 * ahc_share(D) for D in (160.0, 215.0)]
    assert r.other.second is not None
    return locals()


def compute() -> tuple[Blocks, Results]:
    """Blocks of the page, its claims, and what the picture is drawn from."""
    r = run()
    found = claims(r)
    grid = r.noisy["crane-2-extended"].grid.fitted()
    tops = [float(grid.omega[grid.test == k].max()) / RPM for k in np.unique(grid.test)]
    blocks = {
        "claims": found,
        "l4593": parameter_rows("L4593", Y.of(library_friction("L4593")), r),
        "crane-2": parameter_rows("crane-2-extended", Y_ONE, r),
        "held-out": held_rows(r),
        "grid": grid_rows(r),
        "points": {"grid": grid, "tops": tops},
        "ahc": ({}),
        "cost": cost_rows(r),
        "loops": loop_rows(r),
        "change": change_rows(r),
        "losses": POINTS,
        "cranes": crane_rows(),
    }
    return blocks, r


def draw(r: Results) -> None:
    """Errors over speed, two cranes, motor loss of both sets, what the second loop brings."""
    figure = picture(12.0, 8.6)
    axes = figure.subplots(2, 2)
    figure.suptitle("Points: SYNTHETIC logs and tests of the twin, measured on no crane. Curves: published parameters")
    _errors(axes[0, 0], r)
    two_cranes().draw_on(axes[0, 1], "System friction a motor at 100 t, outermost layer (as D fig. 8)")
    two_loops().draw_on(axes[1, 0], "Motor loss before and after the second loop (as D fig. 10)")
    _loops(axes[1, 1], r)
    for ax in axes.ravel():
        panel(ax)
    save(figure, PICTURE)


def _errors(ax, r: Results) -> None:
    for colour, found, label in (
        (COLOURS[0], r.noisy["L4593"], "L4593"),
        (COLOURS[1], r.noisy["crane-2-extended"], "crane 2"),
        (COLOURS[2], r.other, "crane 2 with other motors than its file says"),
    ):
        p = found.points.held_out()
        ax.plot(
            p.omega / RPM, nominal_share(p, found.loss, found.fit.y), "o", color=colour, mfc="none", ms=4, label=label
        )
    ax.axhspan(-1.0, 1.0, color=GREY, alpha=0.15, lw=0)
    ax.axvline(JUDGED_FROM / RPM, color=GREY, lw=0.8, ls=":")
    ax.set_yscale("symlog", linthresh=1.0)
    ax.set_yticks((-1.0, -0.5, 0.0, 0.5, 1.0, 5.0, 10.0), ("−1", "−0.5", "0", "0.5", "1", "5", "10"))
    ax.set_ylim(-2.0, 15.0)
    ax.set_title("Held-out tests: model less measured (as D fig. 17)", fontsize="medium")
    ax.set_xlabel("motor speed [rev/min]")
    ax.set_ylabel("error [% of nominal torque]")


def _loops(ax, r: Results) -> None:
    for colour, marker, (name, found) in zip(COLOURS, "os^", r.loops.items(), strict=False):
        x, y = 100.0 * np.array([fall(one) for one in found]).T
        ax.plot(x, y, marker, color=colour, ms=5, label=EXPERIMENTS[name].label)
    ax.axvline(100.0 * (E_SECOND / E_FIRST - 1.0), color=GREY, ls=":", label="paper D, fitted tests")
    ax.axhline(0.0, color=GREY, lw=0.8)
    ax.set_title("What one second loop brings, ten campaigns each", fontsize="medium")
    ax.set_xlabel("change of the cost on the fitted tests [%]")
    ax.set_ylabel("on the held-out tests [%]")
