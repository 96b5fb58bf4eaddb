"""How much of SSC's published advantage is left when every controller is tuned, strong SSC among them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import causes
from blocks import Blocks, Rows, Table, percent, save, sayings

from stillhook import Crane, Scenario, load_crane, simulate
from stillhook.analysis.controllers import Controller, controller, strong_ssc
from stillhook.analysis.effects import scaled
from stillhook.analysis.loop_stability.margins import margins
from stillhook.analysis.tuning.comparison import (
    VARIATIONS,
    Outcome,
    Point,
    bars_figure,
    outcomes,
    pareto_figure,
    variations,
)
from stillhook.analysis.tuning.objective import Limits, Score, governing_loop, hold_out, scenarios, scored
from stillhook.analysis.tuning.parameters import present, with_settings
from stillhook.engine.simulate import run_cases
from stillhook.thesis.ringing import rms_above
from stillhook.units import show

SLOW_PAGE = True
SAID = sayings("controllers_at_their_best")
CRANE = load_crane("nov-250t")
CASES = scenarios(CRANE)
UNSEEN = hold_out(CRANE, seed=0)
CLASSIC = ("ns", "hs")

TUNED: Mapping[str, Mapping[str, Any]] = SAID["tuned"]
"""What `stillhook tune nov-250t --controllers ns,hs,ssc,ssc-cubic` (objective balanced, seed 0, 400 evaluations; ns
with 1000) found; a
test asks whether it keeps its limits and whether a step aside in any setting is better."""

FRONTS: Mapping[str, Sequence[Mapping[str, float]]] = SAID["fronts"]
"""Some points of the fronts that `--pareto` with 150 evaluations a tuning found, SI; K_2 in s^2/m."""


SMALLER = load_crane("nov-150t")
TUNED_SMALLER: Mapping[str, Mapping[str, Any]] = SAID["tuned_smaller"]
"""The same for nov-150t, whose NS is at 0.91 of the displacement."""


class Rated(NamedTuple):
    """A controller with its scores in the tuning's scenarios and in the hold-out ones."""

    controller: Controller
    score: Score
    held_out: Score


def best(name: str) -> Controller:
    """The tuned controller of this name."""
    plain = controller(name)
    return Controller(f"{name}-tuned", plain.mode, {"control": dict(TUNED[name])})


def published() -> list[Controller]:
    return [controller(n) for n in ("ns", "hs", "ssc", "ssc-cubic")]


def rated(controllers: Sequence[Controller]) -> list[Rated]:
    """All of them in all scenarios, side by side."""
    machines = [k.on(CRANE) for k in controllers]
    out = []
    for cases in (CASES, UNSEEN):
        n = len(cases)
        asked = [case.with_mode(k.mode) for k in controllers for case in cases]
        found = run_cases([m for m in machines for _ in range(n)], asked)
        rows = [found[i * n : (i + 1) * n] for i in range(len(controllers))]
        out.append([scored(m, k.mode, cases, r, Limits()) for m, k, r in zip(machines, controllers, rows, strict=True)])
    return [Rated(*three) for three in zip(controllers, *out, strict=True)]


def smaller() -> Rows:
    """The same on the 150 t crane."""
    plain = {n: controller(n) for n in TUNED_SMALLER}
    tuned = {n: Controller(f"{n}, tuned", k.mode, {"control": dict(TUNED_SMALLER[n])}) for n, k in plain.items()}
    which = [*plain.values(), strong_ssc(SMALLER), *tuned.values()]
    seen, unseen = (outcomes(SMALLER, which, cases) for cases in (scenarios(SMALLER), hold_out(SMALLER)))
    return [(k.name, brief(a), brief(b)) for k, a, b in zip(which, seen, unseen, strict=True)]


def mm(x: float) -> str:
    return f"{1e3 * x:.0f} mm"


def bar(p: float) -> str:
    return f"{p / 1e5:.0f} bar"


def row(label: str, r: Rated) -> dict[str, Any]:
    s, h = r.score, r.held_out
    crane = r.controller.on(CRANE)
    loop = governing_loop(crane, r.controller.mode, Limits()).loop
    margin = math.nan if loop is None else margins(loop, crane.control.K_p).gain_margin
    speed = show(s.v_w_capacity, "speed", 3)
    return locals()


