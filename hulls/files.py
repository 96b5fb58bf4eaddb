"""What is kept of the computed loads: the library's vessel files, and the numbers of the page and the tests on them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from motions import HEADINGS, ROLL, Floating, finer, floating, natural, rao, roll_damping, solved, symmetric
from radiation import DOFS, RHO, FloatArray, G, Loads
from ships import REASONS, Ship

from stillhook.formats.vessel.csv import write_rao_csv
from stillhook.sea.spectra.text import parse_sea
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.tip import tip_response

ROOT = Path(__file__).resolve().parents[1]
VESSELS = ROOT / "src" / "stillhook" / "library" / "vessels"
PAGE = ROOT / "trials" / "hulls" / "outcomes.json"
PERIODS, HEADINGS_SEAS = (6.0, 8.0, 10.0, 12.0, 15.0), (180.0, 150.0, 90.0, 270.0)
"""Seas of the page: JONSWAP 1 m, gamma 3.3."""
ZETAS = (0.02, 0.05, 0.10)
EVERY = 6
"""Of the frequencies, every so many-th is kept with its loads."""


def write_all(all_loads: Mapping[Ship, Mapping[float, Loads]], irregular: Mapping[Ship, tuple[Loads, Loads]]) -> None:
    """Vessel files from the smallest panels, and the kept numbers of all."""
    kept = {}
    for ship, by_panel in all_loads.items():
        best = by_panel[ship.panel]
        write_vessel(ship, best)
        kept[ship.name] = numbers(ship, by_panel) | {"irregular": lids(*irregular[ship])}
        print(f"{ship.name}: {VESSELS / ship.name}.csv")
    seas = {"periods": PERIODS, "headings": HEADINGS_SEAS}
    text = json.dumps(
        {"capytaine": version("capytaine"), "rho": RHO, "g": G, "seas": seas, "reasons": REASONS, "ships": kept},
        indent=1,
    )
    PAGE.write_text(one_line_arrays(text) + "\n", encoding="utf-8", newline="\n")


def one_line_arrays(text: str) -> str:
    """JSON with every innermost list on one line."""
    import re

    return re.sub(r"\[\s+([^\[\]{}]*?)\s+\]", lambda m: "[" + " ".join(m[1].split()) + "]", text)


def write_vessel(ship: Ship, loads: Loads) -> None:
    weights = floating(ship, loads)
    damping, waves = roll_damping(ship, weights, loads)
    lines, periods = ship.lines, 2.0 * np.pi / np.array(natural(weights, loads))
    notes = (
        (
            f"A hull of our own in closed form, no ship that floats: waterline {lines.L:g} m, breadth {lines.B:g} m,"
            f" draught {lines.T:g} m, {weights.mass / 1e3:.0f} t, centre of gravity {weights.centre[0]:+.2f} m from"
            f" midship and {lines.T + weights.centre[2]:.2f} m above the keel, GM {ship.GM:g} m, radii of inertia"
            f" {ship.r_xx * lines.B:.2f}, {ship.r_yy * lines.L:.2f}, {ship.r_zz * lines.L:.2f} m"
        ),
        (
            f"Roll damping: {100.0 * ship.zeta:g} % of critical ({damping:.4g} N m s/rad) is added to what waves carry"
            f" away ({100.0 * waves:.2g} %); linear: real roll is damped more in higher seas"
        ),
        f"Natural periods: heave {periods[0]:.2f} s, roll {periods[1]:.2f} s, pitch {periods[2]:.2f} s",
        "Deep water, no speed, no moorings; panel method of potential flow",
    )
    source = (
        f"Capytaine {version('capytaine')}, {loads.panels} panels of about {ship.panel:g} m and {loads.lid} on an inner"
        " lid; hulls/make.py"
    )
    write_rao_csv(rao(ship, loads), VESSELS / f"{ship.name}.csv", source=source, notes=notes, mirror=True)


def significant(x: Any, digits: int = 6) -> Any:
    """Numbers as lists of plain floats with so many digits."""
    array = np.asarray(x, dtype=float)
    return np.vectorize(lambda v: float(f"{v:.{digits}g}"), otypes=[float])(array).tolist()


def numbers(ship: Ship, by_panel: Mapping[float, Loads]) -> dict[str, Any]:
    best = by_panel[ship.panel]
    weights = floating(ship, best)
    return {
        "title": ship.title,
        "lines": vars(ship.lines),
        "weights": {"GM": ship.GM, "r_xx": ship.r_xx, "r_yy": ship.r_yy, "r_zz": ship.r_zz, "zeta": ship.zeta},
        "form": {key: float(f"{value:.7g}") for key, value in ship.lines.form().items()},
        "tip": list(ship.tip),
        "floating": floating_numbers(ship, weights, best),
        "loads": load_numbers(ship, weights, best),
        "panels": {f"{h:g}": panel_numbers(ship, loads, best) for h, loads in by_panel.items()},
        "damping": {f"{zeta:g}": damping_numbers(ship, best, zeta) for zeta in ZETAS},
        "table": table_numbers(ship, best),
    }


def floating_numbers(ship: Ship, weights: Floating, loads: Loads) -> dict[str, Any]:
    damping, waves = roll_damping(ship, weights, loads)
    return {
        "mass": significant(weights.mass, 9),
        "centre": significant(weights.centre),
        "M": significant(weights.M, 9),
        "C": significant(weights.C, 9),
        "B_44": significant(damping, 9),
        "waves": significant(waves, 4),
        "omega_n": dict(zip(("heave", "roll", "pitch"), significant(natural(weights, loads)), strict=True)),
    }


def load_numbers(ship: Ship, weights: Floating, loads: Loads) -> dict[str, Any]:
    """Loads at some frequencies, as computed, and Haskind's and reciprocity's misses over all of them."""
    some = slice(None, None, EVERY)
    return {
        "omega": significant(loads.omega[some], 9),
        "beta": significant(np.degrees(loads.beta[::HEADINGS])),
        "A": significant(loads.A[some]),
        "B": significant(loads.B[some]),
        "F_re": significant(loads.F[some, ::HEADINGS].real),
        "F_im": significant(loads.F[some, ::HEADINGS].imag),
        "all_omega": significant(loads.omega),
        "haskind": significant(haskind(loads), 4),
        "reciprocity": significant(reciprocity(loads), 3),
    }


def haskind(loads: Loads) -> FloatArray:
    """Damping that follows from excitation, over that from radiation, (n, 6): omega^3/(4 pi rho g^3) times the integral
    of |F|^2 over all headings."""
    step = loads.beta[1] - loads.beta[0]
    B = loads.omega[:, None] ** 3 / (4.0 * np.pi * RHO * G**3) * (np.abs(loads.F) ** 2).sum(axis=1) * step
    return B / np.diagonal(loads.B, axis1=1, axis2=2)


def reciprocity(loads: Loads) -> float:
    """Largest |A_ij - A_ji| over sqrt(A_ii A_jj)."""
    diagonal = np.diagonal(loads.A, axis1=1, axis2=2)
    scale = np.sqrt(np.abs(diagonal[:, :, None] * diagonal[:, None, :]))
    return float((np.abs(loads.A - np.swapaxes(loads.A, 1, 2)) / scale).max())


def sigmas(ship: Ship, vessel: Rao, headings: Sequence[float] = HEADINGS_SEAS) -> FloatArray:
    """Standard deviations of the tip's height [m], (periods, headings)."""
    sea = lambda T, b: parse_sea(f"jonswap Hs=1 m Tp={T:g} s gamma=3.3", heading=f"{b:g} deg")
    return np.array([[tip_response(vessel, sea(T, b), *ship.tip).sigma_z for b in headings] for T in PERIODS])


