"""Paper E's tests at the quay: 250 t crane, empty hook, 15 m of wire, a simulated tip. What is run, what is changed,
what is read off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import causes
import xarray
from blocks import percent

from stillhook.sea.motion.motion import Motion
from stillhook.thesis.quay import CRANE, WARM, case, run
from stillhook.thesis.ringing import rms_above
from stillhook.units import in_display

RING = 0.5  # Hz: above the waves (up to 0.17 Hz), below the circuit's eigenfrequency in any mode (1 to 2 Hz)
ROWS = causes.variants(globals())


class Found(NamedTuple):
    """What one controller does: oscillation above 0.5 Hz of speed [m/min] and A-side pressure [bar] (rms), error
    peak-to-peak [cm], highest A-side pressure [bar], largest pump and smallest motor displacement [-]."""

    run: xarray.Dataset
    v_w: float
    p_a: float
    e_c_pp: float
    p_a_max: float
    alpha_p: float
    alpha_m: float


def found(row: causes.Variant, tip: Motion, mode: str, duration: float) -> Found:
    one = run(row.on(CRANE, mode), case(row.tip or tip, mode, duration, row.more))
    return Found(
        run=one,
        v_w=in_display(rms_above(one, "v_w", frequency=RING, start=WARM), "speed"),
        p_a=in_display(rms_above(one, "p_a", frequency=RING, start=WARM), "pressure"),
        e_c_pp=100.0 * float(one["e_c_pp"]),
        p_a_max=in_display(float(one["p_a_max"]), "pressure"),
        alpha_p=float(one["alpha_p_max"]),
        alpha_m=float(one["alpha_m_min"]),
    )


def _oscillation(one: xarray.Dataset) -> dict[str, float]:
    return {name: rms_above(one, name, frequency=RING, start=WARM) for name in ("v_w", "p_a")}


def attributions(
    names: Mapping[str, Any], tip: Motion, modes: Sequence[str], duration: float, rows: Sequence[causes.Variant]
) -> dict[str, str]:
    """Rankings of a scenario's page: pressure and error; oscillation above 0.5 Hz of speed and pressure, rms [m/s,
    Pa]."""
    runs, tried = {m: (CRANE, case(tip, m, duration)) for m in modes}, [row.alternative() for row in rows]
    series = causes.from_series(_oscillation, "0.02 s")
    first = causes.attribute(runs, causes.figures(names), tried)
    second = causes.attribute(runs, causes.figures(names, "oscillation_figure"), tried, pairs=False, evaluate=series)
    rule = "The same for the oscillations, one change at a time."
    return {"causes": causes.block(first), "causes-oscillation": causes.block(second, rule)}


def less(new: float, old: float) -> str:
    """The new one against the old one: −25 %."""
    return percent(new / old - 1.0, sign=True)
