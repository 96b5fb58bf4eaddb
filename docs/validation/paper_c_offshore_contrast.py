"""Paper C's measurement offshore: a 165 t crane with a light hook in AHC, its three active motors at 162 and at 245
cm^3/rev."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import causes
import numpy as np
import xarray
from blocks import Blocks, percent, picture, save

from stillhook import Crane, Scenario, Sine, load_crane, simulate
from stillhook.analysis.loop_stability.stability import eigenfrequency
from stillhook.library import changed
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.sea.motion.motion import Motion, Sum
from stillhook.spec.crane import wire_inertia
from stillhook.thesis.ringing import rms_above
from stillhook.units import in_display

PICTURE = "paper-c-offshore-contrast.png"
D_ONE = 250.0  # cm^3/rev, one motor
LOW, HIGH = 162, 245  # cm^3/rev each, figures 7 and 8
MODE_OF = {LOW: "hs", HIGH: "ns"}  # the two fixed settings of the classic controller
RING = 0.5  # Hz: above the waves (0.08 and 0.17 Hz), below the circuit's eigenfrequency at either displacement
WARM = 30.0  # s
BEAT = 78.0  # s: 6 periods of 13 s, 13 of 6 s
BASE = load_crane("nov-150t")
MORE = 0.25  # share by which oscillations must differ to be called significant here


def build() -> Crane:
    """The 150 t crane of the same paper with three active motors of 250 cm^3/rev, and as many more passive ones."""
    motor = {"type": "A6VM280", "D_max": "250 cm^3/rev", "C_1": "0.04 L/min/bar", "C_2": "1e-5 L/min/bar/(rev/min)"}
    J = BASE.inertia.J_m_eff * 12 / 11  # one passive motor more
    J_gear, J_motors = 12 * 0.05, 12 * 0.0559  # as the other cranes' gears; rotors as the library's A6VM280
    J_drum = (J - J_gear - J_motors) * BASE.i_hD**2 - wire_inertia(BASE.drum, BASE.wire)
    own = {
        "name": "165t",
        "title": "165 t active/passive winch of paper C figures 7 and 8",
        "SWL": "165 t",
        "active": {"motor": motor | {"alpha_min": 0.6}, "line": {"V": f"{50.0 * 750.0 / 645.0!r} L"}},
        "passive": {"motor": motor | {"count": 9}},
        "inertia": {"J_m_eff": f"{J!r} kg m^2", "J_gear": f"{J_gear!r} kg m^2", "J_drum": f"{J_drum!r} kg m^2"},
        "control": {"alpha_hs": LOW / D_ONE, "alpha_ns": HIGH / D_ONE},
    }
    return changed(BASE, own)


CRANE = build()


def sea(scale: float = 1.0) -> Motion:
    """The pattern of paper E scenario 3, two fifths of its size: up to 36 m/min."""
    return Sum([Sine.from_si(0.8 * scale, 13.0), Sine.from_si(0.2 * scale, 6.0)])


class Row(NamedTuple):
    """One variant: what is changed in the crane, the tip's motion, and the rest of the scenario."""

    label: str
    changes: Mapping[str, Any] = {}
    tip: Motion | None = None
    more: Mapping[str, str] = {}


NO_LEAK = {"active": {"motor": {"C_1": "0 L/min/bar", "C_2": "0 L/min/bar/(rev/min)"}, "pump": {"leak_scale": 0.01}}}
HELD = {
    "active": {
        "flushing": {"dp_open": "0 bar", "conductance": "240 L/min/bar"},
        "boost": {"conductance": "240 L/min/bar"},
    }
}
ROWS = (
    Row("**as above**"),
    Row("a quarter of the motion, up to 9 m/min", tip=sea(0.25)),
    Row("half the motion, up to 18 m/min", tip=sea(0.5)),
    Row("1.5 times the motion, up to 54 m/min", tip=sea(1.5)),
    Row("one sine, 0.8 m and 8 s", tip=Sine(amplitude="0.8 m", period="8 s")),
    Row("20 t on the hook", more={"load": "17 t"}),
    Row("1500 m of wire out; HS and NS follow the layer", more={"s_w": "1500 m"}),
    Row("friction of crane 1", {"friction": {"library": "crane-1"}}),
    Row("friction of L4593, the largest set", {"friction": {"library": "L4593"}}),
    Row("twice the oil volume", {"active": {"line": {"V": f"{100.0 * 750.0 / 645.0!r} L"}}}),
    Row("inertia ×1.5", causes.heavier(CRANE, 1.5)),
    Row("hardly any leakage", NO_LEAK),
    Row("low side held: valves without dead band, four times as wide", HELD),
    Row("pumps of 500 + 250 cm³/rev", {"active": {"pump": {"D": ["500 cm^3/rev", "250 cm^3/rev"]}}}),
    Row("`K_p` 0.32 1/m instead of 0.16", {"control": {"K_p": "0.32 1/m"}}),
    Row("`K_2` 0", {"control": {"K_2": "0 s^2/m"}}),
)


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


