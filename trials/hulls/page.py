"""How far to trust the motions of the library's own vessels: tables from what hulls/make.py computed and kept."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from blocks import Blocks, Table, percent, picture, save
from matplotlib.figure import Figure

from stillhook.formats.vessel.open import read_vessel
from stillhook.library.catalogue import vessel_file
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.sea.vessel.rao import Rao, long_wave_limits, wavenumber

SCRIPT = "hull_convergence"

STORE = Path(__file__).with_name("outcomes.json")
HULLS = Path(__file__).resolve().parents[2] / "hulls"
BAND = (2.0 * np.pi / 20.0, 2.0 * np.pi / 6.0)  # rad/s: periods at which a ship answers
SPIKE = 0.03
"""Of the largest added mass: what open and lidded hull may differ by before it counts as an irregular frequency."""
ANGLES = (0, 45, 90, 135, 180)
APART = [COLOURS[i] for i in (0, 1, 3, 4, 6)]
MODES = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def kept() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(STORE.read_text(encoding="utf-8"))
    return found


def parts(x: float, digits: int = 1) -> str:
    """0.0123 as 1.2 %."""
    return f"{100.0 * x:.{digits}f} %".replace("-", "−")


def in_band(ship: Mapping[str, Any], mode: str) -> np.ndarray:
    """Haskind's ratio of a motion where a ship answers."""
    omega = np.array(ship["loads"]["all_omega"])
    return np.array(ship["loads"]["haskind"])[(omega >= BAND[0]) & (omega <= BAND[1]), MODES.index(mode)]


def sigma_off(ship: Mapping[str, Any], h: str) -> np.ndarray:
    """Standard deviations of the tip with one size of panels over those with the smallest, less 1, (periods,
    headings)."""
    best = np.array(next(iter(ship["panels"].values()))["sigma_z"])
    return np.asarray(np.array(ship["panels"][h]["sigma_z"]) / best - 1.0)


def left(ship: Mapping[str, Any]) -> float:
    """Error that the smallest panels may still have in the tip's motion: what the next larger ones change at most, as
    errors that shrink with the panel's side leave it: 1/(1.4 - 1) of the change."""
    sizes = list(ship["panels"])
    return float(np.abs(sigma_off(ship, sizes[1])).max()) / (float(sizes[1]) / float(sizes[0]) - 1.0)


def spikes(ship: Mapping[str, Any]) -> list[float]:
    """Frequencies [rad/s] at which a hull without lid goes astray in heave."""
    one = ship["irregular"]
    off = np.abs(np.array(one["A_open"]) - np.array(one["A_lid"])) / np.abs(one["A_lid"]).max()
    peak = (off[1:-1] > off[:-2]) & (off[1:-1] >= off[2:]) & (off[1:-1] > SPIKE)
    return [float(w) for w in np.array(one["omega"])[1:-1][peak]]


def box(lines: Mapping[str, float], form: Mapping[str, float]) -> float:
    """Lowest irregular frequency [rad/s] of a box of the same waterplane, breadth and draught: omega^2 = g kappa
    coth(kappa T)."""
    kappa = np.pi * np.hypot(1.0 / lines["B"], 1.0 / (form["C_W"] * lines["L"]))
    return float(np.sqrt(kept()["g"] * kappa / np.tanh(kappa * lines["T"])))


def long_waves(vessel: Rao) -> dict[str, float]:
    """Largest deviation from the long-wave limits at the longest period, over all headings: heave, and roll and pitch
    over the slope."""
    k = wavenumber(vessel.omega[0])
    limit = long_wave_limits(vessel.beta)
    scaled = vessel.H[:, :, 0] / np.array([1.0, 1.0, 1.0, k, k, k])[:, None]
    return {m: float(np.abs(scaled[i] - limit[i]).max()) for i, m in enumerate(MODES)}


