"""Compute the library's vessels from their hulls: wave loads, motions, the files in src/stillhook/library/vessels, and
what the page keeps.

    python hulls/make.py                 loads of every ship and panel size (half an hour on one core), then all files
    python hulls/make.py --loads         loads alone
    python hulls/make.py --files         files alone, from loads computed before

Loads are kept in results/hulls, which git does not hold. Needs pip install "stillhook[hulls]".
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from radiation import Loads, loads
from ships import SHIPS, Ship

ROOT = Path(__file__).resolve().parents[1]
KEPT = ROOT / "results" / "hulls"
OMEGA = np.concatenate(
    (
        [2.0 * np.pi / 60.0],
        np.arange(0.15, 0.31, 0.05),
        np.arange(0.34, 1.11, 0.04),
        np.arange(1.15, 1.61, 0.05),
        np.arange(1.67, 2.05, 0.07),
        [2.0 * np.pi / 3.0],
    )
)
"""[rad/s], 60 s to 3 s: 42 frequencies, close where a ship answers."""
BETA = np.radians(np.arange(0.0, 360.0, 5.0))
FINE = np.arange(1.0, 2.095, 0.02)
"""Frequencies at which irregular ones are looked for [rad/s]."""


def kept(ship: Ship, h: float, variant: str = "") -> Path:
    return KEPT / f"{ship.name}-{h:g}{variant}.npz"


def compute(ship: Ship, h: float) -> None:
    if not kept(ship, h).exists():
        print(f"{ship.name}: panels of {h:g} m")
        loads(ship.lines, h, OMEGA, BETA).save(kept(ship, h))


def compute_irregular(ship: Ship, h: float) -> None:
    for lid, variant in ((True, "-lid"), (False, "-open")):
        if not kept(ship, h, variant).exists():
            print(f"{ship.name}: panels of {h:g} m {variant.removeprefix('-')}")
            loads(ship.lines, h, FINE, BETA[:0], lid=lid, dofs=("Heave",)).save(kept(ship, h, variant))


def compute_all() -> None:
    for ship in SHIPS:
        for h in reversed(ship.coarser):
            compute(ship, h)
        compute_irregular(ship, ship.coarser[0])
        compute(ship, ship.panel)


def main(names: list[str]) -> None:
    if unknown := [a for a in names if a not in ("--loads", "--files")]:
        sys.exit(f"{unknown[0]}: unknown. Give --loads, --files or nothing.")
    if "--files" not in names:
        compute_all()
    if "--loads" not in names:
        from files import write_all  # here: loads alone need no files

        if missing := [f for ship in SHIPS for h in (ship.panel, *ship.coarser) if not (f := kept(ship, h)).exists()]:
            sys.exit(f"{missing[0].name} is not in {KEPT}: compute the loads first (--loads).")
        pair = lambda ship: (
            Loads.load(kept(ship, ship.coarser[0], "-lid")),
            Loads.load(kept(ship, ship.coarser[0], "-open")),
        )
        all_loads = {ship: {h: Loads.load(kept(ship, h)) for h in (ship.panel, *ship.coarser)} for ship in SHIPS}
        write_all(all_loads, {ship: pair(ship) for ship in SHIPS})


if __name__ == "__main__":
    main(sys.argv[1:])
