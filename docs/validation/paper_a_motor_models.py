"""Paper A: which torque-loss model for a variable-displacement motor. From published parameters, and on SYNTHETIC
maps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from blocks import Blocks, panel, percent, picture, save
from numpy.typing import NDArray
from trials.campaigns.motor_map import Extra, synthetic_map

from stillhook.identify.motor.fit import CARDS, LossFit, LossModel, fit_loss
from stillhook.identify.motor.map import LossMap
from stillhook.identify.motor.rank import borrowed, rank_losses, residual_share
from stillhook.physics.hydraulics.motor import torque_loss
from stillhook.report.plots.colours import COLOURS
from stillhook.thesis.losses import BAR, CC, RPM, TERMS, loss_parameters, term_shares, terms  # noqa: F401  # in the claims

PICTURE = "paper-a-motor-models.png"
MOTORS = ("A6VM280", "A6VM215", "A6VM170")
SEEDS = (0, 1)
EVERY = 7  # of the 22 speeds, ends included, where models are ranked: that fits each map a hundred times over
NONE = Extra(churning=0.0, small=0.0, notch=0.0, mixed=0.0)
OLDER = (LossModel.WILSON, LossModel.SCHLOSSER, LossModel.THOMA, LossModel.PACEY)
NEW = (LossModel.MJ6, LossModel.MJ5, LossModel.MJ4)
SHOWN = (*NEW, LossModel.MJ1, LossModel.MJ2, LossModel.MJ3, LossModel.THOMA, LossModel.PACEY, LossModel.ORTWIG)
BLIND = (LossModel.JEONG, LossModel.SCHLOSSER, LossModel.WILSON)
HALF = 150.0 / 280.0  # paper A judges above 150 cm^3/rev of the 280 motor
CLAIMED = 0.01  # of nominal torque, paper A section 4


def times(factor: float) -> Extra:
    """All extra losses times this."""
    e = Extra()
    return Extra(factor * e.churning, factor * e.small, factor * e.notch, factor * e.mixed)


@dataclass(frozen=True)
class Variant:
    """One kind of map: what is beside MJ4, and whether MJ2 takes MJ4's place as its base."""

    label: str
    extra: Extra
    base: LossModel = LossModel.MJ4


VARIANTS = (
    Variant("**as above**", Extra()),
    Variant("extra losses halved", times(0.5)),
    Variant("extra losses doubled", times(2.0)),
    Variant("without the notches", replace(Extra(), notch=0.0)),
    Variant("without churning", replace(Extra(), churning=0.0)),
    Variant("without the loss at small displacement", replace(Extra(), small=0.0)),
    Variant("without mixed lubrication", replace(Extra(), mixed=0.0)),
    Variant("without notches and mixed lubrication", replace(Extra(), notch=0.0, mixed=0.0)),
    Variant("no extra losses, only rounding", NONE),
    Variant("base MJ2 instead of MJ4", Extra(), LossModel.MJ2),
)


@cache
def made(name: str, seed: int, v: Variant) -> LossMap:
    """A synthetic map."""
    m = synthetic_map(name, seed=seed, extra=v.extra)
    if v.base is LossModel.MJ4:
        return m
    under = fit_loss(smooth(name), v.base)
    return replace(m, T_f=m.T_f + under.torque(m.omega_m, m.D_m, m.dp_m) - published(name, m.omega_m, m.D_m, m.dp_m))


@cache
def smooth(name: str) -> LossMap:
    """The published MJ4 itself on the grid of the maps: no extra loss, no rounding."""
    return synthetic_map(name, extra=NONE, printed=0.0)


def published(
    name: str, n: NDArray[np.float64], D: NDArray[np.float64] | float, dp: NDArray[np.float64] | float
) -> NDArray[np.float64]:
    return np.asarray(torque_loss(n, D, dp, loss_parameters(name)))


@cache
def fitted(name: str, seed: int, v: Variant, model: LossModel) -> LossFit:
    return fit_loss(made(name, seed, v), model)