def best_classic(scores: Sequence[Score]) -> tuple[list[float], list[float]]:
    """Error and pressure of whichever of NS and HS has the smaller error, scenario by scenario."""
    chosen = [min(scores, key=lambda s: s.e_c_pp[i]) for i in range(len(scores[0].e_c_pp))]
    return [s.e_c_pp[i] for i, s in enumerate(chosen)], [s.pressures[i] for i, s in enumerate(chosen)]


def advantage(ssc: Score, classic: Sequence[Score]) -> tuple[float, float]:
    """SSC over the best classic: mean over the scenarios of the change of error, and of the change of highest pressure
    [-]."""
    e, p = best_classic(classic)
    n = len(e)
    errors, pressures = (
        sum(a / b for a, b in zip(x, y, strict=True)) / n for x, y in ((ssc.e_c_pp, e), (ssc.pressures, p))
    )
    return errors - 1.0, pressures - 1.0


def lead_of(r: Mapping[str, Any], end: str, quantity: str) -> float:
    """SSC over the classic controller with less error, mean over the scenarios [%]; end: "" or "-tuned"."""
    total = 0.0
    for i in range(len(CASES)):
        classic = min((r[f"{n}{end} {i}"] for n in CLASSIC), key=lambda one: float(one["e_c_pp"]))
        total += float(r[f"ssc{end} {i}"][quantity]) / float(classic[quantity])
    return 100.0 * (total / len(CASES) - 1.0)


def attribution() -> causes.Attribution:
    """What SSC's lead over the best classic controller depends on, as published and with all of them tuned, one change
    at a time."""
    which = {k.name: k for k in (*(controller(n) for n in ("ns", "hs", "ssc")), *map(best, ("ns", "hs", "ssc")))}
    machines = {name: k.on(CRANE) for name, k in which.items()}
    runs = {
        f"{name} {i}": (machines[name], one.with_mode(k.mode))
        for name, k in which.items()
        for i, one in enumerate(CASES)
    }

    tried = [row.alternative() for row in causes.variants(globals())]
    return causes.attribute(runs, causes.figures(globals()), tried, pairs=False)


def compute() -> tuple[Blocks, Any]:
    strong = strong_ssc(CRANE)
    names = list(TUNED)
    everything = [*published(), strong, *map(best, names)]
    found = rated(everything)
    by = {r.controller.name: r for r in found}
    before = {n: by[n].score for n in ("ns", "hs", "ssc", "ssc-cubic", "strong-ssc")}
    after = {n: by[f"{n}-tuned"].score for n in names}
    versus = {
        "SSC as published, classic as published": advantage(before["ssc"], [before[n] for n in CLASSIC]),
        "SSC tuned, classic as published": advantage(after["ssc"], [before[n] for n in CLASSIC]),
        "SSC as published, classic tuned": advantage(before["ssc"], [after[n] for n in CLASSIC]),
        "strong SSC, classic tuned": advantage(before["strong-ssc"], [after[n] for n in CLASSIC]),
        "SSC tuned, classic tuned": advantage(after["ssc"], [after[n] for n in CLASSIC]),
    }
    rows = [row(f"{n}, as published" if n != "strong-ssc" else "strong-ssc, by rule", by[n]) for n in before]
    rows += [row(f"{n}, tuned", by[f"{n}-tuned"]) for n in names]
    blocks = {
        "scores": rows,
        "advantage": [(n, *(percent(x, sign=True) for x in both)) for n, both in versus.items()],
        "settings": settings(names, strong),
        "one-at-a-time": one_at_a_time(strong),
        "lead": lead(),
        "slow": slow([*published()[:3], strong, *map(best, ("ns", "hs", "ssc"))]),
        "ringing": ringing([controller("ns"), controller("ssc"), strong, best("ssc")]),
        "smaller": smaller(),
        "variations": varied([controller("ssc"), strong, best("ns"), best("ssc")]),
    }
    blocks["causes"] = causes.block(attribution())
    claims = claimed(versus, before)
    blocks["claims"] = claims
    return blocks, (by, fronts())


def claimed(versus: Mapping[str, tuple[float, float]], before: Mapping[str, Score]) -> dict[str, Any]:
    e_0, p_0 = versus["SSC as published, classic as published"]
    e_1, p_1 = versus["SSC tuned, classic tuned"]
    gain = 1.0 - before["strong-ssc"].e_c_pp_mean / before["ssc"].e_c_pp_mean
    price = before["strong-ssc"].p_max / before["ssc"].p_max - 1.0
    return locals()


