"""What the heave filter of a motion unit keeps from the PLC in waves: per metre of wave, and as a motion of the tip."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.motion.motion import CYCLE, Motion, Sample
from stillhook.sea.vessel.motion_unit import MotionUnit
from stillhook.sea.vessel.rao import Rao, VerticalMotion
from stillhook.sea.vessel.realisation import Realisation, Resolution, WaveField, tip_motion, wave_field


@dataclass(frozen=True)
class FilteredMotion:
    r"""Part of the tip's motion and part of the heave that the unit's filter loses, per metre of wave: a
    `VerticalMotion` of places of the crane tip.

    .. math:: a\,z_{tip} + b\,(1 - H)\,\eta_{unit}

    The PLC is given the tip less what is lost (1, -1), since roll and pitch pass the filter. moves: what moves in the
    place of the tip.
    """

    vessel: Rao
    unit: MotionUnit
    tip: complex
    lost: complex
    moves: VerticalMotion | None = None

    @property
    def name(self) -> str:
        """What moves."""
        return f"{self.vessel.name}, {self.unit.describe()}"

    @property
    def omega(self) -> FloatArray:
        """Frequencies of the vessel's table [rad/s]."""
        return self.vessel.omega

    def vertical(self, omega: ArrayLike, beta: ArrayLike, x: float, y: float) -> ComplexArray:
        """Of the tip over (x, y) [m], per metre of wave: (k,), or (j, k) for headings (j,)."""
        omega = np.atleast_1d(np.asarray(omega, dtype=np.float64))
        heave = self.vessel.vertical(omega, beta, *self.unit.at[:2])
        lost = (1.0 - self.unit.response(omega)) * heave
        return np.asarray(self.tip * (self.moves or self.vessel).vertical(omega, beta, x, y) + self.lost * lost)


@dataclass(frozen=True)
class FilteredTip(Motion):
    """The crane tip, of which the PLC is given what a heave filter leaves: all but `lost`."""

    tip: Motion
    lost: Motion
    kind: ClassVar[str] = "filtered"

    @property
    def duration(self) -> float | None:
        return min((d for m in (self.tip, self.lost) if (d := m.duration) is not None), default=None)

    @property
    def separate(self) -> bool:
        return True

    def sample(self, t: ArrayLike) -> Sample:
        return self.tip.sample(t)

    def measured(self, t: ArrayLike, h: float = CYCLE) -> Sample:
        s, v, a = (x - y for x, y in zip(self.tip.measured(t, h), self.lost.sample(t), strict=True))
        return s, v, a

    def describe(self) -> str:
        return f"{self.tip.describe()}; the heave filter of the motion unit loses {self.lost.describe()}"

    def to_dict(self) -> dict[str, Any]:
        return {"type": self.kind, "tip": self.tip.to_dict(), "lost": self.lost.to_dict()}

    @classmethod
    def from_dict(cls, data: dict[str, Any], read: Callable[[dict[str, Any]], Motion]) -> Self:
        """The motion that `to_dict` stored; read: makes a motion of what its `to_dict` stored."""
        return cls(read(data["tip"]), read(data["lost"]))


def moved_by(
    waves: Realisation,
    rao: Rao,
    x: float,
    y: float,
    *,
    water: bool,
    left: float,
    resolution: Resolution,
    unit: MotionUnit | None = None,
    moves: VerticalMotion | None = None,
) -> tuple[IrregularTip | FilteredTip, WaveField | None]:
    """Motion of the crane tip over (x, y) [m] from the vessel's reference point, and the water there, of one
    realisation. water: whether it is wanted; left: part of the tip's motion that is kept, and with a unit all that its
    filter loses: of every wave no less than what a winch leaves that follows exactly. moves: what moves in the place of
    the tip, of which all is kept."""

    def moving(a: float, b: float) -> IrregularTip:
        assert unit is not None
        return tip_motion(waves, FilteredMotion(rao, unit, a, b, moves), x, y, fine=resolution.angle)

    around = wave_field(waves, x, y) if water else None
    part = left if moves is None else 1.0
    tip = tip_motion(waves, moves or rao, x, y, fine=resolution.angle)
    if unit is None:
        return tip if part == 1.0 else tip.times(part), around
    lost = moving(0.0, 1.0)
    if left == 1.0:
        return FilteredTip(tip, lost), around
    kept = moving(part, 1.0 - left)
    c = np.where(np.abs(kept.amplitudes) >= np.abs(lost.amplitudes), kept.amplitudes, lost.amplitudes)
    return IrregularTip(c, kept.repeat, source=kept.source, report=kept.report, fine=kept.fine), around