def ship_rows(ships: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    every = list(ships.values())
    cell = lambda text: tuple(text(s["lines"], s["weights"], s["form"], s["floating"]) for s in every)
    yield "waterline, breadth, draught", *cell(lambda l, w, f, n: f"{l['L']:g} × {l['B']:g} × {l['T']:g} m")
    yield (
        "block, waterplane, midship coefficient",
        *cell(lambda l, w, f, n: f"{f['C_B']:.3f}, {f['C_W']:.3f}, {f['C_M']:.3f}"),
    )
    yield "mass", *cell(lambda l, w, f, n: f"{n['mass'] / 1e3:.0f} t")
    centre = lambda l, w, f, n: (
        f"{n['centre'][0]:+.2f} m from midship, {l['T'] + n['centre'][2]:.2f} m above keel".replace("-", "−")
    )
    yield "centre of gravity", *cell(centre)
    yield "GM", *cell(lambda l, w, f, n: f"{w['GM']:g} m")
    yield "radii of inertia", *cell(lambda l, w, f, n: f"{w['r_xx']:g} B, {w['r_yy']:g} L, {w['r_zz']:g} L")
    yield "added roll damping", *cell(lambda l, w, f, n: f"{percent(w['zeta'])} of critical")
    yield "roll damping by waves", *cell(lambda l, w, f, n: f"{parts(n['waves'], 2)} of critical")
    for mode in ("heave", "roll", "pitch"):
        yield f"natural period, {mode}", *cell(lambda l, w, f, n, m=mode: f"{2.0 * np.pi / n['omega_n'][m]:.2f} s")


def panel_rows(ships: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    for ship in ships.values():
        for h, one in ship["panels"].items():
            off = {key: max(one[f"{key}_off"][i] for i in (1, 2, 3, 4)) for key in ("A", "B", "F")}
            motions = (parts(one["H_off"][i]) for i in (2, 3, 4))
            first = h == next(iter(ship["panels"]))
            yield {**locals()}


def haskind_rows(ships: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    for mode in ("sway", "heave", "roll", "pitch"):
        for ship in ships.values():
            found = in_band(ship, mode)
            yield mode, ship["title"], f"{found.min():.3f} to {found.max():.3f}"


def irregular_rows(ships: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    for ship in ships.values():
        where, lowest = spikes(ship), box(ship["lines"], ship["form"])
        first = ", ".join(f"{w:.2f}" for w in where[:6]) + (" ..." if len(where) > 6 else "")
        period = f"{2.0 * np.pi / where[0]:.1f} s and shorter" if where else "none"
        yield ship["title"], f"{lowest:.2f} rad/s", f"{first} rad/s", period


def damping_rows(found: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    periods, headings = found["seas"]["periods"], found["seas"]["headings"]
    for ship in found["ships"].values():
        for zeta, one in ship["damping"].items():
            sigma = np.array(one["sigma_z"])
            cells = (
                f"{sigma[periods.index(T), headings.index(b)]:.3f}"
                for b in (180.0, 90.0, 270.0)
                for T in (8.0, 12.0, 15.0)
            )
            yield ship["title"], percent(float(zeta)), f"{one['roll']:.1f} °/m", *cells


def table_rows(ships: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    for ship in ships.values():
        one = ship["table"]
        for what, key in (
            (f"{one['frequencies']} frequencies", "frequency"),
            (f"{one['headings']} headings", "heading"),
            ("splines through the loads", "spline"),
        ):
            yield ship["title"], what, *(parts(x, 2) for x in one[key])


def compute() -> tuple[Blocks, dict[str, Any]]:
    found = kept()
    ships = found["ships"]
    vessels = {name: read_vessel(vessel_file(name)) for name in ships}
    volume = max(abs(next(iter(s["panels"].values()))["V"] / s["form"]["V"] - 1.0) for s in ships.values())
    haskind = np.concatenate([in_band(s, "heave") for s in ships.values()])
    roll = np.concatenate([in_band(s, "roll") for s in ships.values()])
    change, beyond = max(left(s) for s in ships.values()), max(spikes_with_lid(s) for s in ships.values())
    heave = max(long_waves(v)["heave"] for v in vessels.values())

    seas = [f"{b} {T} s" for b in ("head", "weather side", "lee side") for T in (8, 12, 15)]
    periods = [f"{T:g} s" for T in next(iter(ships.values()))["table"]["periods"]]
    return {
        "claims": locals(),
        "ships": Table(("", *(s["title"] for s in ships.values())), ship_rows(ships)),
        "reasons": found["reasons"].items(),
        "panels": panel_rows(ships),
        "haskind": haskind_rows(ships),
        "irregular": irregular_rows(ships),
        "damping": Table(("ship", "added", "roll, highest", *seas), damping_rows(found)),
        "table": Table(("ship", "error by", *periods), table_rows(ships)),
    }, {"found": found, "vessels": vessels}


def spikes_with_lid(ship: Mapping[str, Any]) -> float:
    """Largest departure of heave's added mass, with the lid, from the straight line between its neighbours, over its
    largest value."""
    A = np.array(ship["irregular"]["A_lid"])
    return float(np.abs(A[1:-1] - (A[:-2] + A[2:]) / 2.0).max() / np.abs(A).max())


def draw(shown: Mapping[str, Any]) -> None:
    save(lines_figure(shown["found"]["ships"]), "hull-lines.png")
    save(motions_figure(shown["vessels"]), "hull-motions.png")
    save(irregular_figure(shown["found"]["ships"]), "hull-irregular.png")


def lines_figure(ships: Mapping[str, Any]) -> Figure:
    """Body plan (aft half left, fore half right) and panels seen from the side and from below."""
    if str(HULLS) not in sys.path:
        sys.path.insert(0, str(HULLS))
    from lines import Lines, hull_panels, section

    figure = picture(11.0, 4.6)
    axes = figure.subplots(len(ships), 2, width_ratios=(1.0, 2.0))
    for (plan, side), ship in zip(axes, ships.values(), strict=True):
        hull = Lines(**ship["lines"])
        for x in np.linspace(-hull.L / 2.0, hull.L / 2.0, 21):
            y, z = section(float(hull.half_breadth(x)), float(hull.draught(x)), float(hull.fullness(x)), 40).T
            plan.plot(y if x >= 0.0 else -y, z, color=COLOURS[0 if x >= 0.0 else 1], lw=0.9)
        vertices, faces = hull_panels(hull, float(list(ship["panels"])[1]))
        for corners in vertices[faces]:
            x, y, z = corners[[0, 1, 2, 3, 0]].T
            side.plot(x, z, color=COLOURS[0], lw=0.3)
            side.plot(x, -1.4 * hull.T - y, color=COLOURS[2], lw=0.3)
        plan.set(aspect="equal", xlabel="y [m]", ylabel="z [m]", title=ship["title"])
        side.set(
            aspect="equal",
            xlabel="x forward of midship [m]",
            title="port half of the panels, from the side and from below",
        )
        side.set_yticks([])
    return figure


def motions_figure(vessels: Mapping[str, Rao]) -> Figure:
    figure = picture(11.0, 6.4)
    axes = figure.subplots(len(vessels), 3, sharex=True)
    for row, vessel in zip(axes, vessels.values(), strict=True):
        for ax, mode, scale, unit in zip(row, (2, 3, 4), (1.0, 57.29578, 57.29578), ("m/m", "°/m", "°/m"), strict=True):
            for colour, angle in zip(APART, ANGLES, strict=True):
                j = int(np.argmin(np.abs(np.degrees(vessel.beta) - angle)))
                ax.plot(vessel.omega, scale * np.abs(vessel.H[mode, j]), color=colour, lw=1.2, label=f"{angle}°")
            ax.set_title(f"{vessel.name}: {MODES[mode]} [{unit}]", fontsize="medium")
            ax.set_xlim(0.1, 1.6)
            ax.set_ylim(0.0)
            ax.grid(alpha=0.3)
    for ax in axes[-1]:
        ax.set_xlabel("frequency [rad/s]")
    axes[0, 0].legend(title="waves travel to\n(0°: following)", fontsize="small")
    return figure


def irregular_figure(ships: Mapping[str, Any]) -> Figure:
    figure = picture(11.0, 4.0)
    for ax, ship in zip(figure.subplots(1, len(ships)), ships.values(), strict=True):
        one, mass = ship["irregular"], ship["floating"]["mass"]
        ax.plot(
            one["omega"], np.array(one["A_open"]) / mass, color=COLOURS[1], lw=1.0, marker=".", ms=4, label="hull alone"
        )
        ax.plot(one["omega"], np.array(one["A_lid"]) / mass, color=COLOURS[0], lw=1.4, label="with inner lid")
        ax.axvline(box(ship["lines"], ship["form"]), color=GREY, ls="--", lw=1.0, label="lowest of a box")
        ax.set(title=ship["title"], xlabel="frequency [rad/s]", ylabel="added mass in heave over mass [-]")
        ax.set_ylim(0.0, 1.6 * max(one["A_lid"]) / mass)
        ax.grid(alpha=0.3)
        ax.legend(fontsize="small")
    return figure
