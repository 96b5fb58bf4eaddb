"""A measured staircase of speeds on a test bench: an electro-hydraulic ram with gas springs, out and in at rising
speed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from blocks import HERE, Blocks, picture, save
from numpy.typing import NDArray

from stillhook.identify.curve import CurvePoint, FrictionCurve, draw_windows, friction_curve
from stillhook.identify.steady_state.steps import WindowSettings
from stillhook.logs.log import Log, mapping_from, read_log
from stillhook.report.plots.colours import COLOURS

PICTURE = "bench-staircase.png"
FILE = Path("bench_mbari") / "FrictionIDMovesWithBiasCurr.exp"

INCH, POUND, PSI = 0.0254, 4.4482216152605, 6.894757293168  # m, N, kPa: exact by definition, rounded to 13 digits
# Source of the areas and of the friction table: osrf/mbari_wec_gz, models/mbari_wec/model.sdf.em and
# src/PTOFriction/PTOFriction.cpp.
PISTON = 1.375 * INCH**2  # m^2
GAS_LOWER, GAS_UPPER = 0.0115, 0.0127  # m^2
TABLE_SPEED = (0.0, 0.01, 0.05, 0.1, 0.4)  # m/s
TABLE_OUT, TABLE_IN = (0.0, 550.0, 750.0, 1000.0, 2900.0), (0.0, 160.0, 400.0, 700.0, 1200.0)  # N
SETTINGS = WindowSettings(least_length="1 s")  # strokes of 1.8 m at 0.35 m/s hold their speed for 2 s
AREA_STEP = 0.01
SAME = 0.01  # speeds closer than this part are one step that was run twice


def _signal(column: str, unit: str, scale: float, quantity: str) -> dict[str, object]:
    return {"column": column, "unit": unit, "scale": scale, "quantity": quantity}


MAPPING = {
    "time": {"column": "time(s)", "unit": "s"},
    "position": _signal("Pos(in)", "m", INCH, "length"),
    "speed": _signal("Spd(in/s)", "m/s", INCH, "speed"),
    "effort": _signal("TestMachineForce(lbs)", "N", POUND, "force"),
    "p_a": _signal("LowerHydPress(psig)", "kPa", PSI, "pressure"),
    "p_b": _signal("UpperHydPress(psig)", "kPa", PSI, "pressure"),
    "gas_lower": _signal("LowerSpringPressure(psia)", "kPa", PSI, "pressure"),
    "gas_upper": _signal("UpperSpringPressure(psia)", "kPa", PSI, "pressure"),
}


class Results(NamedTuple):
    """The log and the friction curves of what the machine pushes, without the oil's force, and without the gas's as
    well."""

    log: Log
    whole: FrictionCurve
    oil_off: FrictionCurve
    gas_off: FrictionCurve


def file() -> Path:
    folder = os.environ.get("STILLHOOK_SHARED_DATA")
    return (Path(folder) if folder else HERE.parents[2] / "shared" / "data") / FILE


def at_hand() -> bool:
    return file().is_file()


def efforts(log: Log, piston: float = PISTON) -> dict[str, NDArray[np.float64]]:
    """Force of the machine, less the oil's on the piston, less the gas's [N]."""
    s = log.signals
    oil_off = s["effort"] - piston * (s["p_a"] - s["p_b"])
    return {
        "whole": s["effort"],
        "oil_off": oil_off,
        "gas_off": oil_off - (GAS_LOWER * s["gas_lower"] - GAS_UPPER * s["gas_upper"]),
    }


def curve(log: Log, effort: NDArray[np.float64]) -> FrictionCurve:
    return friction_curve(log, effort=effort, position="position", kinds={"effort": "force"}, settings=SETTINGS)


def run() -> Results:
    log = read_log(file(), mapping_from(MAPPING, "bench"))
    return Results(log, **{name: curve(log, effort) for name, effort in efforts(log).items()})


def published(v: float) -> float:
    """Half the difference of both directions in the table of the machine's makers [N]."""
    return 0.5 * float(np.interp(v, TABLE_SPEED, TABLE_OUT) + np.interp(v, TABLE_SPEED, TABLE_IN))


def _with(p: CurvePoint) -> str:
    return f"{p.friction:.0f} ± {p.estimate.half:.0f}"


def _friction(r: Results) -> Iterator[dict[str, Any]]:
    for a, b, c in zip(r.whole.points, r.oil_off.points, r.gas_off.points, strict=True):
        yield {"a": a, "b": b, "c": c, "theirs": published(c.speed)}


