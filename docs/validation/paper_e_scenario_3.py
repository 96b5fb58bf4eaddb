"""Paper E's quayside scenario 3: the 250 t crane, empty hook, two sines on top of each other; HS and SSC."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import causes
import numpy as np
import xarray
from blocks import Blocks, Table, percent, save
from quay import HEAD, ROWS, Found, Row, alternatives, beside, found, hs_at, numbers, oscillations, runs_of

from stillhook import Sine
from stillhook.analysis.uncertainty.attribution import Figure
from stillhook.report.plots.run import four_panels
from stillhook.sea.motion.motion import Motion
from stillhook.thesis.quay import BEAT, COMPARED, MODES, PITCH, ROLL, WINDOWS, two_sines

SLOW_PAGE = True
TIP = two_sines()
OWN = (
    Row("**as above** (0.5 m and 2 m are amplitudes, closed loop)"),
    Row("0.5 m and 2 m from trough to crest", tip=two_sines(0.5)),
    Row("short sine a quarter period later", tip=two_sines(1.0, math.pi / 2.0)),
    Row("the long sine alone", tip=Sine.from_si(*PITCH)),
    Row("the short sine alone", tip=Sine.from_si(*ROLL)),
    Row("HS 0.70", hs_at(0.7), only="hs"),
)


def both_of(row: Row, modes: tuple[str, ...] = COMPARED) -> dict[str, Found]:
    return {m: found(row, TIP, m, BEAT) for m in modes}


def fastest(tip: Motion) -> float:
    """Highest speed of the tip over a beat [m/min]."""
    return 60.0 * float(np.max(np.abs(tip.sample(np.arange(0.0, 2.0 * BEAT, 0.01))[1])))


def claims(f: Mapping[str, Found], halved: Mapping[str, Found]) -> dict[str, Any]:
    """Numbers of the claims; `halved` are the runs with the other reading of
    "amplitude"."""
    ns, hs, ssc = (f[m] for m in MODES)

    hs_half, ssc_half = halved["hs"], halved["ssc"]
    return locals()


def figures(names: Mapping[str, str]) -> list[Figure]:
    """SSC below HS, in per cent; names: number of the summary -> what it is."""
    return [causes.lower("ssc", "hs", name, f"{label}: SSC below HS", "lower") for name, label in names.items()]


def compute() -> tuple[Blocks, dict[str, xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    base = both_of(OWN[0], MODES)
    said = claims(base, both_of(OWN[1]))
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
        "claims": said,
        "tip": ({}),
        "numbers": Table(HEAD, [numbers(m, f) for m, f in base.items()]),
        "sensitivity": rows,
    }
    return blocks, {m.upper(): base[m].run for m in COMPARED}


def draw(runs: Mapping[str, xarray.Dataset]) -> None:
    title = "nov-250t, empty hook, tip 2 m with 13 s and 0.5 m with 6 s"
    save(four_panels(runs, title=title, start=WINDOWS[3][0], end=WINDOWS[3][1]), "paper-e-scenario-3.png")
