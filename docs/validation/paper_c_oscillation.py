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
from blocks import Blocks, Table, save

from stillhook import Scenario, simulate
from stillhook.analysis.loop_stability.stability import Eigenfrequency, eigenfrequency
from stillhook.library import changed
from stillhook.thesis.oscillation import (
    D_MAX,
    LEAST,
    RAMP,
    ROUNDING,
    SEEN,
    SPEED,
    START,
    THEIRS,
    constant,
    ramp,
    ramped,
    swing,
    twelve_motors,
)
from stillhook.thesis.ringing import Ringing, ringing
from stillhook.units import in_display

PICTURE = "paper-c-oscillation.png"
THROWN = 0.2  # s: the stick thrown over
CRANE = twelve_motors()


class Row(NamedTuple):
    """One variant: what is changed in the crane; time in which the stick goes over [s]; speed [m/min]; load [t]."""

    label: str
    changes: Mapping[str, Any] = {}
    ramp: float = RAMP
    speed: float = SPEED
    load: float = 0.0


def oil(part: float) -> dict[str, Any]:
    return {"active": {"line": {"V": f"{part * CRANE.active.line.V!r} m^3"}}}


def low_side(dp_open: str, conductance: str = "60 L/min/bar") -> dict[str, Any]:
    return {
        "active": {"flushing": {"dp_open": dp_open, "conductance": conductance}, "boost": {"conductance": conductance}}
    }


HELD = low_side("0 bar", "600 L/min/bar")
NO_LEAK = {"active": {"motor": {"C_1": "0 L/min/bar", "C_2": "0 L/min/bar/(rev/min)"}, "pump": {"leak_scale": 0.01}}}
LEAKY = {"active": {"motor": {"C_1": "0.08 L/min/bar", "C_2": "2e-5 L/min/bar/(rev/min)"}, "pump": {"leak_scale": 2.0}}}
ROWS = (
    Row("**as above**"),
    Row("stick over in 0.2 s", ramp=THROWN),
    Row("stick over in 0.5 s", ramp=0.5),
    Row("stick over in 2 s", ramp=2.0),
    Row("stick over in 5 s", ramp=5.0),
    Row("30 m/min", speed=30.0),
    Row("20 t on the hook", load=20.0),
    Row("inertia ×1.5", causes.heavier(CRANE, 1.5)),
    Row("twice the oil volume", oil(2.0)),
    Row("inertia ×1.5, oil /1.5: the same linear periods", causes.heavier(CRANE, 1.5) | oil(1.0 / 1.5)),
    Row("bulk modulus 14 000 bar", {"active": {"line": {"bulk_modulus": "14000 bar"}}}),
    Row("leakage doubled", LEAKY),
    Row("hardly any leakage", NO_LEAK),
    Row("friction of crane 1", {"friction": {"library": "crane-1"}}),
    Row("friction of L4593, the largest set", {"friction": {"library": "L4593"}}),
    Row(
        "motors without turbulent loss (`X_2` 0)",
        {"active": {"motor": {"loss": {"X_2": "0 N m s^2/rad^2/(m^3/rad)^3"}}}},
    ),
    Row("low side held: valves without dead band, ten times as wide", HELD),
    Row("low side held, hardly any leakage", {"active": HELD["active"] | NO_LEAK["active"]}),
    Row("low side freer: flushing opens 10 bar above boost", low_side("10 bar")),
)


def of_row(D: int, row: Row) -> Scenario:
    """The row's ramp at a fixed displacement D [cm^3/rev]."""
    return ramped(D, ramp=row.ramp, speed=row.speed, load=row.load)


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