def _steps(r: Results) -> Iterator[tuple[str, ...]]:
    found = r.whole.steady
    alone = {u.start for u in r.whole.unpaired}
    used = [w for w in found.windows if w.start not in alone]
    for name, sign in (("out", 1), ("in", -1)):
        speeds = [abs(w.speed) for w in used if w.direction == sign]
        yield f"steady, used, {name}", str(len(speeds)), f"{min(speeds):.3f} to {max(speeds):.3f} m/s"
    yield (
        "steady, no partner",
        str(len(alone)),
        "; ".join(f"{abs(u.speed):.3f} m/s {_way(u.direction)}" for u in r.whole.unpaired),
    )
    fast = [x for x in found.rejected if abs(x.speed) > max(p.speed for p in r.whole.points) / 2.0]
    yield "rejected, fast", str(len(fast)), f"{fast[0].reason} (the first)"
    slow = [x for x in found.rejected if x not in fast]
    yield "rejected, creeping between strokes", str(len(slow)), f"{slow[0].reason} (the first)" if slow else ""


def _way(direction: int) -> str:
    return "out" if direction > 0 else "in"


def repeated(found: FrictionCurve) -> tuple[CurvePoint, CurvePoint]:
    """The step that was run twice."""
    return next(
        (a, b) for a, b in zip(found.points[:-1], found.points[1:], strict=True) if b.speed - a.speed < SAME * a.speed
    )


def _repeats(r: Results) -> Iterator[dict[str, Any]]:
    for name, found in (("force of the machine", r.whole), ("less the oil", r.oil_off), ("less the gas", r.gas_off)):
        a, b = repeated(found)
        yield {"name": name, "a": a, "b": b}


def compute() -> tuple[Blocks, Results]:
    """Blocks of the page, and what the picture is drawn from."""
    r = run()
    more = curve(r.log, efforts(r.log, PISTON * (1.0 + AREA_STEP))["gas_off"])
    changes = [(a.speed, b.friction / a.friction - 1.0) for a, b in zip(r.gas_off.points, more.points, strict=True)]
    blocks = {
        "steps": _steps(r),
        "friction": _friction(r),
        "loads": [list(row) for row in zip(r.whole.points, r.oil_off.points, r.gas_off.points, strict=True)],
        "repeats": _repeats(r),
        "area": [(f"{v:.3f}", f"−{-100.0 * c:.1f} %") for v, c in changes],
    }
    return blocks, r


def draw(r: Results) -> None:
    """Windows over the log, and the three friction curves beside the makers' table."""
    figure = picture(11.0, 11.0)
    grid = figure.add_gridspec(3, 1, height_ratios=(1.0, 1.0, 1.5))
    above = figure.add_subplot(grid[0])
    axes = (above, figure.add_subplot(grid[1], sharex=above))
    draw_windows(axes, r.log, "speed", "effort", r.whole.steady, unpaired=r.whole.unpaired)
    axes[1].set_ylabel("force of the machine [kN]")
    ax = figure.add_subplot(grid[2])
    names = ("force of the machine", "less the oil on the piston", "less the gas springs: friction of the ram")
    for found, name, colour in zip((r.whole, r.oil_off, r.gas_off), names, COLOURS, strict=False):
        v, F = [p.speed for p in found.points], [1e-3 * p.friction for p in found.points]
        half = [1e-3 * p.estimate.half for p in found.points]
        ax.errorbar(v, F, yerr=half, fmt="o-", color=colour, lw=1.0, ms=4.0, capsize=3.0, label=f"{name}, 95 %")
    speeds = np.linspace(0.02, 0.4, 50)
    ax.plot(
        speeds,
        [1e-3 * published(v) for v in speeds],
        color="black",
        ls="--",
        lw=1.0,
        label="friction table of the machine's makers",
    )
    ax.set_yscale("log")
    ax.set_yticks((0.5, 1.0, 2.0, 5.0, 10.0), ("0.5", "1", "2", "5", "10"))
    ax.set_xlim(0.0, 0.4)
    ax.set_xlabel("speed [m/s]")
    ax.set_ylabel("half the difference of\nboth directions [kN]")
    ax.grid(alpha=0.3, which="both")
    ax.legend(fontsize="small", loc="lower right")
    save(figure, PICTURE)
