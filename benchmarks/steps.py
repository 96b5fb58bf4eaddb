"""How long may a step be? Writes the tables of docs/validation/step-size.md: `python -m benchmarks.steps [--check]`.

Every case runs with each step and with the reference of 0.1 ms; wire and pressures are compared at every PLC cycle from
the very start, the peak-to-peak error over the moving window of the metrics.
"""

import math
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stillhook import Scenario, load_crane
from stillhook.engine.arguments import RK4_LIMIT, fastest_rates
from stillhook.engine.pack.winch import pack
from stillhook.engine.runner import Ending
from stillhook.engine.scenario.summary import ScenarioRun
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.errors import SpecError
from stillhook.library import changed
from stillhook.spec.crane import Crane

PAGE = Path(__file__).resolve().parents[1] / "docs" / "validation" / "step-size.md"
REFERENCE = 100
STEPS = {1: "10 ms", 2: "5 ms", 3: "3.33 ms", 4: "2.5 ms", 5: "2 ms", 10: "1 ms"}
"""Steps per PLC cycle of 10 ms."""

WIRE, PRESSURE = 1.0e-4, 0.2e5
"""What the default step for statistics has to keep on the demonstration cases: 0.1 mm and 0.2 bar."""


class Deviation(NamedTuple):
    """Largest differences from the reference: wire out [m], peak of either pressure [Pa], peak-to-peak error [m]."""

    wire: float
    peak: float
    e_pp: float


class Case(NamedTuple):
    """A lift on a crane, under a name for the tables."""

    name: str
    crane: Crane
    scenario: Scenario


def demonstration() -> list[Case]:
    """The lifts of the demonstration on the 250 t crane, and one or two on each other crane."""
    nov_250t, out = load_crane("nov-250t"), []
    low, two = "sine 0.95 m 12 s", "sine 2 m 13 s + sine 0.5 m 6 s"
    tips = {"2.8 m, 12 s": "sine 2.8 m 12 s", "0.95 m, 12 s": low, "2 m, 13 s + 0.5 m, 6 s": two}
    for mode in ("ns", "hs", "ssc"):
        name = f"250 t crane, {mode.upper()}"
        out += [
            Case(f"{name}, 100 t, {words}", nov_250t, scenario("100 t", "100 m", tip, mode))
            for words, tip in tips.items()
        ]
        out.append(Case(f"{name}, hook alone at 15 m, 0.95 m, 12 s", nov_250t, scenario("0 t", "15 m", low, mode)))
    out.append(
        Case(
            "150 t crane, HS, 90 t, 2.8 m, 12 s",
            load_crane("nov-150t"),
            scenario("90 t", "20 m", "sine 2.8 m 12 s", "hs"),
        )
    )
    pure = load_crane("nov-100t-pure-active")
    for mode in ("ns", "ssc"):
        out.append(
            Case(
                f"pure active crane, {mode.upper()}, 50 t, 1 m, 10 s",
                pure,
                scenario("50 t", "100 m", "sine 1 m 10 s", mode),
            )
        )
    return out


def demanding() -> list[Case]:
    """Cases beyond the demonstration, each harder on the integration in one way."""
    crane, sine = load_crane("nov-250t"), "sine 2.8 m 12 s"
    plain = scenario("100 t", "100 m", sine, "ssc")
    stiff = changed(crane, {"friction": {"sigma_0": f"{5.0 * crane.friction.sigma_0:g} N m/rad"}})
    soft = changed(crane, {"friction": {"sigma_0": f"{0.2 * crane.friction.sigma_0:g} N m/rad"}})
    return [
        Case("motion ramped in over 2 s instead of 10 s", crane, scenario("100 t", "100 m", sine, "ssc", ramp="2 s")),
        Case("motion starts at full speed, no ramp", crane, scenario("100 t", "100 m", sine, "ssc", ramp="0 s")),
        Case(
            "150 t crane, HS, 124 t, 147 m, no ramp",
            load_crane("nov-150t"),
            scenario("124 t", "147 m", sine, "hs", ramp="0 s"),
        ),
        Case("relief valves open: 3.6 m, 10 s, 200 t", crane, scenario("200 t", "100 m", "sine 3.6 m 10 s", "hs")),
        Case("bristle five times as stiff", stiff, plain),
        Case("bristle a fifth as stiff", soft, plain),
        Case("slow reversals: 0.2 m, 20 s", crane, scenario("100 t", "100 m", "sine 0.2 m 20 s", "ssc")),
        Case(
            "regularised friction instead of the bristle",
            crane,
            scenario("100 t", "100 m", sine, "ssc", friction="regularised"),
        ),
    ]


def scenario(load: str, s_w: str, tip: str, mode: str, **more: str) -> Scenario:
    return Scenario(load=load, s_w=s_w, tip=tip, mode=mode, duration="90 s", **more)


def run_one(case: Case, n_sub: int) -> ScenarioRun:
    return run_cases(case.crane, [case.scenario], step=n_sub, lanes=1, every=1, keep=unchanged)[0]


def deviation(run: ScenarioRun, reference: ScenarioRun) -> Deviation:
    wire = float(np.max(np.abs(run.column("s_w") - reference.column("s_w"))))
    peaks = [abs(float(np.max(run.column(p)) - np.max(reference.column(p)))) for p in ("p_a", "p_b")]
    return Deviation(wire, max(peaks), abs(run.span[0] - reference.span[0]))


def measure(case: Case) -> dict[int, Deviation | None]:
    """Deviation for each number of steps per cycle; None where the step is refused or the run diverged."""
    reference = run_one(case, REFERENCE)
    deviations: dict[int, Deviation | None] = {}
    for n in STEPS:
        try:
            run = run_one(case, n)
        except SpecError:
            deviations[n] = None
            continue
        deviations[n] = deviation(run, reference) if run.ending is Ending.DONE else None
    return deviations


