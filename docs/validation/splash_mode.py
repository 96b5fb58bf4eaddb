"""Splash-zone mode against manual and AHC on payloads through the surface, sixteen seeds each, and how far its gain can
be raised."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from blocks import Blocks, Rows, percent
from numpy.typing import NDArray

from stillhook.engine.simulate import simulate
from stillhook.formats.lift_file import LiftFile, load_lift
from stillhook.library import load_crane
from stillhook.library.catalogue import payloads, read_payload
from stillhook.physics.scalar import G
from stillhook.sea.spectra.text import parse_sea
from stillhook.sea.vessel.realisation import realise, tip_motion, wave_field
from stillhook.spec.lift.lowering import Lowering, WinchSettings
from stillhook.spec.lift.phase import WinchMode

SLOW_PAGE = True
LIFT, THROUGH = "template-through-the-surface", 1
"""The library's lift, and the number of its stage that goes through the surface."""
SEEDS = range(1, 17)
COMPARED = ("template-230t", "manifold-60t", "suction-anchor-85t", "mud-mat-25t", "ventilated-box-30t")
MODES = (WinchMode.MANUAL, WinchMode.AHC, WinchMode.SPLASH)
SEAS = {"Hs 0.8 m, Tp 7 s": "jonswap Hs=0.8 m Tp=7 s gamma=2", "Hs 2 m, Tp 8 s": "jonswap Hs=2 m Tp=8 s gamma=2"}
"""The sea of the library's lift, and a rougher one."""
GAINS = ("1 m/s", "2 m/s", "3 m/s", "5 m/s")
CRANES = ("deep-250t", "nov-150t", "nov-100t-pure-active")
HEAVIEST = {"nov-150t": 100e3, "nov-100t-pure-active": 100e3}
"""Payloads above this are left out on smaller cranes [kg]."""
SWINGS = 2.0
"""A gain counts as calm where the dynamic tension is below this many times that of manual mode, plus a tenth of the
weight."""
SOFT = "2 m/s"
"""Default gain of splash mode."""
Way = tuple[str, WinchMode, str]
FloatArray = NDArray[np.float64]


class Passage(NamedTuple):
    """Over seeds: highest and lowest sling tension while passing the surface [N]; W weight in air [N]."""

    most: FloatArray
    least: FloatArray
    W: float

    @property
    def dynamic(self) -> FloatArray:
        """Highest tension above the weight in air [N]."""
        return self.most - self.W


def in_sea(wave: str, seeds: Iterable[int]) -> list[LiftFile]:
    """The library's lift in other waves, one for each seed."""
    file = load_lift(LIFT)
    assert file.vessel is not None
    assert file.at is not None
    out = []
    for seed in seeds:
        waves = realise(parse_sea(wave, heading="180 deg"), file.lift.duration, seed, depth=file.lift.depth)
        moved = {
            "tip": tip_motion(waves, file.vessel, file.at.x, file.at.y),
            "waves": wave_field(waves, file.at.x, file.at.y),
        }
        out.append(file._replace(lift=file.lift.model_copy(update=moved)))
    return out


def case(file: LiftFile, payload: str, mode: WinchMode, v_soft: str) -> Lowering:
    programme = tuple(
        s.model_copy(update={"mode": mode}) if s.mode is WinchMode.SPLASH else s for s in file.lift.programme
    )
    changes = {"payload": read_payload(payload), "programme": programme, "winch": WinchSettings(v_soft=v_soft)}
    return file.lift.model_copy(update=changes)


def passing(crane: str, files: list[LiftFile], ways: Iterable[Way]) -> dict[Way, Passage]:
    """Passages of payloads in modes at gains, (payload, mode, v_soft) each, all side by side."""
    ways = list(ways)
    run = simulate(load_crane(crane), [case(f, *way) for way in ways for f in files], on_failure="mark")
    most, least = (run[f"phase_F_sling_{end}"].values[:, THROUGH].reshape(len(ways), -1) for end in ("max", "min"))
    return {way: Passage(most[i], least[i], read_payload(way[0]).mass * G) for i, way in enumerate(ways)}


def calm(files: list[LiftFile], crane: str) -> list[str]:
    """How many of the library's payloads pass calmly at each gain."""
    names = [n for n in payloads() if read_payload(n).mass <= HEAVIEST.get(crane, np.inf)]
    modes = [(WinchMode.MANUAL, SOFT), *((WinchMode.SPLASH, v) for v in GAINS)]
    found = passing(crane, files, ((n, *mode) for n in names for mode in modes))
    told = []
    for v in GAINS:
        swinging = [n for n in names if not _calm(found[n, WinchMode.MANUAL, SOFT], found[n, WinchMode.SPLASH, v])]
        told.append(f"all {len(names)} calm" if not swinging else f"{', '.join(swinging)} swings")
    return told


def _calm(manual: Passage, splash: Passage) -> bool:
    return bool(splash.most.max() < manual.W + SWINGS * max(manual.dynamic.max(), 0.0) + 0.1 * manual.W)


def passages(files: list[LiftFile]) -> dict[tuple[str, WinchMode], Passage]:
    found = passing(CRANES[0], files, ((name, mode, SOFT) for name in COMPARED for mode in MODES))
    return {(name, mode): passage for (name, mode, _), passage in found.items()}


def tension_table(found: Mapping[tuple[str, WinchMode], Passage]) -> Rows:
    rows = []
    for name in COMPARED:
        ways = [found[name, mode].dynamic / 1e3 for mode in MODES]
        cells = [f"{d.mean():+.0f} kN, highest {d.max():+.0f} kN" for d in ways]
        rows.append((name, f"{found[name, MODES[0]].W / 1e3:.0f} kN", *cells))
    return rows


def taken(found: Mapping[tuple[str, WinchMode], Passage], mode: WinchMode) -> str:
    """What a mode takes off the mean over seeds of the highest tension above the weight in air, least and most of the
    payloads on which manual mode leaves more than a twentieth of the weight."""
    manual = {name: found[name, WinchMode.MANUAL] for name in COMPARED}
    less = [
        1.0 - found[n, mode].dynamic.mean() / p.dynamic.mean()
        for n, p in manual.items()
        if p.dynamic.mean() > 0.05 * p.W
    ]
    least, most = (percent(x).replace("−0 %", "0 %") for x in (min(less), max(less)))
    return f"{least} to {most} less than manual"


def compute() -> tuple[Blocks, None]:
    files = {name: in_sea(wave, SEEDS) for name, wave in SEAS.items()}
    (mild, few), (rough, _) = ((passages(f), f[:4]) for f in files.values())
    blocks = {
        "claims": {"mild": mild, "rough": rough},
        "tension": tension_table(mild),
        "rougher": tension_table(rough),
        "gains": [(crane, *calm(few, crane)) for crane in CRANES],
    }
    return blocks, None
