"""The picture of docs/explanation/prediction.md: control error of nov-250t over the delay of its motion unit, the tip's
motion extrapolated and predicted, each with the leads that were best for its four seas together.

Run: python docs/images/prediction.py
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import stillhook
from stillhook import Scenario
from stillhook.library import changed
from stillhook.sea.spectra.parametric import Jonswap

SEAS = ((0.5, 7.0), (1.5, 8.0), (2.5, 10.0), (3.5, 11.0))
DELAYS = (20, 50, 100, 200, 300)
LEADS = {
    "extrapolated": ((45, 45), (55, 75), (105, 125), (185, 245), (285, 345)),
    "predicted": ((45, 45), (75, 75), (125, 125), (225, 245), (325, 345)),
}
"""t_lead and t_lead_ff [ms] by delay: best of a grid of 20 ms."""


def tip(Hs: float, Tp: float) -> stillhook.Recorded:
    """Tip motion in a JONSWAP sea, of 0.7 of its height."""
    rng, T = np.random.default_rng(1), 640.0
    f = np.arange(1, int(0.35 * T)) / T
    S = Jonswap(Hs, Tp, 3.3).density(2.0 * np.pi * f)
    a = np.sqrt(2.0 * S / S.sum()) * 0.7 * Hs / 4.0
    t, phase = np.arange(0.0, 320.0, 0.25), rng.uniform(0.0, 2.0 * np.pi, f.size)
    return stillhook.Recorded(t, (a * np.cos(2.0 * np.pi * np.outer(t, f) + phase)).sum(1))


def errors(kind: str) -> np.ndarray:
    """Peak-to-peak error [cm] by delay and sea."""
    out = []
    for delay, (lead, lead_ff) in zip(DELAYS, LEADS[kind], strict=True):
        control: dict[str, object] = {"K_p": "0.5 1/m", "t_lead": f"{lead} ms", "t_lead_ff": f"{lead_ff} ms"}
        control |= {"prediction": {"t_least": "0 s"}} if kind == "predicted" else {}
        crane = changed(stillhook.load_crane("nov-250t"), {"control": control})
        sensors = {"delay": f"{delay} ms", "seed": 5, "noise_s_tip": "2 mm", "noise_v_tip": "3 mm/s"}
        sensors |= {"noise_a_tip": "0.02 m/s^2"}
        cases = [
            Scenario(
                load="100 t", s_w="487 m", mode="ssc", duration="200 s", warm_up="80 s", tip=tip(*sea), sensors=sensors
            )
            for sea in SEAS
        ]
        out.append(100.0 * stillhook.simulate(crane, cases).e_c_pp.values)
    return np.array(out)


def main() -> None:
    figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
    for kind, style in (("extrapolated", "--o"), ("predicted", "-o")):
        e = errors(kind)
        print(kind, e.round(2).tolist())
        for i, (Hs, Tp) in enumerate(SEAS):
            axes.plot(DELAYS, e[:, i], style, color=f"C{i}", markersize=3, label=f"Hs {Hs:g} m, Tp {Tp:g} s, {kind}")
    axes.set(xlabel="delay of the motion unit [ms]", ylabel="peak-to-peak error [cm]", ylim=(0.0, None))
    axes.legend(fontsize=7, ncols=2)
    figure.savefig(Path(__file__).with_name("prediction.png"), dpi=120)


if __name__ == "__main__":
    main()
