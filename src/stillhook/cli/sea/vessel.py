"""`stillhook vessel`: what a vessel file holds, and whether it moves as floating bodies do."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import Json, Out, check_out, present, refuse
from stillhook.report.formatting import argument, wrapped
from stillhook.report.terminal import Answer, Cells, Line, print_table
from stillhook.units import number

if TYPE_CHECKING:
    from stillhook.sea.vessel.floating_body import LongWave
    from stillhook.sea.vessel.rao import Rao

PERIODS = (4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 20.0)  # s: rows of the table that is printed
SIDES = (0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0)  # deg: its columns
OUT_FILES = ("vessel.png", "vessel.json")
VESSEL_HELP = (
    "Name of the library, or a file: ShipX/VERES .re1, CSV with declared conventions, Capytaine NetCDF, OrcaFlex text"
    " (.yml), AQWA .lis, WAMIT .4, HydroStar .rao, or a description (.toml) that states what such a file leaves open."
)
AT_HELP = 'A point from the reference point, forward and to port, whose vertical motion is shown: "x=-20 m, y=-18 m".'
Vessel = Annotated[str, typer.Argument(help=VESSEL_HELP, metavar="VESSEL|FILE")]


def vessel(
    name: Vessel,
    at: Annotated[str | None, typer.Option(help=AT_HELP)] = None,
    out: Out = None,
    check: Annotated[
        bool, typer.Option("--check", help="Test it against what every floating body does in long waves.")
    ] = False,
    json: Json = False,
) -> None:
    """What a vessel file holds: reference point, conventions, range, notes, largest motions, and heave or the motion of
    a point.

    Headings are directions in which waves travel, counter-clockwise from the bow: 0 following, 90 coming from
    starboard, 180 head sea, 270 coming from port.

    --check tests it against what every floating body does in waves much longer than it: a wrong sign, phase, axis,
    heading or unit shows. The verdict is the worst of its motions. Exit code 1 where it is wrong, doubtful, or its
    longest wave is too short to show that it fits.

    Example: stillhook vessel FILE.re1 --at "x=-20 m, y=-18 m"

    Example: stillhook vessel FILE.re1 --check
    """
    if check:
        refuse({"--at": at, "--out": out}, "--check writes nothing. Leave it out.")
        raise typer.Exit(0 if _check(name, json=json) else 1)
    from stillhook.formats.vessel.open import read_vessel
    from stillhook.sea.vessel.boom import parse_point

    point = None if at is None else parse_point(at, "--at")
    place = None if point is None else (point.x, point.y)
    check_out(out, OUT_FILES)
    rao = read_vessel(name)
    answer = _sheet(rao, place)
    picture, numbers = OUT_FILES

    def pictures() -> dict[str, Any]:
        from stillhook.report.plots.sea import vessel_figure

        return {picture: vessel_figure(rao, place)}

    brief = lambda: _answer(rao, answer, place, name)
    present(answer, out, {numbers: answer}, brief=brief, json=json, pictures=pictures)


def _check(name: str, *, json: bool) -> bool:
    """Print what the test found; whether the vessel fits."""
    from stillhook.formats.vessel.open import read_untested
    from stillhook.sea.vessel.floating_body import in_words, long_wave_test, remarks, verdict_of

    rao = read_untested(name)
    tests = long_wave_test(rao)
    word, line = verdict_of(rao, tests)
    notes = [*rao.notes, *(note for note in remarks(rao, tests) if note != line)]
    answer = {
        "vessel": rao.name,
        "source": rao.source,
        "origin": rao.origin,
        "passed": word == "fits",
        "verdict": line,
        "longest_wave": 2.0 * math.pi / float(rao.omega[0]),
        "motions": [_tested(t) for t in tests],
        "notes": notes,
    }
    rows = [
        (
            t.dof,
            f"{t.share:.3f}",
            in_words(t.value),
            in_words(t.limit),
            f"{math.degrees(t.beta):.4g} deg",
            f"{t.deviation:.3f}",
            t.verdict,
        )
        for t in tests
    ]
    heads = ("motion", "share of limit", "found", "limit", "worst at", "apart", "verdict")
    per = "per metre of wave (rotations per slope of the wave)"
    lines: list[Line] = [
        f"{'PASSED' if answer['passed'] else 'NOT PASSED'}: {line}",
        Cells(f"Share of the limit: {', '.join(f'{t.dof} {t.share:.2f}' for t in tests)}."),
        partial(print_table, heads, rows, title=per, texts=(6,)),
        partial(wrapped, f"reference point: {rao.origin or 'not stated'}"),
    ]
    title = f"{rao.name}: low-frequency limit in waves of {answer['longest_wave']:.4g} s"
    brief = lambda: Answer(title, lines, more="each motion, headings", notes=notes, shown=2)
    present(answer, brief=brief, json=json)
    return word == "fits"


def _tested(t: LongWave) -> dict[str, Any]:
    parts = {"value_re": t.value.real, "value_im": t.value.imag, "limit_re": t.limit.real, "limit_im": t.limit.imag}
    return {"motion": t.dof, "share": t.share, **parts, "beta": t.beta, "deviation": t.deviation, "verdict": t.verdict}


def _sheet(rao: Rao, point: tuple[float, float] | None) -> dict[str, Any]:
    import numpy as np

    from stillhook.sea.vessel.rao import DOFS

    peaks = []
    for d, dof in enumerate(DOFS):
        j, k = np.unravel_index(int(np.argmax(np.abs(rao.H[d]))), rao.H[d].shape)
        omega = float(rao.omega[k])
        size = float(np.abs(rao.H[d, j, k]))
        peaks.append(
            {"motion": dof, "size": size, "omega": omega, "period": 2.0 * math.pi / omega, "beta": float(rao.beta[j])}
        )
    x, y = point or (0.0, 0.0)
    period = 2.0 * np.pi / rao.omega
    return {
        "vessel": rao.name,
        "source": rao.source,
        "origin": rao.origin,
        "water_depth": rao.depth,
        "omega": rao.omega.tolist(),
        "period": period.tolist(),
        "beta": rao.beta.tolist(),
        "x": x,
        "y": y,
        "z_per_wave": np.abs(rao.vertical(rao.omega, rao.beta, x, y)).tolist(),
        "leeway": rao.leeway(x, y),
        "peaks": peaks,
        "notes": list(rao.notes),
    }


TRANSLATIONS = ("surge", "sway", "heave")


def _answer(rao: Rao, answer: dict[str, Any], point: tuple[float, float] | None, name: str) -> Answer:
    """Range of the table, the largest value of each motion, and the vertical motion per metre of wave."""
    import numpy as np

    T, rows = answer["period"], []
    for p in answer["peaks"]:
        moves = p["motion"] in TRANSLATIONS
        size = f"{number(p['size'] if moves else math.degrees(p['size']), 3)} {'m' if moves else 'deg'}/m"
        rows.append((p["motion"], size, f"{p['period']:.3g} s", f"{math.degrees(p['beta']):.4g} deg"))
    largest = ", ".join(f"{motion} {size} at {period}" for motion, size, period, _ in rows)
    where = "the reference point" if point is None else f"the point x {point[0]:g} m, y {point[1]:g} m"
    H = np.abs(rao.vertical(2.0 * np.pi / np.array(PERIODS), np.radians(SIDES), *(point or (0.0, 0.0))))
    beta = np.degrees(rao.beta)
    gap = float(np.max(np.diff(np.append(beta, beta[0] + 360.0))))
    apart = f"{len(beta)} headings at most {gap:.4g} deg apart"
    depth = "deep water" if math.isinf(rao.depth) else f"water of {rao.depth:g} m"
    table = [(f"{period:g} s", *(f"{x:.3f}" for x in row)) for period, row in zip(PERIODS, H, strict=True)]
    basis = "(waves of 5 to 12 s; half of what a spline and straight lines differ by)"
    vertical = f"vertical motion of {where} per metre of wave [m/m], by where waves travel"
    lines: list[Line] = [
        partial(wrapped, f"reference point: {rao.origin or 'not stated'}"),
        f"{len(T)} periods from {T[-1]:.4g} to {T[0]:.4g} s, {apart}, {depth}.",
        Cells(f"Largest per metre of wave: {largest}."),
        partial(print_table, ("motion", "largest", "at period", "waves travel"), rows),
        f"Largest vertical motion of {where}: {H.max():.3f} m/m, known within {100.0 * answer['leeway']:.2g} %"
        f" {basis}.",
        partial(print_table, ("period", *(f"{s:g} deg" for s in SIDES)), table, title=vertical),
    ]
    more = "vertical motion by period and heading"
    step = f"stillhook vessel {argument(name)} --check"
    return Answer(f"{rao.name}, from {rao.source}", lines, step, more, answer["notes"], shown=2)
