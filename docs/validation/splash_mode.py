"""Splash-zone mode against manual and AHC on payloads through the surface, sixteen seeds each, and how far its gain can be raised."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from blocks import claims_table, percent, save, table
from matplotlib.figure import Figure
from numpy.typing import NDArray

from stillhook.engine.lower import lower
from stillhook.io.figures import COLOURS, GREY
from stillhook.io.lift_file import LiftFile, load_lift
from stillhook.library import load_crane
from stillhook.library.payloads import payloads, read_payload
from stillhook.lift.lowering import Lowering
from stillhook.lift.programme import StageMode, WinchSettings
from stillhook.physics.scalar import G

PAGE = "splash-mode.md"
LIFT, THROUGH = "template-through-the-surface", 1
"""The library's lift, and the number of its stage that goes through the surface."""
SEEDS = range(1, 17)
COMPARED = ("template-230t", "manifold-60t", "suction-anchor-85t", "mud-mat-25t", "ventilated-box-30t")
MODES = (StageMode.MANUAL, StageMode.AHC, StageMode.SPLASH)
GAINS = ("1 m/s", "2 m/s", "3 m/s", "5 m/s")
CRANES = ("deep-250t", "nov-150t", "nov-100t-pure-active")
HEAVIEST = {"nov-150t": 100e3, "nov-100t-pure-active": 100e3}
"""Payloads above this are left out on smaller cranes [kg]."""
SWINGS = 2.0
"""A gain counts as calm where the dynamic tension is below this many times that of manual mode, plus a tenth of the weight."""
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


def case(file: LiftFile, payload: str, mode: StageMode, v_soft: str) -> Lowering:
    programme = tuple(s.model_copy(update={"mode": mode}) if s.mode is StageMode.SPLASH else s for s in file.lift.programme)
    changes = {"payload": read_payload(payload), "programme": programme, "winch": WinchSettings(v_soft=v_soft)}
    return file.lift.model_copy(update=changes)


def passage(files: list[LiftFile], payload: str, mode: StageMode, v_soft: str = "2 m/s", crane: str = "deep-250t") -> Passage:
    run = lower(load_crane(crane), [case(f, payload, mode, v_soft) for f in files], on_failure="mark")
    most, least = (run[f"stage_F_sling_{end}"].values[:, THROUGH] for end in ("max", "min"))
    return Passage(most, least, read_payload(payload).mass * G)


def calm(files: list[LiftFile], crane: str, v_soft: str) -> str:
    """How many of the library's payloads pass calmly at this gain."""
    names = [n for n in payloads() if read_payload(n).mass <= HEAVIEST.get(crane, np.inf)]
    swinging = []
    for name in names:
        manual, splash = passage(files, name, StageMode.MANUAL, crane=crane), passage(files, name, StageMode.SPLASH, v_soft, crane)
        if not splash.most.max() < manual.W + SWINGS * max(manual.dynamic.max(), 0.0) + 0.1 * manual.W:
            swinging.append(name)
    return f"all {len(names)} calm" if not swinging else f"{', '.join(swinging)} swings"


def compute() -> tuple[dict[str, str], Mapping[tuple[str, StageMode], Passage]]:
    files = [load_lift(LIFT, seed=seed) for seed in SEEDS]
    found = {(name, mode): passage(files, name, mode) for name in COMPARED for mode in MODES}
    rows = []
    for name in COMPARED:
        ways = [found[name, mode].dynamic / 1e3 for mode in MODES]
        rows.append((name, f"{found[name, MODES[0]].W / 1e3:.0f} kN", *(f"{d.mean():+.0f} kN, highest {d.max():+.0f} kN" for d in ways)))
    few = files[:4]
    gains = [(crane, *(calm(few, crane, v) for v in GAINS)) for crane in CRANES]
    heavy = [n for n in COMPARED if found[n, StageMode.MANUAL].dynamic.mean() > 0.05 * found[n, StageMode.MANUAL].W]
    less = [1.0 - found[n, StageMode.SPLASH].dynamic.mean() / found[n, StageMode.MANUAL].dynamic.mean() for n in heavy]
    ahc = [1.0 - found[n, StageMode.AHC].dynamic.mean() / found[n, StageMode.MANUAL].dynamic.mean() for n in heavy]
    taken = f"by {percent(min(less))} to {percent(max(less))} of manual's"
    claims = {
        "splash mode lowers the dynamic sling tension": ("yes, without numbers", taken, "so here as well"),
        "AHC while passing the surface": ("not told", f"lowers it by {percent(min(ahc))} to {percent(max(ahc))}", "ours"),
    }
    blocks = {
        "claims": claims_table(claims),
        "tension": table(("payload", "weight in air", "manual", "AHC", "splash"), rows),
        "gains": table(("crane", *(f"v_soft {v}" for v in GAINS)), gains),
    }
    return blocks, found


def draw(found: Mapping[tuple[str, StageMode], Passage]) -> None:
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    ax = figure.subplots()
    for i, name in enumerate(COMPARED):
        for j, (mode, colour) in enumerate(zip(MODES, (GREY, COLOURS[1], COLOURS[0]), strict=True)):
            p = found[name, mode]
            x = np.full(len(p.most), i + 0.22 * (j - 1))
            ax.plot(x, p.dynamic / p.W, ".", color=colour, ms=5, label=mode.value if i == 0 else None)
            ax.plot(x[:1], p.dynamic.mean() / p.W, "_", color=colour, ms=18, mew=2)
    ax.set_xticks(range(len(COMPARED)), COMPARED, fontsize="small")
    ax.set_ylabel("highest sling tension above the\nweight in air, over that weight [-]")
    ax.grid(axis="y", alpha=0.3)
    ax.legend(fontsize="small")
    save(figure, "splash-mode.png")
