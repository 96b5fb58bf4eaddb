"""System frictions of several sets side by side: Coulomb, stiction and viscous parts over motor speed, with what is
known of them."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import IdentifyError
from stillhook.library.parameter_sets import Evidence, FrictionSet
from stillhook.physics.load_path.drum import layer_diameter
from stillhook.physics.scalar import G
from stillhook.report.kit import axis, display, legend, panels
from stillhook.report.plots.colours import COLOURS
from stillhook.spec.crane import Crane, SystemFriction
from stillhook.statistics.estimate import t_factor
from stillhook.units import in_display, show

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FASTEST = 2000.0
"""Highest motor speed of the figure [rev/min], as in Moslatt 2020 paper D figure 8."""
AT = (0.0, 100.0, 250.0, 500.0, 1000.0, 2000.0)
"""Motor speeds of the table [rev/min]."""
PARTS = ("total", "Coulomb", "stiction", "viscous")
SLOPE_STEP = 1e-4
"""Share of a parameter (or of its deviation) by which a slope is taken."""


@dataclass(frozen=True)
class Split:
    """Friction of one set over motor speed, per motor shaft [N m]: coulomb Y_2 + Y_6 T_d, stiction (Y_1 T_d + Y_3)
    exp(-|n|/Y_4), viscous Y_5 omega, total their sum; half half the width of the total's 95 % band, None where the set
    has no evidence.
    """

    item: FrictionSet
    omega: FloatArray
    coulomb: FloatArray
    stiction: FloatArray
    viscous: FloatArray
    half: FloatArray | None

    @property
    def total(self) -> FloatArray:
        return self.coulomb + self.stiction + self.viscous

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Whether the data reach a speed; everywhere where the range of the data is not stated."""
        ends = self.item.evidence.omega_m if self.item.evidence is not None else None
        return np.full(self.omega.shape, True) if ends is None else (self.omega >= ends[0]) & (self.omega <= ends[1])

    def part(self, name: str) -> FloatArray:
        """One of `PARTS`."""
        return {"total": self.total, "Coulomb": self.coulomb, "stiction": self.stiction, "viscous": self.viscous}[name]


def split(item: FrictionSet, T_d: float, omega: FloatArray) -> Split:
    """Friction of a set at drum torque T_d [N m] over motor speeds omega [rad/s]. Source: Moslatt 2020 eq. 2.7 and
    paper D figure 8."""
    half = band(item.system, item.evidence, T_d, omega) if item.evidence is not None else None
    return Split(item, omega, *_parts(item.system, T_d, omega), half)


