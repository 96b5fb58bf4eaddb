"""A lowering in one piece of a random sea, told in a few words: tip and water are made when it is run."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from functools import cached_property

from stillhook.errors import LiftError
from stillhook.sea.motion.irregular import COARSE
from stillhook.sea.motion.motion import Still
from stillhook.sea.spectra.spectrum import Sea
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.realisation import Amplitudes, band, realise, tip_motion
from stillhook.sea.vessel.wave_field import samples, wave_field
from stillhook.spec.lift.lowering import Lowering


@dataclass(frozen=True, eq=False)
class InSea:
    """What thousands of runs of a table are given as: small, and quick to send to a cluster.

    lift: everything but tip and waves, which it must not have. sea, seed: which waves; rao: what moves in them; x, y:
    crane tip and payload from the vessel's reference point, forward and to port [m]. water: whether the payload feels
    the waves. left: part of the tip's motion that reaches the wire, 1 all of it (a flat cap on compensation of 80 %
    leaves 0.2); the water keeps its waves. amplitudes: random ones (Rayleigh) where largest values are gathered over
    seeds. repeat: period of the waves [s], None for the lift's duration, and not shorter: lifts of unlike durations
    meet the same waves where it is equal.
    """

    lift: Lowering
    sea: Sea = field(repr=False)
    seed: int
    rao: Rao = field(repr=False)
    x: float
    y: float
    water: bool = False
    left: float = 1.0
    amplitudes: Amplitudes = Amplitudes.FIXED
    repeat: float | None = None

    def __post_init__(self) -> None:
        if self.lift.waves is not None or not isinstance(self.lift.tip, Still):
            raise LiftError(
                f'lift "{self.lift.name}": it has a tip motion or waves already. Leave them to the sea, or run it as'
                " it is."
            )
        if self.repeat is not None and self.repeat < self.lift.duration:
            raise LiftError(
                f"repeat {self.repeat:g} s is shorter than the lift, {self.lift.duration:g} s. Give its duration or"
                " more."
            )

    @property
    def period(self) -> float:
        """Period after which the waves repeat [s]."""
        return self.lift.duration if self.repeat is None else self.repeat

    @cached_property
    def motion(self) -> bytes:
        """Hash of what tip and water follow from: runs in which it is equal are moved alike."""
        trains = [{"spectrum": t.spectrum.to_dict(), "beta": t.beta, "spread": t.spread} for t in self.sea.trains]
        place = [self.period, self.lift.depth, self.seed, self.x, self.y, self.water, self.left, self.amplitudes]
        return hashlib.sha256(json.dumps([trains, place], sort_keys=True).encode() + self.rao.digest).digest()

    @cached_property
    def spacing(self) -> float:
        """Spacing of the water's samples [s], 0 without water: equal in runs that can go side by side."""
        return self.period / samples(self.period, band(self.sea, self.period)[1]) if self.water else 0.0

    def lowering(self) -> Lowering:
        """The lowering, with `realise`, `tip_motion` and `wave_field` of the seed. Errors: SeaError for a sea without
        waves."""
        waves = realise(self.sea, self.period, self.seed, amplitudes=self.amplitudes, depth=self.lift.depth)
        tip = tip_motion(waves, self.rao, self.x, self.y, fine=COARSE)
        tip = tip if self.left == 1.0 else tip.times(self.left)
        water = wave_field(waves, self.x, self.y) if self.water else None
        return self.lift.model_copy(update={"tip": tip, "waves": water})
