"""The two ships: lines, weights and roll damping, every choice with its reason."""

from __future__ import annotations

from dataclasses import dataclass

from lines import Lines


@dataclass(frozen=True)
class Ship:
    """A ship that floats on even keel, its centre of gravity above that of buoyancy.

    GM metacentric height [m]; r_xx, r_yy, r_zz radii of inertia about axes through the centre of gravity, r_xx as part
    of the breadth, the others as parts of the length; zeta added linear roll damping as part of the critical one,
    in addition to the radiation damping of roll; panel the side [m] of a panel that the library's numbers are computed
    with; coarser the sides that show convergence.
    """

    name: str
    title: str
    lines: Lines
    GM: float
    r_xx: float
    r_yy: float
    r_zz: float
    zeta: float
    panel: float
    coarser: tuple[float, ...]
    tip: tuple[float, float]


CONSTRUCTION = Ship(
    name="construction-vessel-130m",
    title="Construction vessel 130 m",
    lines=Lines(
        L=130.0,
        B=27.0,
        T=7.2,
        entrance=0.42,
        run=0.18,
        rise=0.34,
        n=2.0,
        t_b=0.85,
        t_d=0.25,
        p_m=10.0,
        p_bow=1.8,
        p_stern=4.0,
    ),
    GM=2.5,
    r_xx=0.38,
    r_yy=0.25,
    r_zz=0.26,
    zeta=0.05,
    panel=1.4,
    coarser=(2.0, 2.8, 4.0),
    tip=(-20.0, -25.0),
)
SUPPLY = Ship(
    name="supply-vessel-82m",
    title="Supply vessel 82 m",
    lines=Lines(
        L=82.0,
        B=18.5,
        T=6.0,
        entrance=0.44,
        run=0.15,
        rise=0.34,
        n=2.0,
        t_b=0.90,
        t_d=0.25,
        p_m=10.0,
        p_bow=1.8,
        p_stern=4.0,
    ),
    GM=1.8,
    r_xx=0.38,
    r_yy=0.25,
    r_zz=0.26,
    zeta=0.05,
    panel=1.0,
    coarser=(1.4, 2.0, 2.8),
    tip=(-20.0, -18.0),
)
SHIPS = (CONSTRUCTION, SUPPLY)

REASONS = {
    "L, B, T": (
        "usual for the class: L/B 4.4 to 4.8, B/T 3.1 to 3.8; waterline length, from transom to stem; "
        "no bulb, no thruster tunnels, no moonpool"
    ),
    "lines": (
        "parallel middle body, bilges of small radius, long entrance, buttocks that rise to a wide, little immersed"
        " transom: block coefficient 0.74 to 0.75, of the usual 0.70 to 0.80"
    ),
    "GM": (
        "2 to 3 m on crane ships and 1.5 to 2 m on supply ships with deck cargo: enough for stability rules, low enough"
        " for a slow roll"
    ),
    "r_xx": "0.35 to 0.40 B is the usual estimate of monohulls; the upper half for a crane and winches on deck",
    "r_yy, r_zz": "0.25 L, the usual estimate, and 0.26 L for yaw; products of inertia 0",
    "zeta": (
        "5 % of critical in addition to wave radiation stands for bilge keels, eddies and skin friction at some degrees"
        " of roll; a real ship has 2 to 10 %, more in higher seas, and more with roll tanks"
    ),
    "moorings": "none: a dynamically positioned ship's slow holding forces do not act at the periods of waves",
    "depth of water": "endless: right from half of a wavelength on, 140 m at 13 s",
    "speed": "none: the vessel has no forward speed over its work",
}
