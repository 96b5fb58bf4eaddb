"""How well runs tell an oscillation of the winch from what the tip does to it, against two judges that know nothing of
how it is found."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from blocks import Blocks
from numpy.typing import NDArray

from stillhook.analysis.loop_stability.governing import place_limits
from stillhook.analysis.loop_stability.places import Place
from stillhook.engine.scenario.summary import OSCILLATES
from stillhook.engine.simulate import simulate
from stillhook.kernels.oscillation import SMALLEST
from stillhook.library import load_crane
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.motion.motion import Motion, Profile, Sine, Still
from stillhook.sea.spectra.parametric import Jonswap
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Operator, Scenario

SLOW_PAGE = True
CRANES = (
    "nov-250t",
    "nov-100t-pure-active",
    "nov-250t-secondary",
    "utility-20t-open-circuit",
    "nov-100t-cylinder",
    "nov-100t-electric",
)
TIMES = (0.5, 0.9, 1.1, 1.5, 3.0)
"""Gains over that of marginal stability of the linearised engine on its own wire."""
SPEEDS = (0.5, 2.0, 8.0)
"""Even speeds of the tip, up and down [m/min]; 0 is a load that is held."""
WIRES = (15.0, 100.0, 400.0)
STEADY, LATE = 90.0, 15.0
"""Length of a run with an even tip, and of its last two parts by which the series judges [s]."""
GAINS = (0.1, 0.3, 1.0, 3.0, 10.0)
"""Position gains in waves, over that which the linearised engine has as its limit with 90 % of the SWL on 100 m of
wire, the tip going up at 8 m/min."""
WAVES, COUNTED = 200.0, 60.0
"""Length of a run in waves, and of its last part by which two runs are compared [s]."""
STEP = "10 mm"
"""Set-point step at 5 s by which the second of two runs differs."""
EVERY = "50 ms"
FloatArray = NDArray[np.float64]


class Tally(NamedTuple):
    """Runs by judge and status: oscillation found, missed, none that was named, none."""

    found: int = 0
    missed: int = 0
    false: int = 0
    none: int = 0

    def cells(self) -> tuple[str, ...]:
        return tuple(str(n) for n in self)


def with_gain(crane: Crane, K_p: float) -> Crane:
    return crane.model_copy(update={"control": crane.control.model_copy(update={"K_p": K_p})})


def limit_at(crane: Crane, load: float, s_w: float, speed: float) -> float | None:
    """Gain beyond which the linearised engine oscillates [1/m]; None where it does at any gain, and for a load
    that is held, about which the engine is not linearised."""
    if speed == 0.0:
        return None
    (at,) = place_limits(crane, crane.plant.type.default_mode, [Place(load, s_w, speed / 60.0)])
    return at.gains.high if at.gains.any and np.isfinite(at.gains.high) else None


def even(speed: float, time: float) -> Motion:
    if speed == 0.0:
        return Still()
    course = [(0.0, 0.0), (4.0, speed), (time + 4.0, speed), (time + 8.0, 0.0)]
    return Profile([(f"{t!r} s", f"{v!r} m/min") for t, v in course])


def sea(Hs: float, Tp: float, seed: int, repeat: float = 400.0) -> IrregularTip:
    """The tip of a ship that follows long waves: a spectrum times 1 / (1 + (omega / 0.9)^8)."""
    n = int(4.0 * repeat / (2.0 * np.pi))
    omega = 2.0 * np.pi * np.arange(n + 1) / repeat
    S = np.zeros(n + 1)
    S[1:] = Jonswap(Hs, Tp).density(omega[1:]) / (1.0 + (omega[1:] / 0.9) ** 8)
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, n + 1)
    return IrregularTip(np.sqrt(4.0 * np.pi * S / repeat) * np.exp(1j * phase), repeat)


TIPS: Mapping[str, Motion] = {
    "sine 0.3 m 4 s": Sine(height="0.3 m", period="4 s"),
    "sine 0.5 m 6 s": Sine(height="0.5 m", period="6 s"),
    "sine 1 m 12 s": Sine(height="1 m", period="12 s"),
    "Hs 0.5 m, Tp 6 s": sea(0.5, 6.0, 1),
    "Hs 1 m, Tp 8 s": sea(1.0, 8.0, 2),
    "Hs 2 m, Tp 10 s": sea(2.0, 10.0, 3),
    "Hs 3.5 m, Tp 14 s": sea(3.5, 14.0, 4),
}


def scenario(load: float, s_w: float, tip: Motion, duration: float, **more: Any) -> Scenario:
    of = {"duration": f"{duration!r} s", "warm_up": "20 s"} | more
    return Scenario(load=f"{load!r} kg", s_w=f"{s_w!r} m", tip=tip, **of)


class Steady(NamedTuple):
    """A run with an even tip: gain over the limit (None: the plant oscillates at any gain), status, numbers and late
    swing of the wire's speed [m/s]."""

    crane: str
    part: float | None
    speed: float
    named: bool
    v_w: float
    late: float
    before: float

    @property
    def truth(self) -> bool:
        """The series swings, and not less at the end."""
        return self.late >= SMALLEST and self.late > 0.8 * self.before