def order(deviations: dict[int, Deviation | None], coarse: int, fine: int) -> float:
    """Order of convergence of the wire between two steps."""
    a, b = deviations[coarse], deviations[fine]
    return math.log(a.wire / b.wire) / math.log(fine / coarse) if a and b and b.wire > 0.0 else math.nan


def table(head: list[str], lines: list[list[str]]) -> str:
    return "\n".join("| " + " | ".join(line) + " |" for line in [head, ["---"] * len(head), *lines])


def number(x: float, digits: int) -> str:
    return "–" if math.isnan(x) else f"{x:.{digits}f}"


def three(d: Deviation | None) -> list[str]:
    return (
        ["refused"] * 3
        if d is None
        else [f"{d.wire * 1e3:.4f} mm", f"{d.peak / 1e5:.3f} bar", f"{d.e_pp * 1e3:.4f} mm"]
    )


def worst_table(results: dict[str, dict[int, Deviation | None]]) -> str:
    """For each step the largest deviation over all cases that took it, and how many did not."""
    lines = []
    for n, step in STEPS.items():
        got = [d for r in results.values() if (d := r[n]) is not None]
        worst = Deviation(*(max(column) for column in zip(*got, strict=True))) if got else None
        lines.append([step, *three(worst), str(len(results) - len(got))])
    return table(["step", "wire out", "peak pressure", "`e_c_pp`", "refused"], lines)


def case_table(results: dict[str, dict[int, Deviation | None]]) -> str:
    """Wire and peak at the two default steps, and the order of convergence."""
    lines = []
    for name, deviations in results.items():
        five, two = three(deviations[2]), three(deviations[5])
        lines.append(
            [name, *five[:2], *two[:2], number(order(deviations, 2, 4), 1), number(order(deviations, 5, 10), 1)]
        )
    return table(["case", "5 ms: wire", "peak", "2 ms: wire", "peak", "order 5 → 2.5 ms", "2 → 1 ms"], lines)


def stability_table() -> str:
    """The fastest mode that the integration has to follow, and the longest step that it allows, with the hook alone and
    with load."""
    lines = []
    for name, load in (
        ("nov-250t", "100 t"),
        ("nov-250t", "0 t"),
        ("nov-150t", "90 t"),
        ("nov-100t-pure-active", "50 t"),
    ):
        for friction in ("lugre", "regularised"):
            case = Scenario(load=load, s_w="15 m", friction=friction)
            mode, rate = max(fastest_rates(pack(load_crane(name), case)).items(), key=lambda i: i[1])
            words = {"0 t": "hook alone"}.get(load, load)
            law = "bristle" if friction == "lugre" else "regularised"
            lines.append([f"`{name}`, {words}, 15 m", law, mode, f"{rate:.0f} 1/s", f"{RK4_LIMIT / rate * 1e3:.1f} ms"])
    return table(["crane, load, wire out", "friction", "fastest mode", "rate", "longest step"], lines)


def reference_error(cases: list[Case]) -> Deviation:
    """Largest deviation of the reference itself from half its step."""
    pairs = ((run_one(c, REFERENCE), run_one(c, 2 * REFERENCE)) for c in cases)
    return Deviation(*(max(column) for column in zip(*(deviation(a, b) for a, b in pairs), strict=True)))


def reference_line(d: Deviation) -> str:
    return (
        f"The reference of 0.1 ms differs from one of 0.05 ms by at most {d.wire * 1e3:.0e} mm of wire, "
        f"{d.peak / 1e5:.0e} bar of peak pressure and {d.e_pp * 1e3:.0e} mm of `e_c_pp`."
    )


def conclusion(results: dict[str, dict[int, Deviation | None]]) -> str:
    """What the default step keeps on the demonstration cases, in a sentence that is computed."""
    got = [d for r in results.values() if (d := r[2]) is not None]
    wire, peak = max(d.wire for d in got), max(d.peak for d in got)
    kept = len(got) == len(results) and wire <= WIRE and peak <= PRESSURE
    verdict = "holds" if kept else "does not hold"
    return (
        f"**The claim {verdict}**: with 5 ms the largest deviations over {len(results)} cases are {wire * 1e3:.3f} mm"
        f" of wire (allowed {WIRE * 1e3:.1f} mm) and {peak / 1e5:.3f} bar of peak pressure (allowed"
        f" {PRESSURE / 1e5:.1f} bar)."
    )


def page(text: str) -> str:
    """The page with its blocks computed."""
    cases = demonstration()
    demo = {c.name: measure(c) for c in cases}
    hard = {c.name: measure(c) for c in demanding()}
    blocks = {
        "conclusion": conclusion(demo),
        "reference": reference_line(reference_error(cases)),
        "worst": worst_table(demo),
        "cases": case_table(demo),
        "demanding": case_table(hard),
        "stability": stability_table(),
    }
    for name, block in blocks.items():
        head, mark, rest = text.partition(f"<!-- {name} -->\n")
        if not mark:
            raise SystemExit(f"{PAGE.name} has no place for {name}")
        text = f"{head}{mark}{block}\n<!-- end -->{rest.partition('<!-- end -->')[2]}"
    return text


def main() -> None:
    before = PAGE.read_text(encoding="utf-8")
    after = page(before)
    if "--check" in sys.argv[1:]:
        sys.exit(f"{PAGE.name} is out of date; run: python -m benchmarks.steps" if after != before else 0)
    PAGE.write_text(after, encoding="utf-8", newline="\n")
    print(f"docs/validation/{PAGE.name}")


if __name__ == "__main__":
    main()
