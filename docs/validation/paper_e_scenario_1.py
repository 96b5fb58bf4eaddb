"""Paper E's quayside scenario 1: the 250 t crane, empty hook, a slow sine of about 30 m/min; NS, HS and SSC."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import causes
import xarray
from blocks import Blocks, save
from quay import CRANE, ROWS, WARM, Found, attributions, found, less

from stillhook.analysis.loop_stability.stability import eigenfrequency
from stillhook.report.plots.run import four_panels
from stillhook.thesis.quay import DURATIONS, MODES, PERIOD, WINDOWS, sine
from stillhook.units import in_display

SLOW_PAGE = True
DURATION = DURATIONS[1]
MARKED = 0.25  # share by which oscillations must fall to be called markedly reduced here


TIP = sine(PERIOD)
OWN = causes.variants(globals())


def three(row: causes.Variant) -> dict[str, Found]:
    return {m: found(row, TIP, m, DURATION) for m in MODES}


def span(f: Found, name: str, kind: str) -> float:
    """From the lowest to the highest value, as a picture shows it [display unit]."""
    values = f.run[name].sel(time=slice(WARM, None)).values
    return in_display(float(values.max() - values.min()), kind)


def claims(f: Mapping[str, Found]) -> dict[str, Any]:
    """Numbers of the claims."""
    ns, hs, ssc = (f[m] for m in MODES)

    def ranks(name: str, unit: str, digits: int) -> tuple[str, bool]:
        a, b, c = (float(getattr(x, name)) for x in (ns, hs, ssc))
        ours = (
            f"SSC {c:.{digits}f}, NS {a:.{digits}f}, HS {b:.{digits}f} {unit}: {less(c, a)} on NS, {less(c, b)} on HS"
        )
        return ours, c < (1.0 - MARKED) * a and c < (1.0 - MARKED) * b

    speed, speed_ok = ranks("v_w", "m/min", 2)
    pressure, pressure_ok = ranks("p_a", "bar", 1)
    error, _ = ranks("e_c_pp", "cm", 1)
    peak, _ = ranks("p_a_max", "bar", 0)
    in_p, in_v = hs.p_a / span(hs, "p_a", "pressure"), hs.v_w / span(hs, "v_w", "speed")
    pronounced = 1.0 - ssc.p_a_max / hs.p_a_max > 1.0 - ssc.p_a_max / ns.p_a_max
    return locals()


def compute() -> tuple[Blocks, dict[str, xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    base = three(OWN[0])
    said = claims(base)
    rings = ", ".join(
        f"{m.upper()} {1.0 / eigenfrequency(CRANE, alpha).period:.2f} Hz"
        for m, alpha in (("ns", CRANE.control.alpha_ns), ("hs", CRANE.control.alpha_hs), ("ssc", 1.0))
    )
    blocks = {
        **attributions(globals(), TIP, MODES, DURATION, (*OWN[1:], *ROWS)),
        "notes": causes.notes({m.upper(): f.run for m, f in base.items()}),
        "claims": said,
        "frequencies": {"rings": rings},
        "numbers": [{"m": m, "f": f} for m, f in base.items()],
        "sensitivity": [{"label": r.label, "all": [*three(r).values()]} for r in (*OWN, *ROWS)],
    }
    return blocks, {m.upper(): f.run for m, f in base.items()}


def draw(runs: Mapping[str, xarray.Dataset]) -> None:
    title = "nov-250t, empty hook, tip up to 30 m/min, 12 s"
    save(four_panels(runs, title=title, start=WINDOWS[1][0], end=WINDOWS[1][1]), "paper-e-scenario-1.png")