def settings(names: Sequence[str], strong: Controller) -> Rows:
    shown = {"K_1": "{:.4f} s/m", "K_2": "{:.4f} s²/m", "K_p": "{:.3f} 1/m", "t_lead": "{:.0f} ms"}
    shown |= {"u_thr": "{:.2f}", "alpha_swl": "{:.2f}"}
    labels = ["as published", "strong-ssc, by rule", *(f"{n}, tuned" for n in names)]
    machines = [CRANE, strong.on(CRANE), *(best(n).on(CRANE) for n in names)]
    rows = []
    for label, crane in zip(labels, machines, strict=True):
        v = present(crane)
        rows.append((label, *(text.format(1e3 * v[n] if n == "t_lead" else v[n]) for n, text in shown.items())))
    return rows


MORE_K_1 = 1.015  # the best factor on K_1 alone is between 1.01 and 1.02: what leakage takes on the mean


def one_at_a_time(strong: Controller) -> Rows:
    """What each setting of strong SSC, and a feedforward that compensates leakage, is worth alone; NS beside SSC."""
    c, s = present(CRANE), present(strong.on(CRANE))
    K_1 = {"K_1": MORE_K_1 * c["K_1"], "K_2": MORE_K_1 * c["K_2"]}
    K_p, t_lead = {"K_p": s["K_p"]}, {"t_lead": s["t_lead"]}
    gain, late = f"`K_p` {s['K_p']:.2f} 1/m", f"`t_lead` {1e3 * s['t_lead']:.0f} ms"
    steps: dict[str, dict[str, float]] = {
        "as published": {},
        "`K_1` and `K_2` 1.5 % more, for leakage": K_1,
        late: t_lead,
        gain: K_p,
        f"{gain} and {late}: strong": K_p | t_lead,
        "all three": K_1 | K_p | t_lead,
    }
    machines = [with_settings(CRANE, values) for values in steps.values()]
    columns = []
    for mode in ("ns", "ssc"):
        same = Controller(mode, controller(mode).mode)
        columns.append([brief(o) for o in outcomes(machines, [same] * len(machines), CASES)])
    return list(zip(steps, *columns, strict=True))


PURE = load_crane("nov-100t-pure-active")
PURE_LEAD_CASES = (("0 t", 55, 12), ("40 t", 40, 10), ("80 t", 38, 12))
LEADS = (0.0, 0.005, 0.010, 0.0175, 0.025, 0.030, 0.040, 0.060)  # s, beyond the delay of the motion signal
LEAD_CASES = (("50 t", 20, 12), ("100 t", 60, 8), ("100 t", 78, 12), ("200 t", 60, 10))
"""Load, peak speed [m/min] and period [s]."""


def lead() -> Table:
    """Error of strong SSC over its lead: where the best one is beside the rule's."""
    rows = []
    for crane, delay, cases in ((CRANE, 0.0, LEAD_CASES), (CRANE, 0.1, LEAD_CASES), (PURE, 0.0, PURE_LEAD_CASES)):
        strong = strong_ssc(crane, delay=delay).on(crane)
        rule = strong.control.t_lead
        assert rule is not None
        machines = [with_settings(strong, {"t_lead": delay + t}) for t in LEADS]
        for load, v, T in cases:
            tip, sensors = f"sine {v / 60.0 * T / 6.283185307:.5f} m {T} s", {"delay": f"{delay} s"}
            case = Scenario(load=load, s_w="100 m", tip=tip, warm_up="20 s", duration="52 s", sensors=sensors)
            old, ours, *others = [s["e_c_pp"] for s in run_cases([crane, strong, *machines], case)]
            at = min(range(len(LEADS)), key=lambda i: others[i])
            late, pure = ", signal 0.1 s late" if delay else "", " (pure active)" if crane is PURE else ""
            label = f"{load}, {v} m/min, {T} s{late}{pure}"
            rows.append((label, mm(old), mm(others[0]), mm(ours), mm(others[at]), f"{1e3 * LEADS[at]:.0f} ms"))
    rule_text = f"rule, {1e3 * (strong_ssc(CRANE).on(CRANE).control.t_lead or 0.0):.1f} ms"
    return Table(("scenario", "published", "strong, no lead", rule_text, "best lead", "at (beyond the delay)"), rows)


