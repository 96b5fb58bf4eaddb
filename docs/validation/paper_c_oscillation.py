"""Paper C's ramps at four fixed motor displacements: period and damping of the A-side pressure, effect on the winch's
speed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import causes
import numpy as np
import xarray
from blocks import Blocks, save

from stillhook import Scenario, simulate
from stillhook.analysis.loop_stability.stability import Eigenfrequency, eigenfrequency
from stillhook.thesis import oscillation
from stillhook.thesis.oscillation import D_MAX, LEAST, RAMP, ROUNDING, SEEN, SPEED, START, THEIRS
from stillhook.thesis.ringing import Ringing, ringing
from stillhook.units import in_display

PICTURE = "paper-c-oscillation.png"
THROWN = 0.2  # s: the stick thrown over
CRANE = oscillation.twelve_motors()


ROWS = causes.variants(globals())


def of_row(D: int, row: causes.Variant, thrown: bool = False) -> Scenario:
    """The row's ramp at a fixed displacement D [cm^3/rev], or the same thrown over."""
    more = {"ramp": THROWN} if thrown else {}
    return oscillation.ramped(D, **({"ramp": RAMP, "speed": SPEED, "load": 0.0} | row.own | more))


class Found(NamedTuple):
    """What one displacement does: the ramp, the same thrown over; the ringing of both; swing of the speed after the
    ramp over the speed [-]; time from the stick's start until the winch moves [s]; speed lost to leakage [-]; the
    linear model's
    answer."""

    run: xarray.Dataset
    ring: Ringing
    thrown: Ringing
    swing: float
    late: float
    lost: float
    linear: Eigenfrequency


def found(row: causes.Variant) -> dict[int, Found]:
    crane, out = row.on(CRANE), {}
    for D in THEIRS:
        run, thrown = (simulate(crane, of_row(D, row, hard), every="0.01 s") for hard in (False, True))
        end = float(run["time"][-1])
        v, t, asked = run["v_w"].values, run["time"].values, row.own.get("speed", SPEED) / 60.0
        out[D] = Found(
            run=run,
            ring=ringing(run, "p_a", start=START, least=LEAST),
            thrown=ringing(thrown, "p_a", start=START, least=LEAST, free=START + THROWN),
            swing=oscillation.swing(run, end - 2.0),
            late=float(t[np.argmax(v > 0.02 * asked)]) - START,
            lost=1.0 - float(np.mean(v[t > end - 2.0])) / asked,
            linear=eigenfrequency(crane, D / D_MAX),
        )
    return out


def seconds(values: Sequence[float], digits: int = 2) -> str:
    return ", ".join("–" if math.isnan(x) else f"{x:.{digits}f}" for x in values)


def as_printed(periods: Mapping[int, float]) -> list[bool]:
    """Whether each period is one that rounds to the printed tenth."""
    return [abs(T - THEIRS[D][0]) <= ROUNDING for D, T in periods.items()]


def periods(all_: Mapping[int, Found]) -> list[dict[str, Any]]:
    return [{"D": D, "f": f} for D, f in all_.items()]


def claims(all_: Mapping[int, Found]) -> dict[str, Any]:
    """Numbers of the claims."""
    linear, twin = (
        {D: period(f) for D, f in all_.items()} for period in (lambda f: f.linear.period, lambda f: f.ring.period)
    )
    ok = as_printed(twin)
    off = max(abs(T - THEIRS[D][0]) for D, T in twin.items())
    decay = [f.thrown.decay for f in all_.values()]
    zeta = [f.thrown.zeta for f in all_.values()]
    linear_decay = [f.linear.zeta * f.linear.omega_0 for f in all_.values()]
    peak = [in_display(float(f.run["p_a_max"]), "pressure") for f in all_.values()]
    late, lost = [f.late for f in all_.values()], [100.0 * f.lost for f in all_.values()]
    effect = ["yes" if f.swing > SEEN else "no" for f in all_.values()]
    return locals()


def _falls(values: Sequence[float]) -> bool:
    """Whether each value is below the one before: displacements are listed from large to small."""
    return all(b < a for a, b in pairwise(values))


def both(row: causes.Variant) -> dict[str, Scenario]:
    """The ramp at every displacement, and the same thrown over."""
    return {f"{how} {D}": of_row(D, row, how == "thrown") for D in THEIRS for how in ("ramp", "thrown")}


def read(run: xarray.Dataset) -> dict[str, float]:
    """Period of the first swing [s], decay after a stick thrown over [1/s], swing of the speed [-]."""
    end = float(run["time"][-1])
    return {
        "period": ringing(run, "p_a", start=START, least=LEAST).period,
        "decay": ringing(run, "p_a", start=START, least=LEAST, free=START + THROWN).decay,
        "swing": oscillation.swing(run, end - 2.0),
    }


def alternative(row: causes.Variant) -> causes.Alternative:
    """A row as a setting that may be otherwise."""
    if not row.own:
        return row.alternative()
    return causes.Alternative(
        row.label, lambda runs: {name: (runs[name][0], case) for name, case in both(row).items()}, "operator"
    )


def attribution() -> causes.Attribution:
    """What the printed figures depend on, one change at a time."""
    runs = {name: (CRANE, case) for name, case in both(ROWS[0]).items()}
    tried, evaluate = [alternative(row) for row in ROWS[1:]], causes.from_series(read, "0.01 s")
    return causes.attribute(runs, causes.figures(globals()), tried, pairs=False, evaluate=evaluate)


def compute() -> tuple[Blocks, dict[int, xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    base = found(ROWS[0])
    said = claims(base)
    least, most = oscillation.constant()
    inertia, line = CRANE.inertia, CRANE.active.line
    blocks = {
        "causes": causes.block(attribution()),
        "notes": causes.notes({f"{D} cm³/rev": f.run for D, f in base.items()}),
        "claims": said,
        "constant": ({"inertia": inertia, "least": least, "line": line, "most": most}),
        "periods": periods(base),
        "effects": periods(base),
        "sensitivity": [{"label": row.label, "f": found(row)} for row in ROWS],
    }
    return blocks, {D: f.run for D, f in base.items()}


def draw(runs: Mapping[int, xarray.Dataset]) -> None:
    save(oscillation.ramp("p_a", "v_w", runs=runs).figure(), PICTURE)
