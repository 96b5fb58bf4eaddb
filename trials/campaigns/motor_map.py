"""SYNTHETIC supplier maps: a published MJ4 motor plus losses that MJ4 lacks, printed as coarsely as a supplier prints.

No supplier's map is public. These stand in for one, so that fits, ranking and figures can be tried and tested; they are
marked synthetic in the file, in every report and in the name of the source, and no number from them may be used for a
real motor.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_file
from stillhook.identify.motor.map import SYNTHETIC, LossMap
from stillhook.library import motor as library_motor
from stillhook.physics.hydraulics.motor import TorqueLossFit, torque_loss
from stillhook.physics.hydraulics.motor_losses import LossMotor, notch_loss
from stillhook.units import from_display, in_display

SPEEDS = tuple(range(400, 2501, 100))
PRESSURES = (50, 100, 150, 200, 250, 300, 350)
SHARES = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
"""Grid of the maps: rev/min and bar of paper A (section 3.14), displacement as part of the full one, from a fifth."""
PRINTED = 0.001
"""Suppliers print the efficiency to 0.1 %."""
SCATTER = 0.2
"""Relative standard deviation by which each of the extra losses differs between seeds."""


@dataclass(frozen=True)
class Extra:
    """Losses in addition to MJ4, each as part of the motor's loss at full displacement, 200 bar and the speed where
    it matters.

    Sizes are assumed, such that MJ4 fits as paper A found: within 1 % of nominal torque down to half displacement,
    worse at small displacement and high speed.
    """

    churning: float = 0.04
    """Of the barrel in oil, w^2 whatever the displacement (paper A section 3.8: "independent of displacement"), at 2500
    rev/min."""
    small: float = 0.05
    """At small displacement and high speed: w^3 (1 - D/D_max)^3, at 2500 rev/min and D = 0."""
    notch: float = 0.06
    """At the notches of the port plate, D dp^1.5 / w (paper A eq. 12), at 400 rev/min."""
    mixed: float = 0.04
    """Mixed lubrication that fades with speed, D dp exp(-n / 250 rev/min), at 400 rev/min."""


FADE = 250.0
"""Speed over which mixed lubrication fades [rev/min]; assumed, of the size of Y_4 in paper D table 3."""


def synthetic_map(
    name: str = "A6VM215", *, seed: int = 0, extra: Extra | None = None, printed: float = PRINTED
) -> LossMap:
    """A map of a motor of the library with extra losses; equal seeds give equal maps.

    Parameters: name a motor of the library with an MJ4 table; seed varies the extra losses by a fifth; printed step of
    the efficiency, 0 for none.
    """
    motor = library_motor(name)
    fit = TorqueLossFit(*(getattr(motor.loss, f) for f in TorqueLossFit._fields))
    sizes, rng = extra or Extra(), np.random.default_rng(seed)
    vary = dict(zip(("churning", "small", "notch", "mixed"), np.exp(SCATTER * rng.standard_normal(4)), strict=True))
    D_round = np.round(in_display(motor.D_max, "displacement") * np.array(SHARES), 1)
    axes = [
        np.array([from_display(float(x), kind) for x in values])
        for values, kind in ((D_round, "displacement"), (SPEEDS, "rotation"), (PRESSURES, "pressure"))
    ]
    D, n, dp = (a.ravel() for a in np.meshgrid(*axes, indexing="ij"))
    T_f = torque_loss(n, D, dp, fit) + _offset(D, n, dp, motor.D_max, fit, sizes, vary)
    if printed > 0.0:
        T_f = D * dp * (1.0 - np.round((1.0 - T_f / (D * dp)) / printed) * printed)
    keep = T_f < D * dp  # a motor that does not turn by itself has no efficiency
    source = f"SYNTHETIC map of {name}, seed {seed}"
    return LossMap(D[keep], n[keep], dp[keep], T_f[keep], motor.D_max, source, True)


def _offset(
    D: FloatArray, n: FloatArray, dp: FloatArray, D_max: float, fit: TorqueLossFit, extra: Extra, vary: dict[str, float]
) -> FloatArray:
    """Losses that MJ4 lacks [N m]."""
    n_hi, n_lo, p = from_display(2500.0, "rotation"), from_display(400.0, "rotation"), from_display(200.0, "pressure")
    at_speed, slow = torque_loss(n_hi, D_max, p, fit), torque_loss(n_lo, D_max, p, fit)
    motor, fade = LossMotor(D_max), from_display(FADE, "rotation")
    churning = extra.churning * at_speed * (n / n_hi) ** 2
    small = extra.small * at_speed * (n / n_hi) ** 3 * (1.0 - D / D_max) ** 3
    notch = extra.notch * slow * D / D_max * notch_loss(n, dp, 1.0, motor) / notch_loss(n_lo, p, 1.0, motor)
    mixed = extra.mixed * slow * D * dp / (D_max * p) * np.exp((n_lo - n) / fade)
    parts = {"churning": churning, "small": small, "notch": notch, "mixed": mixed}
    return np.asarray(sum(vary[k] * v for k, v in parts.items()))


def write_map(m: LossMap, path: str | Path) -> Path:
    """A map as CSV with efficiencies, as a supplier gives it; a synthetic one says so in its first line. Errors:
    SimulationError."""
    target = Path(path)
    lines = [f"# {m.source}"]
    if m.synthetic:
        lines.append(
            f"# {SYNTHETIC}: made from published MJ4 parameters and assumed extra losses; measured on no motor"
        )
    lines.append("D_m [cm^3/rev],n [rev/min],dp [bar],eta_hm [%]")
    for D, n, dp, T_f in zip(m.D_m, m.omega_m, m.dp_m, m.T_f, strict=True):
        cells = (
            in_display(D, "displacement"),
            in_display(n, "rotation"),
            in_display(dp, "pressure"),
            100.0 * (1.0 - T_f / (D * dp)),
        )
        lines.append(",".join(f"{c:.10g}" for c in cells))
    with atomic_file(target) as part:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return target