def case(row: Row, D: int, beats: float = 2.0) -> Scenario:
    asked: dict[str, Any] = {
        "load": "1 t",
        "s_w": "100 m",
        "warm_up": f"{WARM:g} s",
        "duration": f"{WARM + beats * BEAT:g} s",
        **row.more,
    }
    return Scenario(tip=row.tip or sea(), mode=MODE_OF[D], **asked)


def error_of_speed(run: xarray.Dataset) -> Any:
    """Wire speed plus tip speed after the warm-up [m/s]."""
    return (run["v_w"] + run["v_tip"]).sel(time=slice(WARM, None)).values


def found(row: Row, D: int) -> Found:
    crane = changed(CRANE, row.changes) if row.changes else CRANE
    run = simulate(crane, case(row, D), every="0.01 s")
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
    figures = [
        causes.Figure(
            label,
            lambda r, n=name: 100.0 * (r["low"][n] / r["high"][n] - 1.0),
            100.0 * MORE,
            unit="%",
            digits=0,
            printed=printed,
        )
        for name, label, printed in (
            ("p_a", "`p_a` above 0.5 Hz, low over high", "significantly: 25 at least"),
            ("p_b", "`p_b` above 0.5 Hz", "the same"),
            ("off", "error of speed", "affected: 25 at least"),
        )
    ]
    rows = [causes.varied(r.label, r.changes, tip=r.tip, more=r.more, group="tip" if r.tip else "") for r in ROWS[1:]]
    runs = {"low": (CRANE, case(ROWS[0], LOW, 1.0)), "high": (CRANE, case(ROWS[0], HIGH, 1.0))}
    return causes.attribute(runs, figures, rows, pairs=False, evaluate=causes.from_series(oscillation, "0.02 s"))


def variant(row: Row) -> tuple[object, ...]:
    low, high = found(row, LOW), found(row, HIGH)
    pairs = ((low.p_a, high.p_a, 1), (low.v_w, high.v_w, 2), (low.off, high.off, 2))
    cells = [f"{a:.{n}f} / {b:.{n}f} ({percent(a / b - 1.0, sign=True)})" for a, b, n in pairs]
    return (row.label, *cells, f"{low.p_max:.0f} / {high.p_max:.0f}")


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
        "sensitivity": [variant(r) for r in ROWS],
    }
    return blocks, {D: f.run for D, f in both.items()}


def draw(runs: Mapping[int, xarray.Dataset]) -> None:
    """Wanted and actual wire speed, pressures of both sides, at either displacement: paper C figures 7 and 8."""
    figure = picture(10.0, 7.0)
    axes = figure.subplots(2, 2, sharex=True, sharey="row")
    for column, (D, run) in enumerate(runs.items()):
        cut = run.sel(time=slice(60.0, 90.0))
        t, upper, lower = cut["time"], axes[0][column], axes[1][column]
        upper.plot(
            t,
            [in_display(-v, "speed") for v in cut["v_tip"].values],
            color=GREY,
            ls="--",
            lw=1,
            label="wanted: tip, turned over",
        )
        upper.plot(t, [in_display(v, "speed") for v in cut["v_w"].values], color=COLOURS[0], lw=1.2, label="wire")
        for name, colour in (("p_a", COLOURS[0]), ("p_b", COLOURS[1])):
            lower.plot(
                t,
                [in_display(p, "pressure") for p in cut[name].values],
                color=colour,
                lw=1.2,
                label=f"{name[-1].upper()} side",
            )
        upper.set_title(f"{D} cm³/rev each", fontsize="medium")
        lower.set_xlabel("time [s]")
        for ax in (upper, lower):
            ax.grid(alpha=0.3)
    axes[0][0].set_ylabel("wire speed [m/min]\n(hoisting positive)")
    axes[1][0].set_ylabel("pressure [bar]")
    for row, top in ((0, 45.0), (1, 190.0)):
        axes[row][0].set_ylim(top=top)
        axes[row][0].legend(loc="upper right", ncols=2, fontsize="small")
    figure.suptitle(
        "165 t crane, 4 t on the wire, AHC at two fixed displacements: as paper C figures 7 and 8", fontsize="medium"
    )
    save(figure, PICTURE)
