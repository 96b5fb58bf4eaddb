"""Paper E's quayside scenario 3: the 250 t crane, empty hook, two sines on top of each other; HS and SSC."""

from __future__ import annotations

import math
from collections.abc import Mapping

import causes
import numpy as np
import xarray
from blocks import claims_table, percent, save, table, verdict
from quay import HEAD, ROWS, WARM, Found, Row, alternatives, beside, found, hs_at, less, numbers, oscillations, runs_of

from stillhook import Sine
from stillhook.analysis.uncertainty.attribution import Figure
from stillhook.report.plots.run import four_panels
from stillhook.sea.motion.motion import Motion, Sum

PAGE = "paper-e-scenario-3.md"
MODES = ("ns", "hs", "ssc")
COMPARED = ("hs", "ssc")
ROLL, PITCH = (0.5, 6.0), (2.0, 13.0)  # amplitude [m], period [s]: section 5.1.2
BEAT = 78.0  # s: 13 periods of 6 s, 6 of 13 s


def sea(scale: float = 1.0, phase: float = 0.0) -> Motion:
    """Both sines; the short one starts `phase` [rad] later."""
    return Sum([Sine.from_si(scale * PITCH[0], PITCH[1]), Sine.from_si(scale * ROLL[0], ROLL[1], phase)])


TIP = sea()
OWN = (
    Row("**as above** (0.5 m and 2 m are amplitudes, closed loop)"),
    Row("0.5 m and 2 m from trough to crest", tip=sea(0.5)),
    Row("short sine a quarter period later", tip=sea(1.0, math.pi / 2.0)),
    Row("the long sine alone", tip=Sine.from_si(*PITCH)),
    Row("the short sine alone", tip=Sine.from_si(*ROLL)),
    Row("HS 0.70", hs_at(0.7), only="hs"),
)


def both_of(row: Row, modes: tuple[str, ...] = COMPARED) -> dict[str, Found]:
    return {m: found(row, TIP, m, BEAT) for m in modes}


def fastest(tip: Motion) -> float:
    """Highest speed of the tip over a beat [m/min]."""
    return 60.0 * float(np.max(np.abs(tip.sample(np.arange(0.0, 2.0 * BEAT, 0.01))[1])))


def claims(f: Mapping[str, Found], halved: Mapping[str, Found]) -> dict[str, tuple[str, str, str]]:
    """claim -> theirs, ours, verdict; the index repeats them. `halved` are the runs with the other reading of
    "amplitude"."""
    ns, hs, ssc = (f[m] for m in MODES)

    def pair(name: str, unit: str, digits: int) -> tuple[str, str]:
        a, b, c, d = (float(getattr(x, name)) for x in (ssc, hs, halved["ssc"], halved["hs"]))
        ours = f"{a:.{digits}f} against {b:.{digits}f} {unit}, {less(a, b)}; {less(c, d)} with half the motion"
        return ours, verdict(a < b and c < d, "not reproduced")

    return {
        "pressure levels are lowered (highest `p_a`)": ("SSC below HS", *pair("p_a_max", "bar", 0)),
        "control error is minimized": ("SSC below HS", *pair("e_c_pp", "cm", 1)),
        "reduced oscillations: pressure, rms above 0.5 Hz": ("SSC below HS", *pair("p_a", "bar", 1)),
        "reduced oscillations: wire speed, rms above 0.5 Hz": ("SSC below HS", *pair("v_w", "m/min", 2)),
        "HS is the classic mode to compare with": (
            "HS and SSC are shown",
            (
                f"NS is {'full' if ns.alpha_p > 0.995 else 'not full'} with an error of {ns.e_c_pp:.1f} cm (HS"
                f" {hs.e_c_pp:.1f}); pumps of SSC {percent(ssc.alpha_p)}"
            ),
            "fits: NS has nothing left" if ns.alpha_p > 0.995 else "NS would do as well",
        ),
    }


def figures(names: Mapping[str, str]) -> list[Figure]:
    """SSC below HS, in per cent; names: number of the summary -> what it is."""
    return [causes.lower("ssc", "hs", name, f"{label}: SSC below HS", "lower") for name, label in names.items()]


def compute() -> tuple[dict[str, str], dict[str, tuple[str, str, str]], dict[str, xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    base = both_of(OWN[0], MODES)
    said = claims(base, both_of(OWN[1]))
    wide = (
        "variant: HS / SSC",
        "`v_w` above 0.5 Hz, m/min",
        "`p_a` above 0.5 Hz, bar",
        "error p-p, cm",
        "highest `p_a`, bar",
        "pumps of SSC",
    )
    rows = []
    for row in (*OWN, *(r for r in ROWS if not r.label.startswith("NS"))):
        both = both_of(row)
        rows.append((row.label, *beside([*both.values()]), percent(both["ssc"].alpha_p)))
    runs, other = (
        runs_of(TIP, COMPARED, BEAT),
        alternatives((*OWN[1:], *(r for r in ROWS if not r.label.startswith("NS")))),
    )
    blocks = {
        "causes": causes.block(causes.attribute(runs, figures({"p_a_max": "highest `p_a`", "e_c_pp": "error"}), other)),
        "causes-oscillation": causes.block(
            causes.attribute(
                runs,
                figures({"v_w": "`v_w` above 0.5 Hz", "p_a": "`p_a` above 0.5 Hz"}),
                other,
                pairs=False,
                evaluate=oscillations,
            ),
            "The same for the oscillations, one change at a time.",
        ),
        "notes": causes.notes({m.upper(): f.run for m, f in base.items()}),
        "claims": claims_table(said),
        "tip": (
            f"Tip: {fastest(TIP):.1f} m/min at most; {fastest(sea(0.5)):.1f} m/min if the printed amplitudes are"
            " heights."
        ),
        "numbers": table(HEAD, [numbers(m, f) for m, f in base.items()]),
        "sensitivity": table(wide, rows),
    }
    return blocks, said, {m.upper(): base[m].run for m in COMPARED}


def draw(runs: Mapping[str, xarray.Dataset]) -> None:
    title = "nov-250t, empty hook, tip 2 m with 13 s and 0.5 m with 6 s"
    save(four_panels(runs, title=title, start=WARM, end=WARM + BEAT / 2.0), "paper-e-scenario-3.png")