def _parts(s: SystemFriction, T_d: float, omega: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    speed = np.abs(omega)
    return np.full_like(speed, s.Y_2 + s.Y_6 * T_d), (s.Y_1 * T_d + s.Y_3) * np.exp(-speed / s.Y_4), s.Y_5 * speed


def band(system: SystemFriction, evidence: Evidence, T_d: float, omega: FloatArray) -> FloatArray:
    """Half the width of the 95 % confidence band of the total friction [N m]: covariance carried through to first
    order, Student's t."""
    slopes = []
    for name in evidence.names:
        value = getattr(system, name)
        h = SLOPE_STEP * (abs(value) or evidence.deviation(name) or 1.0)
        up, down = (sum(_parts(system.model_copy(update={name: value + s * h}), T_d, omega)) for s in (1.0, -1.0))
        slopes.append((up - down) / (2.0 * h))
    variance = np.einsum("in,ij,jn->n", np.array(slopes), evidence.matrix, np.array(slopes))
    return np.asarray(t_factor(evidence.dof) * np.sqrt(np.maximum(variance, 0.0)))


def drum_torque(crane: Crane, load: float, layer: int | None = None) -> float:
    """Drum torque of a load [kg] and the crane's hook on a layer (default: the outermost) [N m]. Errors:
    IdentifyError."""
    n = crane.drum.layers if layer is None else layer
    if not 1 <= n <= crane.drum.layers:
        raise IdentifyError(f'layer = {n}: the drum of "{crane.name}" has layers 1 to {crane.drum.layers}.')
    if not 0.0 <= load <= crane.SWL:
        raise IdentifyError(
            f'load {show(load, "mass")}: "{crane.name}" lifts 0 t to {show(crane.SWL, "mass")}. Give a load in between.'
        )
    return (load + crane.hook_mass) * G * 0.5 * float(layer_diameter(float(n), drum_record(crane)))


def notes(splits: Sequence[Split], T_d: float) -> list[str]:
    """What must be known before the numbers are used: extrapolations, and what the data of a set cannot determine.
    One line each."""
    out = []
    for s in splits:
        e = s.item.evidence
        if e is None:
            continue
        if e.T_d is not None and not e.T_d[0] <= T_d <= e.T_d[1]:
            ends = f"{show(e.T_d[0], 'drum_torque')} to {show(e.T_d[1], 'drum_torque')}"
            out.append(f"{s.item.name}: {show(T_d, 'drum_torque')} of drum torque is beyond its data, {ends}")
        if e.omega_m is not None and not s.inside.all():
            ends = f"{show(e.omega_m[0], 'rotation')} to {show(e.omega_m[1], 'rotation')}"
            out.append(f"{s.item.name}: its data are of {ends}; the rest is extrapolated")
        out += [f"{s.item.name}: {statement}" for statement in e.statements]
    return out


def table(splits: Sequence[Split]) -> list[dict[str, Any]]:
    """One row a set, SI: its parts at standstill and at 1000 rev/min, and the total at `AT` with half the width of its
    band."""
    rows = []
    for s in splits:
        speed = s.omega * 30.0 / np.pi
        row = {
            "set": s.item.name,
            "title": s.item.title,
            "coulomb": float(s.coulomb[0]),
            "stiction": float(s.stiction[0]),
            "viscous_1000": float(np.interp(1000.0, speed, s.viscous)),
            "total": {f"{n:g} rev/min": float(np.interp(n, speed, s.total)) for n in AT},
            "half_95": {f"{n:g} rev/min": None if s.half is None else float(np.interp(n, speed, s.half)) for n in AT},
            "sources": provenance(s.item),
        }
        rows.append(row)
    return rows


def provenance(item: FrictionSet | Any) -> list[str]:
    """Where the values of a set are from, each source once, with its kind; and the data that they were fitted to."""
    sources = list(dict.fromkeys(f"{s.kind.value}: {s.text}" for s in item.sources.values()))
    if item.evidence is not None and not any(item.evidence.data in text for text in sources):
        sources.append(f"fitted to: {item.evidence.data}")
    return sources


def figure(splits: Sequence[Split], T_d: float, description: str = "") -> Figure:
    """Total friction and its three parts over motor speed, one colour a set, bands where they are known, dotted where a
    set's own data do not reach, sources below.

    Source of the arrangement: Moslatt 2020 paper D figure 8. description: in words, what gives the drum torque.
    """
    caption = "\n".join(
        line
        for s in splits
        for line in textwrap.wrap(f"{s.item.name}: {'; '.join(provenance(s.item))}", 130, subsequent_indent="    ")
    )
    torque = f"drum torque {in_display(T_d, 'drum_torque'):.4g} kN m"
    title = f"System friction at {torque}{f' ({description})' if description else ''}"
    size = (10.0, 8.2 + 0.17 * caption.count("\n"))
    picture, axes = panels(2, 2, size, title, sharex=True, sharey=True)
    for name, ax in zip(PARTS, axes.flat, strict=True):
        for colour, s in zip(COLOURS * (1 + len(splits) // len(COLOURS)), splits, strict=False):
            n = display(s.omega, "rotation")
            ax.plot(n, np.where(s.inside, s.part(name), np.nan), color=colour, lw=1.6, label=s.item.name)
            ax.plot(n, np.where(s.inside, np.nan, s.part(name)), color=colour, lw=1.2, ls=":")
            if name == "total" and s.half is not None:
                ax.fill_between(
                    n, s.total - s.half, s.total + s.half, color=colour, alpha=0.2, lw=0.0, label=f"{s.item.name}, 95 %"
                )
        axis(ax, title=name)
    axes[0, 0].set_ylim(bottom=0.0)
    axes[0, 0].set_xlim(0.0, FASTEST)
    for ax in axes[1]:
        axis(ax, "motor speed [rev/min]")
    for ax in axes[:, 0]:
        axis(ax, y="friction torque per motor shaft [N m]")
    if not all(s.inside.all() for s in splits):
        axes[0, 0].plot([], [], color="#777777", lw=1.2, ls=":", label="beyond the data of its set")
    legend(axes[0, 0])
    picture.supxlabel(caption, fontsize="x-small", x=0.02, ha="left")
    return picture


def speeds() -> FloatArray:
    """Motor speeds of the figure [rad/s]."""
    return np.linspace(0.0, FASTEST, 401) * np.pi / 30.0