def ringing(which: Sequence[Controller]) -> Rows:
    """Pressure above 0.5 Hz, and highest pressure, of one heavy case."""
    rows = []
    for k in which:
        case = Scenario(load="150 t", s_w="100 m", tip="sine 1.6 m 12 s", mode=k.mode, warm_up="30 s", duration="66 s")
        run = simulate(k.on(CRANE), case, every="0.05 s")
        above = rms_above(run, "p_a", frequency=0.5, start=30.0)
        rows.append((k.name, f"{above / 1e5:.1f} bar", bar(float(run["p_max"])), mm(float(run["e_c_pp"]))))
    return rows


SLOW: Mapping[str, Sequence[Any]] = SAID["slow"]
"""Load, wire out, speed of the tip [m/min] and what is changed on the winch (of `VARIATIONS`) of the runs at a slow
steady speed."""


def slow(which: Sequence[Controller]) -> Rows:
    """Pressure above 0.5 Hz in the minute about the fastest moment of a swell of 600 s, where the winch's slow swing
    has time to grow."""
    columns = []
    for load, s_w, v, winch_is in SLOW.values():
        tip = f"sine {v / 60.0 * 600.0 / 6.283185307:.6f} m 600 s"
        machine, column = CRANE, []
        for what in winch_is:
            machine = scaled(machine, VARIATIONS[what][0])
        for k in which:
            times = {"warm_up": "270 s", "duration": "330 s", "ramp": "20 s"}
            case = Scenario(load=load, s_w=s_w, tip=tip, mode=k.mode, gas_held=True, **times)
            run = simulate(with_control_of(k, machine), case, every="0.05 s")
            column.append(f"{rms_above(run, 'p_a', frequency=0.5, start=270.0) / 1e5:.1f} bar")
        columns.append(column)
    return list(zip((k.name for k in which), *columns, strict=True))


def with_control_of(k: Controller, machine: Crane) -> Crane:
    """The winch under the settings that the controller has on the crane as it should be."""
    return machine.model_copy(update={"control": k.on(CRANE).control})


def varied(which: Sequence[Controller]) -> Rows:
    found = variations(CRANE, which, CASES)
    return [(name, *map(brief, found_)) for name, found_ in found.items()]


def brief(o: Outcome) -> str:
    return f"{mm(o.e_c_pp_mean)}, {bar(o.p_max)}{'' if not o.beyond else ' (' + '; '.join(o.beyond) + ')'}"


UNITS = {"K_1": "s/m", "K_2": "s^2/m", "K_p": "1/m", "t_lead": "s"}


def fronts() -> dict[str, list[Point]]:
    """The stored points of each front and the best of the tuning, run again, less what is beaten."""
    out = {}
    for name, points in FRONTS.items():
        mode = controller(name).mode
        texts = [{n: f"{v} {UNITS[n]}" if n in UNITS else v for n, v in p.items()} for p in points]
        which = [*(Controller(name, mode, {"control": control}) for control in texts), best(name)]
        found = sorted((o.p_max, o.e_c_pp_mean) for o in outcomes(CRANE, which, CASES))
        kept = [(p, e) for i, (p, e) in enumerate(found) if all(e < other for _, other in found[:i])]
        out[name] = [Point(e, p, {}) for p, e in kept]
    return out


def draw(shown: tuple[Mapping[str, Rated], Mapping[str, Sequence[Point]]]) -> None:
    by, lines = shown
    names = list(TUNED)
    pairs = {n: (by[n], by[f"{n}-tuned"]) for n in names}
    rows = {n: (a.score, b.score, a.held_out, b.held_out) for n, (a, b) in pairs.items()}
    strong = by["strong-ssc"]
    rows["strong-ssc\n(by rule)"] = (strong.score, strong.score, strong.held_out, strong.held_out)
    title = "nov-250t, 50 and 150 t, 20 to 75 m/min: as published and tuned"
    save(bars_figure(rows, title=title), "controllers-at-their-best.png")
    marks = {n: (a.score, b.score) for n, (a, b) in pairs.items() if n in lines}
    marks["strong-ssc (by rule)"] = strong.score, strong.score
    title = "nov-250t: mean error against highest pressure"
    save(pareto_figure(lines, marks, title=title), "controllers-at-their-best-front.png")