def steady_runs(name: str) -> list[Steady]:
    crane = load_crane(name)
    load, mode = 0.9 * crane.SWL, crane.plant.type.default_mode
    cranes, cases, what = [], [], []
    for s_w, speed in itertools.product(WIRES, (0.0, *(s * v for v in SPEEDS for s in (1.0, -1.0)))):
        if name == "nov-100t-cylinder" and abs(speed) > 2.0:
            continue  # its stroke is over before
        limit = limit_at(crane, load, s_w, speed)
        gains = [(None, crane.control.K_p)] if limit is None else [(x, x * limit) for x in TIMES]
        for part, K_p in gains:
            cranes.append(with_gain(crane, K_p))
            cases.append(scenario(load, s_w, even(speed, STEADY), STEADY, mode=mode, warm_up="10 s"))
            what.append((part, speed))
    run = simulate(cranes, cases, series=True, every=EVERY, on_failure="mark")
    t, v = run["time"].values, run["v_w"].values.reshape(len(cases), -1)
    late, before = (
        np.ptp(v[:, (t > STEADY - k * LATE) & (t <= STEADY - (k - 1.0) * LATE)], axis=1) for k in (1.0, 2.0)
    )
    named, swing = (run[x].values for x in ("status", "oscillation_v_w"))
    return [
        Steady(name, part, speed, OSCILLATES in str(named[i]), *map(float, (swing[i], late[i], before[i])))
        for i, (part, speed) in enumerate(what)
        if np.isfinite(late[i])
    ]


class InWaves(NamedTuple):
    """A run in waves: gain over the limit, status, and how far two runs that begin differently are apart at the end
    [m/s]."""

    crane: str
    tip: str
    part: float
    named: bool
    apart: float

    @property
    def truth(self) -> bool:
        """What the tip does not determine is the winch's own."""
        return self.apart >= SMALLEST


def runs_in_waves(name: str) -> list[InWaves]:
    crane = load_crane(name)
    mode = crane.plant.type.default_mode
    limit = limit_at(crane, 0.9 * crane.SWL, 100.0, 8.0) or crane.control.K_p
    cranes, cases, what = [], [], []
    for part, share, s_w, tip in itertools.product(GAINS, (0.3, 0.9), (15.0, 100.0), TIPS):
        for operator in (Operator(), Operator(steps=(("5 s", STEP),))):
            cranes.append(with_gain(crane, part * limit))
            cases.append(scenario(share * crane.SWL, s_w, TIPS[tip], WAVES, mode=mode, operator=operator))
        what.append((part, tip))
    run = simulate(cranes, cases, series=True, every=EVERY, on_failure="mark")
    v = run["v_w"].values.reshape(len(cases), -1)[:, run["time"].values > WAVES - COUNTED]
    apart = np.ptp(v[1::2] - v[::2], axis=1)
    return [
        InWaves(name, tip, part, OSCILLATES in str(run["status"].values[2 * i]), float(apart[i]))
        for i, (part, tip) in enumerate(what)
        if np.isfinite(apart[i])
    ]


def tallied(rows: Sequence[Any]) -> Tally:
    pairs = [(row.truth, row.named) for row in rows]
    return Tally(*(pairs.count(x) for x in itertools.product((True, False), repeat=2)))


def share(part: int, whole: int) -> str:
    return f"{part} of {whole}"


def compute() -> tuple[Blocks, None]:
    steady = [row for name in CRANES for row in steady_runs(name)]
    waves = [row for name in CRANES for row in runs_in_waves(name)]
    parts = (*TIMES, None)
    a, b = tallied(steady), tallied(waves)

    def by(rows: Sequence[Any], field: str, values: Mapping[Any, str]) -> list[tuple[str, ...]]:
        return [(text, *tallied([r for r in rows if getattr(r, field) == x]).cells()) for x, text in values.items()]

    cranes = {name: name for name in CRANES}

    blocks = {
        "claims": locals(),
        "steady": by(steady, "crane", cranes),
        "gain": by(steady, "part", {x: "at any gain" if x is None else f"{x:g}" for x in parts}),
        "waves": by(waves, "crane", cranes),
        "tips": by(waves, "tip", {tip: tip for tip in TIPS}),
        "gains": by(waves, "part", {x: f"{x:g}" for x in GAINS}),
    }
    return blocks, None