def share(name: str, seed: int, v: Variant, model: LossModel) -> float:
    """Root mean square error over the mean nominal torque of the map [-]."""
    return fitted(name, seed, v, model).rms_share


CASES = [(name, seed) for name in MOTORS for seed in SEEDS]
AS_ABOVE = VARIANTS[0]


def term_rows() -> Iterator[tuple[str, ...]]:
    for name, D in (("A6VM280", 250.0), ("A6VM280", 280.0), ("A6VM215", 192.0), ("A6VM170", 152.0)):
        yield f"{name}, {D:.0f} cm³/rev", *(percent(s) for s in term_shares(name, D).values())


def upper(m: LossMap) -> LossMap:
    """The cells above 150/280 of the full displacement."""
    return m.at(m.D_m >= HALF * m.D_max * 0.999)


def distance(name: str, model: LossModel) -> float:
    """Least root mean square distance of a model from the published MJ4 over the mean nominal torque, above 150/280
    [-]."""
    return fit_loss(upper(smooth(name)), model).rms_share


def bound(name: str) -> float:
    """What an error of 1 % of nominal torque in every cell amounts to there [-]."""
    T_N = upper(smooth(name)).T_N
    return CLAIMED * float(np.sqrt(np.mean(T_N**2)) / T_N.mean())


def forced_rows() -> Iterator[dict[str, Any]]:
    name, limit = "A6VM280", bound("A6VM280")
    others = (LossModel.PACEY, LossModel.THOMA, LossModel.ORTWIG, LossModel.MJ3, LossModel.MJ2, LossModel.MJ1)
    for model in (*BLIND, *others):
        alone = fit_loss(smooth(name).full(), model).rms_share
        far = distance(name, model)
        yield {**locals()}


def percent2(part: float) -> str:
    return f"{100.0 * part:.2f} %"


def order_rows() -> Iterator[tuple[str, ...]]:
    for model in (*SHOWN, *BLIND):
        cells = []
        for name in MOTORS:
            errors = [share(name, seed, AS_ABOVE, model) for seed in SEEDS]
            ends = list(dict.fromkeys(f"{100.0 * e:.2f}" for e in (min(errors), max(errors))))
            cells.append(" to ".join(ends) + " %")
        yield CARDS[model].title, str(len(CARDS[model].names)), *cells, percent2(full(model))


def full(model: LossModel, name: str = "A6VM280", seed: int = 0) -> float:
    """The same at full displacement alone (paper A figure 3) [-]."""
    return fit_loss(made(name, seed, AS_ABOVE).full(), model).rms_share


def holds(v: Variant) -> int:
    """Maps on which MJ4, MJ5 and MJ6 are the best three; Pacey and Ortwig are far behind on every one."""
    return sum(max(share(n, s, v, x) for x in NEW) < min(share(n, s, v, x) for x in SHOWN[3:7]) for n, s in CASES)


def beats(v: Variant) -> int:
    """Maps on which MJ5 is better than MJ6."""
    return sum(share(n, s, v, LossModel.MJ5) < share(n, s, v, LossModel.MJ6) for n, s in CASES)


def variant_rows() -> Iterator[tuple[str, ...]]:
    for v in VARIANTS:
        yield v.label, *(percent2(share("A6VM280", 0, v, x)) for x in SHOWN[:7]), f"{holds(v)} of {len(CASES)}"


def chosen() -> list[LossModel]:
    """What the ranking recommends, one map a motor."""
    out = []
    for name, seed in zip(MOTORS, (0, 1, 0), strict=True):
        m = made(name, seed, AS_ABOVE)
        out.append(rank_losses(m.at(np.isin(m.omega_m, np.unique(m.omega_m)[::EVERY]))).recommended)
    return out


Mask = NDArray[np.bool_]