def panel_numbers(ship: Ship, loads: Loads, best: Loads) -> dict[str, Any]:
    """What one size of panels gives, and how far it is from the smallest."""
    weights = floating(ship, loads)
    vessel, finest = rao(ship, loads), rao(ship, best)
    H, H_best = Rao.table(vessel, best.omega), Rao.table(finest, best.omega)
    diagonal = lambda table: np.diagonal(table, axis1=1, axis2=2)
    off = lambda a, b: np.abs(a - b).max(axis=0) / np.abs(b).max(axis=0)
    return {
        "panels": loads.panels,
        "lid": loads.lid,
        "V": significant(loads.V, 7),
        "asymmetry": significant(loads.asymmetry, 3),
        "reciprocity": significant(reciprocity(loads), 3),
        "A_off": significant(off(diagonal(loads.A), diagonal(best.A)), 3),
        "B_off": significant(off(diagonal(loads.B), diagonal(best.B)), 3),
        "F_off": significant(off(loads.F.reshape(-1, 6), best.F.reshape(-1, 6)), 3),
        "H_off": significant(np.abs(H - H_best).max(axis=(1, 2)) / np.abs(H_best).max(axis=(1, 2)), 3),
        "omega_n": significant(natural(weights, loads)),
        "sigma_z": significant(sigmas(ship, vessel)),
    }


