"""Paper E's quayside scenario 3: the 250 t crane, empty hook, two sines on top of each other; HS and SSC."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import causes
import numpy as np
import xarray
from blocks import Blocks, save
from quay import ROWS, Found, attributions, found

from stillhook.report.plots.run import four_panels
from stillhook.sea.motion.motion import Motion
from stillhook.thesis.quay import BEAT, COMPARED, MODES, PITCH, ROLL, WINDOWS, two_sines  # noqa: F401  # variants

SLOW_PAGE = True
TIP = two_sines()
OWN = causes.variants(globals())
TRIED = (*OWN, *(row for row in ROWS if row.group != "NS"))


def both_of(row: causes.Variant, modes: tuple[str, ...] = COMPARED) -> dict[str, Found]:
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


def compute() -> tuple[Blocks, dict[str, xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    base = both_of(OWN[0], MODES)
    said = claims(base, both_of(OWN[1]))
    blocks = {
        **attributions(globals(), TIP, COMPARED, BEAT, TRIED[1:]),
        "notes": causes.notes({m.upper(): f.run for m, f in base.items()}),
        "claims": said,
        "tip": ({}),
        "numbers": [{"m": m, "f": f} for m, f in base.items()],
        "sensitivity": [{"label": r.label, "all": [*both_of(r).values()]} for r in TRIED],
    }
    return blocks, {m.upper(): base[m].run for m in COMPARED}


def draw(runs: Mapping[str, xarray.Dataset]) -> None:
    title = "nov-250t, empty hook, tip 2 m with 13 s and 0.5 m with 6 s"
    save(four_panels(runs, title=title, start=WINDOWS[3][0], end=WINDOWS[3][1]), "paper-e-scenario-3.png")