def found(row: Row) -> dict[int, Found]:
    crane = changed(CRANE, row.changes) if row.changes else CRANE
    out = {}
    for D in THEIRS:
        run, thrown = (simulate(crane, of_row(D, r), every="0.01 s") for r in (row, row._replace(ramp=THROWN)))
        end = float(run["time"][-1])
        v, t, asked = run["v_w"].values, run["time"].values, row.speed / 60.0
        out[D] = Found(
            run=run,
            ring=ringing(run, "p_a", start=START, least=LEAST),
            thrown=ringing(thrown, "p_a", start=START, least=LEAST, free=START + THROWN),
            swing=swing(run, end - 2.0),
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


def effects(all_: Mapping[int, Found]) -> list[dict[str, Any]]:
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


def both(row: Row) -> dict[str, Scenario]:
    """The ramp at every displacement, and the same thrown over."""
    return {
        f"{how} {D}": of_row(D, r) for D in THEIRS for how, r in (("ramp", row), ("thrown", row._replace(ramp=THROWN)))
    }


def read(run: xarray.Dataset) -> dict[str, float]:
    """Period of the first swing [s], decay after a stick thrown over [1/s], swing of the speed [-]."""
    end = float(run["time"][-1])
    return {
        "period": ringing(run, "p_a", start=START, least=LEAST).period,
        "decay": ringing(run, "p_a", start=START, least=LEAST, free=START + THROWN).decay,
        "swing": swing(run, end - 2.0),
    }


def alternative(row: Row) -> causes.Alternative:
    """A row as a setting that may be otherwise."""
    if (row.ramp, row.speed, row.load) == (RAMP, SPEED, 0.0):
        return causes.varied(
            row.label, row.changes, group=next((g for g in ("friction", "low side", "leakage") if g in row.label), "")
        )
    return causes.Alternative(
        row.label, lambda runs: {name: (runs[name][0], case) for name, case in both(row).items()}, "operator"
    )


def attribution() -> causes.Attribution:
    """What the printed figures depend on, one change at a time."""
    figures = [
        causes.Figure(
            f"period at {D}", lambda r, D=D: r[f"ramp {D}"]["period"], T - ROUNDING, T + ROUNDING, "s", 2, f"{T:.1f}"
        )
        for D, (T, _) in THEIRS.items()
    ]
    figures += [
        causes.Figure(
            f"swing at {D}",
            lambda r, D=D: 100.0 * r[f"ramp {D}"]["swing"],
            100.0 * SEEN if seen == "yes" else -math.inf,
            math.inf if seen == "yes" else 100.0 * SEEN,
            "%",
            0,
            f"effect: {seen}",
        )
        for D, (_, seen) in THEIRS.items()
    ]
    large, small = max(THEIRS), min(THEIRS)
    ratio = causes.Figure(
        f"decay, {large} over {small}",
        lambda r: r[f"thrown {large}"]["decay"] / r[f"thrown {small}"]["decay"],
        1.0,
        printed="falls: above 1",
    )
    runs = {name: (CRANE, case) for name, case in both(ROWS[0]).items()}
    evaluate = causes.from_series(read, "0.01 s")
    return causes.attribute(runs, [*figures, ratio], [alternative(r) for r in ROWS[1:]], pairs=False, evaluate=evaluate)


def variant(row: Row) -> tuple[object, ...]:
    f = found(row)
    return (
        row.label,
        *(f"{f[D].linear.period:.2f} / {f[D].ring.period:.2f}" for D in THEIRS),
        seconds([f[D].thrown.decay for D in THEIRS], 1),
        ", ".join(f"{100.0 * f[D].swing:.0f}" for D in THEIRS),
    )


def compute() -> tuple[Blocks, dict[int, xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    base = found(ROWS[0])
    said = claims(base)
    least, most = constant()
    wide = ("variant", *(f"{D}: linear / full, s" for D in THEIRS), "decay, 1/s", "swing of the speed, %")
    inertia, line = CRANE.inertia, CRANE.active.line
    blocks = {
        "causes": causes.block(attribution()),
        "notes": causes.notes({f"{D} cm³/rev": f.run for D, f in base.items()}),
        "claims": said,
        "constant": ({"inertia": inertia, "least": least, "line": line, "most": most}),
        "periods": periods(base),
        "effects": effects(base),
        "sensitivity": Table(wide, [variant(r) for r in ROWS]),
    }
    return blocks, {D: f.run for D, f in base.items()}


def draw(runs: Mapping[int, xarray.Dataset]) -> None:
    save(ramp("p_a", "v_w", runs=runs).figure(), PICTURE)