def damping_numbers(ship: Ship, loads: Loads, zeta: float) -> dict[str, Any]:
    vessel = rao(ship, loads, zeta=zeta)
    roll = np.abs(vessel.H[ROLL])
    return {"roll": significant(np.degrees(roll.max()), 4), "sigma_z": significant(sigmas(ship, vessel))}


def table_numbers(ship: Ship, loads: Loads) -> dict[str, Any]:
    """Loss of accuracy from the table's frequencies and headings, and by the splines through the loads: the tip's
    standard deviations over those from the table, less 1, the largest. Frequencies: from loads on a grid eight times as
    fine. Headings: at those that the loads have and the table has not. Splines: from every second frequency of the
    loads."""
    table = rao(ship, loads)
    weights = floating(ship, loads)
    steps = [np.linspace(a, b, 9) for a, b in zip(table.omega[:-1], table.omega[1:], strict=True)]
    fine = finer(loads, np.unique(np.concatenate(steps)))
    damping = np.zeros((6, 6))
    damping[ROLL, ROLL] = roll_damping(ship, weights, loads)[0]
    H = solved(fine.omega, weights.M + symmetric(fine.A), symmetric(fine.B) + damping, weights.C, fine.F)
    every = Rao(table.name, fine.omega, fine.beta, H)
    some = finer(finer(loads, np.append(loads.omega[:-1:2], loads.omega[-1])), fine.omega)
    H = solved(fine.omega, weights.M + symmetric(some.A), symmetric(some.B) + damping, weights.C, some.F)
    rare = Rao(table.name, fine.omega, fine.beta[::HEADINGS], H[:, ::HEADINGS])
    between = tuple(np.degrees(fine.beta[1::HEADINGS]))
    off = lambda one, other, at: np.abs(sigmas(ship, one, at) / sigmas(ship, other, at) - 1.0).max(axis=1)
    alike = Rao(table.name, fine.omega, fine.beta[::HEADINGS], every.H[:, ::HEADINGS])
    return {
        "frequencies": len(table.omega),
        "headings": len(table.beta),
        "periods": list(PERIODS),
        "frequency": significant(off(alike, table, HEADINGS_SEAS), 3),
        "heading": significant(off(alike, every, between), 3),
        "spline": significant(off(rare, alike, HEADINGS_SEAS), 3),
    }


def lids(closed: Loads, open_: Loads) -> dict[str, Any]:
    """Added mass and damping in heave [kg, kg/s] with and without the lid."""
    d = DOFS.index("Heave")
    return {
        "omega": significant(closed.omega),
        "panels": closed.panels,
        "A_lid": significant(closed.A[:, d, d], 5),
        "B_lid": significant(closed.B[:, d, d], 5),
        "A_open": significant(open_.A[:, d, d], 5),
        "B_open": significant(open_.B[:, d, d], 5),
    }
