"""The picture of docs/explanation/rope-loop.md: motion of a load over its depth on `deep-250t`, without heave
compensation, with SSC and with the tension loop.

Run: python docs/images/tension_loop.py
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from stillhook import load_lift
from stillhook.engine.simulate import run_cases

LIFT = """name = "hold"
crane = "deep-250t"
vessel = "construction-vessel-130m"
payload = "{payload}"
controller = "{controller}"
start_depth = "{depth:g} m"
[sea]
wave = "jonswap Hs=1 m Tp=6 s gamma=2"
heading = "165 deg"
spread = 4
seed = 1
[tip]
at = "x=-15 m, y=-24 m, z=36 m"
[water]
depth = "{bottom:g} m"
[rigging]
height = "12 m"
[wire]
nodes = 20
[sensors]
seed = 1
delay = "20 ms"
s_tip.noise = "2 mm"
v_tip.noise = "3 mm/s"
F.noise = "5 kN"
[[phase]]
name = "hold"
mode = "{mode}"
time = "200 s"
"""
PAYLOADS = ("suction-anchor-85t", "manifold-60t")
DEPTHS = np.geomspace(100.0, 3000.0, 24)
CURVES = {"no compensation": ("ssc", "manual"), "SSC": ("ssc", "ahc"), "SSC with tension loop": ("rope", "ahc")}
SETTLED = 60.0
"""Time that is left out [s]."""


def motion(run) -> float:  # type: ignore[no-untyped-def]
    """Standard deviation of the load [mm]."""
    return 1e3 * float(np.std(run.column("z_load")[round(SETTLED / run.dt) :]))


def motions(payload: str, controller: str, mode: str) -> list[float]:
    """By depth."""
    lifts, crane = [], None
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "lift.toml"
        for depth in DEPTHS:
            text = LIFT.format(payload=payload, controller=controller, mode=mode, depth=depth, bottom=depth + 200.0)
            path.write_text(text, encoding="utf-8")
            file = load_lift(path)
            crane = file.crane
            lifts.append(file.lift)
    assert crane is not None
    return run_cases(crane, lifts, every=10, keep=motion)


def main() -> None:
    figure, panels = plt.subplots(1, 2, figsize=(8.0, 3.6), sharey=True, layout="constrained")
    for panel, payload in zip(panels, PAYLOADS, strict=True):
        for label, (controller, mode) in CURVES.items():
            result = motions(payload, controller, mode)
            print(payload, label, np.round(result, 1).tolist())
            panel.loglog(DEPTHS, result, "-o", markersize=3, label=label)
        panel.set(xlabel="depth [m]", title=payload)
        panel.grid(which="both", alpha=0.3)
    panels[0].set_ylabel("load, standard deviation [mm]")
    panels[0].legend(fontsize=8)
    figure.savefig(Path(__file__).with_name("tension-loop.png"), dpi=120)


if __name__ == "__main__":
    main()