def region(m: LossMap, D: tuple[float, float], n: tuple[float, float]) -> Mask:
    """Cells at 100, 200 and 300 bar, displacement in cm^3/rev of a 280 motor, speed in rev/min; upper ends are out."""
    p, size, speed = m.dp_m / BAR, m.D_m / m.D_max * 280.0, m.omega_m / RPM
    picked = np.isin(np.round(p), (100, 200, 300))
    return picked & (size >= D[0]) & (size < D[1]) & (speed > n[0] - 0.5) & (speed < n[1] - 0.5)


REGIONS: Mapping[str, tuple[tuple[float, float], tuple[float, float]]] = {
    "150 cm³/rev and more, up to 1500 rev/min": ((149.9, 999.0), (0.0, 1501.0)),
    "150 cm³/rev and more, above 1500 rev/min": ((149.9, 999.0), (1501.0, 9999.0)),
    "below 150 cm³/rev, up to 2000 rev/min": ((0.0, 149.9), (0.0, 2001.0)),
    "below 150 cm³/rev, above 2000 rev/min": ((0.0, 149.9), (2001.0, 9999.0)),
}
ERROR_VARIANTS = (AS_ABOVE, VARIANTS[1], VARIANTS[2], VARIANTS[5])


def worst(where: str, v: Variant) -> float:
    """Largest error of MJ4 over nominal torque in a region of the A6VM280's maps, all seeds [-]."""
    return max(
        float(np.abs(residual_share(m, fitted("A6VM280", s, v, LossModel.MJ4)))[region(m, *REGIONS[where])].max())
        for s in SEEDS
        for m in (made("A6VM280", s, v),)
    )


def region_rows() -> Iterator[tuple[str, ...]]:
    said = ("typically below 0.5 %", "within 1 %", "less accurate", "less accurate")
    for where, theirs in zip(REGIONS, said, strict=True):
        yield where, theirs, *(f"{100.0 * worst(where, v):.1f} %" for v in ERROR_VARIANTS)


def borrowed_rows() -> Iterator[tuple[str, ...]]:
    for name in MOTORS:
        own = share(name, 0, AS_ABOVE, LossModel.MJ4)
        others = {b.name: b for b in borrowed(smooth(name))}
        cells = [
            f"{100.0 * others[o].unscaled:.1f} %, {percent2(others[o].scaled)}" if o != name else "" for o in MOTORS
        ]
        yield name, *cells, percent2(own)


def lent(scaled: bool) -> tuple[float, float]:
    """Least and largest error of one motor's published parameters on another one's."""
    others = [b for n in MOTORS for b in borrowed(smooth(n)) if b.name in MOTORS and b.name != n]
    errors = [b.scaled if scaled else b.unscaled for b in others]
    return min(errors), max(errors)


def fixed_gain(model: LossModel) -> float:
    """Least ratio of the best older model's error to this one's at full displacement, over all maps."""
    return min(min(full(o, n, s) for o in OLDER) / full(model, n, s) for n, s in CASES)


def claims() -> dict[str, Any]:
    """Numbers of the claims."""
    of = term_shares("A6VM280", 250.0)
    largest = sorted(of, key=lambda k: -of[k])[:2]
    ortwig, jeong = fixed_gain(LossModel.ORTWIG), fixed_gain(LossModel.JEONG)
    all_hold, doubled, other = holds(AS_ABOVE), holds(VARIANTS[2]), holds(VARIANTS[-1])
    gains = [1.0 - share(n, s, AS_ABOVE, LossModel.MJ5) / share(n, s, AS_ABOVE, LossModel.MJ4) for n, s in CASES]
    old = (LossModel.THOMA, LossModel.PACEY, LossModel.ORTWIG)
    leads = [share(n, s, AS_ABOVE, x) / share(n, s, AS_ABOVE, LossModel.MJ4) for n, s in CASES for x in old]
    names = [CARDS[x].title for x in chosen()]
    large, small = (max(worst(w, AS_ABOVE) for w in part) for part in (list(REGIONS)[:2], list(REGIONS)[2:]))
    plain, alike = lent(False), lent(True)
    by_us, on_ours = "built into our maps", "reproduced, on our maps"
    return locals()


