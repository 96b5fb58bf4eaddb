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
from blocks import Blocks, Table, picture, save

from stillhook import Crane, Scenario, load_crane, simulate
from stillhook.analysis.loop_stability.stability import Eigenfrequency, eigenfrequency
from stillhook.library import changed
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.spec.crane import wire_inertia
from stillhook.spec.scenario import Operator
from stillhook.thesis.ringing import Ringing, ringing
from stillhook.units import from_display, in_display

PICTURE = "paper-c-oscillation.png"
CC, BAR = from_display(1.0, "displacement"), from_display(1.0, "pressure")
D_MAX = 3000.0  # cm^3/rev: 12 motors of 250
THEIRS: Mapping[int, tuple[float, str]] = {
    2940: (0.4, "no"),
    2500: (0.4, "no"),
    1600: (0.7, "yes"),
    735: (1.5, "yes"),
}  # table 1
ROUNDING = 0.05  # s: the periods are printed in tenths
SEEN = 0.05  # share of the speed: a swing that shows in a picture of the speed
START = 2.0  # s: the stick begins to move
SPEED = 15.0  # m/min
RAMP, THROWN = 1.0, 0.2  # s: as the page's base; so short that everything after it rings freely
LEAST = 0.3 * BAR
BASE = load_crane("nov-100t-pure-active")
V_PER_D = load_crane("nov-250t").active.line.V / load_crane("nov-250t").active.motor.D_total


def constant() -> tuple[float, float]:
    """Period times displacement [s cm^3/rev]: the least and the most that all four printed periods allow."""
    return max((T - ROUNDING) * D for D, (T, _) in THEIRS.items()), min(
        (T + ROUNDING) * D for D, (T, _) in THEIRS.items()
    )


def build() -> Crane:
    """A winch with twelve motors of 250 cm^3/rev in one closed circuit, whose eigenperiod is what the printed periods
    ask for."""
    line = BASE.active.line
    C_h = V_PER_D * D_MAX * CC / line.bulk_modulus
    J = (sum(constant()) / 2.0 * CC / (2.0 * math.pi)) ** 2 / C_h
    J_gear, J_motors = 12 * 0.05, 12 * 0.0559  # as the other cranes' gears; rotors as the library's A6VM280
    J_drum = (J - J_gear - J_motors) * BASE.i_hD**2 - wire_inertia(BASE.drum, BASE.wire)
    own = {
        "name": "twelve-motors",
        "title": "Twelve motors of 250 cm^3/rev in one closed circuit, paper C table 1",
        "SWL": "165 t",
        "active": {
            "motor": {
                "type": "A6VM280",
                "D_max": "250 cm^3/rev",
                "count": 12,
                "alpha_min": 0.2,
                "C_1": "0.04 L/min/bar",
                "C_2": "1e-5 L/min/bar/(rev/min)",
            },
            "pump": {"D": ["500 cm^3/rev"] * 3},
            "line": {"V": f"{C_h * line.bulk_modulus!r} m^3"},
            "C_leak": "0.74 L/min/bar",
        },
        "friction": {"library": "crane-2"},
        "inertia": {"J_m_eff": f"{J!r} kg m^2", "J_gear": f"{J_gear!r} kg m^2", "J_drum": f"{J_drum!r} kg m^2"},
        "control": {"alpha_ns": 1.0, "alpha_hs": 0.6},
    }
    return changed(BASE, own).model_copy(
        update={"brake": None}
    )  # the quay tests begin from a winch that its circuits hold


CRANE = build()


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


def ramp(crane: Crane, D: int, row: Row) -> xarray.Dataset:
    """The winch ramped up at a fixed displacement D [cm^3/rev]."""
    return simulate(crane, ramped(D, row), every="0.01 s")


def ramped(D: int, row: Row) -> Scenario:
    profile = ((f"{START:g} s", "0 m/min"), (f"{START + row.ramp:g} s", f"{row.speed:g} m/min"))
    stick = Operator(profile=profile, alpha_m=D / D_MAX)
    return Scenario(
        load=f"{row.load:g} t",
        s_w="15 m",
        mode="manual",
        operator=stick,
        duration=f"{row.ramp + 22:g} s",
        warm_up="1 s",
    )


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


def swing(run: xarray.Dataset, end: float) -> float:
    """Overshoot of the wire speed over its final value [-]."""
    v = run["v_w"].values
    final = float(np.mean(v[run["time"].values > end]))
    return float(np.max(v)) / final - 1.0


def found(row: Row) -> dict[int, Found]:
    crane = changed(CRANE, row.changes) if row.changes else CRANE
    out = {}
    for D in THEIRS:
        run, thrown = ramp(crane, D, row), ramp(crane, D, row._replace(ramp=THROWN))
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
        f"{how} {D}": ramped(D, r) for D in THEIRS for how, r in (("ramp", row), ("thrown", row._replace(ramp=THROWN)))
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
    """A-side pressure and wire speed at each displacement: paper C figures 5 and 6."""
    figure = picture(10.0, 7.5)
    axes = figure.subplots(2, 1, sharex=True)
    for (D, run), colour in zip(runs.items(), COLOURS, strict=False):
        cut = run.sel(time=slice(START - 0.5, START + 8.0))
        t = cut["time"] - START
        axes[0].plot(
            t, [in_display(p, "pressure") for p in cut["p_a"].values], color=colour, lw=1.3, label=f"{D} cm³/rev"
        )
        axes[1].plot(t, [in_display(v, "speed") for v in cut["v_w"].values], color=colour, lw=1.3)
    wanted = [in_display(v, "speed") for v in cut["v_op"].values]
    axes[1].plot(t, wanted, color=GREY, ls="--", lw=1, label="asked for")
    axes[0].set_ylabel("A-side pressure [bar]")
    axes[1].set_ylabel("wire speed [m/min]\n(hoisting positive)")
    axes[1].set_xlabel("time after the stick moves [s]")
    axes[0].legend(ncols=4, loc="upper right", frameon=False)
    axes[1].legend(loc="lower right", frameon=False)
    for ax in axes:
        ax.grid(alpha=0.3)
    figure.suptitle("Twelve motors, empty hook, stick over in 1 s: as paper C figures 5 and 6", fontsize="medium")
    save(figure, PICTURE)
