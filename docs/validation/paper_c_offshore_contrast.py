"""Paper C's measurement offshore: a 165 t crane with a light hook in AHC, its three active motors at 162 and at 245
cm^3/rev."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import causes
import numpy as np
import xarray
from blocks import Blocks, save

from stillhook import Scenario, simulate
from stillhook.analysis.loop_stability.stability import eigenfrequency
from stillhook.thesis.gallery import Drawing
from stillhook.thesis.oscillation import (
    D_ONE,
    HIGH,
    LOW,
    RING,
    WARM,
    contrast_panels,
    of_165t,
    offshore,
    sea,  # noqa: F401  # of the variants
)
from stillhook.thesis.ringing import rms_above
from stillhook.units import in_display

PICTURE = "paper-c-offshore-contrast.png"
CRANE = of_165t()
MORE = 0.25  # share by which oscillations must differ to be called significant here


ROWS = causes.variants(globals())


class Found(NamedTuple):
    """One run and its oscillations: pressures [bar], speeds [m/min], control error [cm]."""

    run: xarray.Dataset
    p_a: float
    p_b: float
    v_w: float
    off: float
    worst: float
    p_max: float
    e_c_pp: float


def case(row: causes.Variant, D: int, beats: float = 2.0) -> Scenario:
    return offshore(D, row.tip, beats, row.more)


def error_of_speed(run: xarray.Dataset) -> Any:
    """Wire speed plus tip speed after the warm-up [m/s]."""
    return (run["v_w"] + run["v_tip"]).sel(time=slice(WARM, None)).values


def found(row: causes.Variant, D: int) -> Found:
    run = simulate(row.on(CRANE), case(row, D), every="0.01 s")
    off = error_of_speed(run)
    return Found(
        run=run,
        p_a=in_display(rms_above(run, "p_a", frequency=RING, start=WARM), "pressure"),
        p_b=in_display(rms_above(run, "p_b", frequency=RING, start=WARM), "pressure"),
        v_w=in_display(rms_above(run, "v_w", frequency=RING, start=WARM), "speed"),
        off=in_display(float(np.sqrt(np.mean(off**2))), "speed"),
        worst=in_display(float(np.max(np.abs(off))), "speed"),
        p_max=in_display(float(run["p_max"]), "pressure"),
        e_c_pp=100.0 * float(run["e_c_pp"]),
    )


def claims(low: Found, high: Found) -> dict[str, Any]:
    """Numbers of the claims."""
    period = {D: eigenfrequency(CRANE, D / D_ONE).period for D in (LOW, HIGH)}
    return locals()


def oscillation(run: xarray.Dataset) -> dict[str, float]:
    """Oscillations of a run that the claims are about, rms [Pa, m/s]."""
    rms = {name: rms_above(run, name, frequency=RING, start=WARM) for name in ("p_a", "p_b")}
    return rms | {"off": float(np.sqrt(np.mean(error_of_speed(run) ** 2)))}


def attribution() -> causes.Attribution:
    """What the contrast depends on; one beat of the sea."""
    runs = {"low": (CRANE, case(ROWS[0], LOW, 1.0)), "high": (CRANE, case(ROWS[0], HIGH, 1.0))}
    tried, evaluate = [row.alternative() for row in ROWS[1:]], causes.from_series(oscillation, "0.02 s")
    return causes.attribute(runs, causes.figures(globals()), tried, pairs=False, evaluate=evaluate)


def compute() -> tuple[Blocks, dict[int, xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    both = {D: found(ROWS[0], D) for D in (LOW, HIGH)}
    said = claims(both[LOW], both[HIGH])
    numbers = [{"D": D, "f": f} for D, f in both.items()]
    blocks = {
        "causes": causes.block(attribution()),
        "notes": causes.notes({f"{D} cm³/rev": f.run for D, f in both.items()}),
        "claims": said,
        "numbers": numbers,
        "sensitivity": [{"label": r.label, "all": [found(r, LOW), found(r, HIGH)]} for r in ROWS],
    }
    return blocks, {D: f.run for D, f in both.items()}


def draw(runs: Mapping[int, xarray.Dataset]) -> None:
    """Wanted and actual wire speed, pressures of both sides, at either displacement: paper C figures 7 and 8."""
    panels = [p for D, run in runs.items() for p in contrast_panels(D, run)]
    save(
        Drawing("165 t crane, 4 t on the wire, AHC at two fixed displacements", panels[::2] + panels[1::2]).figure(),
        PICTURE,
    )