def compute() -> tuple[Blocks, None]:
    """Blocks of the page, its claims; the picture needs no more."""
    found = claims()
    blocks = {
        "claims": found,
        "terms": term_rows(),
        "forced": forced_rows(),
        "order": order_rows(),
        "variants": variant_rows(),
        "regions": region_rows(),
        "borrowed": borrowed_rows(),
    }
    return blocks, None


def draw(_: None) -> None:
    """Errors by model, terms over speed, errors over speed, map against model."""
    title = (
        "SYNTHETIC maps (points and errors): made from published parameters and assumed extra losses, measured on no"
    )
    figure = picture(12.0, 8.6, f"{title} motor", "large")
    axes = figure.subplots(2, 2)
    _errors(axes[0, 0])
    terms().draw_on(axes[0, 1], "Terms of the published MJ4, A6VM280, 250 cm³/rev, 200 bar (fig. 7)")
    _over_speed(axes[1, 0])
    _map_and_model(axes[1, 1])
    save(figure, PICTURE)


def _errors(ax) -> None:
    models = (*BLIND[::-1], LossModel.PACEY, LossModel.ORTWIG, LossModel.THOMA, *SHOWN[5:2:-1], *NEW[::-1])
    x = np.arange(len(models))
    ax.bar(x - 0.2, [100.0 * full(m) for m in models], 0.4, color=COLOURS[1], label="full displacement alone (fig. 3)")
    errors = [100.0 * share("A6VM280", 0, AS_ABOVE, m) for m in models]
    ax.bar(x + 0.2, errors, 0.4, color=COLOURS[0], label="whole map (figs 4, 5)")
    ax.set_yscale("log")
    ax.set_xticks(x, [CARDS[m].title for m in models], rotation=60)
    ax.set_ylabel("RMS error [% of mean nominal torque]")
    ax.set_title("A6VM280, first map: error by model", fontsize="medium")
    ax.legend(fontsize="small", frameon=False)
    ax.grid(alpha=0.3, axis="y")


def _over_speed(ax) -> None:
    m = made("A6VM280", 0, AS_ABOVE)
    error = 100.0 * residual_share(m, fitted("A6VM280", 0, AS_ABOVE, LossModel.MJ4))
    for colour, D in zip(COLOURS, (280, 224, 168, 112, 84, 56), strict=False):
        at = (np.round(m.D_m / CC) == D) & (np.round(m.dp_m / BAR) == 200)
        ax.plot(m.omega_m[at] / RPM, error[at], "o-", color=colour, ms=3, lw=1.0, label=f"{D} cm³/rev")
    ax.axhspan(-1.0, 1.0, color="#888888", alpha=0.15, lw=0)
    title = "A6VM280, first map less MJ4 at 200 bar (as figs 8, 9)"
    panel(ax, title, "motor speed [rev/min]", "error [% of nominal torque]")


def _map_and_model(ax) -> None:
    m, fit = made("A6VM215", 0, AS_ABOVE), fitted("A6VM215", 0, AS_ABOVE, LossModel.MJ4)
    for colour, D in zip(COLOURS, (215.0, 172.0, 129.0, 86.0, 43.0), strict=False):
        at = (np.abs(m.D_m / CC - D) < 0.5) & (np.round(m.dp_m / BAR) == 200)
        n = m.omega_m[at]
        ax.plot(n / RPM, m.T_f[at], ".", color=colour, ms=5)
        ax.plot(n / RPM, fit.torque(n, D * CC, 200.0 * BAR) + 0.0 * n, color=colour, lw=1.2, label=f"{D:.0f} cm³/rev")
    ax.set_ylim(bottom=0.0)
    title = "A6VM215 at 200 bar: first map (points) and MJ4 (lines) (as 2.11, D fig. 3)"
    panel(ax, title, "motor speed [rev/min]", "torque loss [N m]")
