"""The picture of docs/explanation/prediction.md: control error of nov-250t over the delay of its motion unit under SSC
and FF, the tip's motion extrapolated and predicted, each with the leads that were best for its four seas together.

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
K_P = {"ssc": 0.214, "ff": 0.204}
"""Gains that leave 6 dB at motor displacements 0.6 and 1 [1/m]."""
LEADS = {
    ("ssc", "extrapolated"): ((88, 48), (118, 78), (148, 128), (168, 228), (208, 348)),
    ("ssc", "predicted"): ((88, 48), (118, 78), (168, 128), (268, 228), (368, 328)),
    ("ff", "extrapolated"): ((48, 48), (58, 78), (108, 128), (168, 228), (228, 328)),
    ("ff", "predicted"): ((48, 48), (78, 78), (128, 128), (228, 228), (328, 328)),
}
"""t_lead and t_lead_ff [ms] by delay: best of a grid of 20 ms."""
SENSORS = {
    "seed": 5,
    "noise_s_tip": "2 mm",
    "noise_v_tip": "3 mm/s",
    "noise_a_tip": "0.02 m/s^2",
    "p_a": {"noise": "0.4 bar", "drift": "0.5 bar", "offset": "0.5 bar"},
    "p_b": {"noise": "0.4 bar", "offset": "-0.5 bar"},
}


def tip(Hs: float, Tp: float) -> stillhook.Recorded:
    """Tip motion in a JONSWAP sea, of 0.7 of its height."""
    rng, T = np.random.default_rng(1), 640.0
    f = np.arange(1, int(0.35 * T)) / T
    S = Jonswap(Hs, Tp, 3.3).density(2.0 * np.pi * f)
    a = np.sqrt(2.0 * S / S.sum()) * 0.7 * Hs / 4.0
    t, phase = np.arange(0.0, 320.0, 0.25), rng.uniform(0.0, 2.0 * np.pi, f.size)
    return stillhook.Recorded(t, (a * np.cos(2.0 * np.pi * np.outer(t, f) + phase)).sum(1))


def errors(mode: str, kind: str) -> np.ndarray:
    """Peak-to-peak error [cm] by delay and sea."""
    out = []
    for delay, (lead, lead_ff) in zip(DELAYS, LEADS[mode, kind], strict=True):
        control: dict[str, object] = {"K_p": f"{K_P[mode]} 1/m", "t_lead": f"{lead} ms", "t_lead_ff": f"{lead_ff} ms"}
        control |= {"prediction": {"t_least": "0 s"}} if kind == "predicted" else {}
        crane = changed(stillhook.load_crane("nov-250t"), {"control": control})
        given = {"load": "100 t", "s_w": "487 m", "mode": mode, "duration": "200 s", "warm_up": "80 s"}
        cases = [Scenario(**given, tip=tip(*sea), sensors={"delay": f"{delay} ms", **SENSORS}) for sea in SEAS]
        out.append(100.0 * stillhook.simulate(crane, cases).e_c_pp.values)
    return np.array(out)


def main() -> None:
    figure, panels = plt.subplots(1, 2, figsize=(8.0, 4.0), sharey=True, layout="constrained")
    for axes, (mode, title) in zip(panels, (("ssc", "SSC"), ("ff", "FF")), strict=True):
        for kind, style in (("extrapolated", "--o"), ("predicted", "-o")):
            e = errors(mode, kind)
            print(mode, kind, e.round(2).tolist())
            for i, (Hs, Tp) in enumerate(SEAS):
                axes.plot(DELAYS, e[:, i], style, color=f"C{i}", markersize=3, label=f"Hs {Hs:g} m, {Tp:g} s, {kind}")
        axes.set(xlabel="delay of the motion unit [ms]", ylim=(0.0, None), title=title)
    panels[0].set_ylabel("peak-to-peak error [cm]")
    figure.legend(*panels[0].get_legend_handles_labels(), fontsize=7, ncols=4, loc="outside lower center")
    figure.savefig(Path(__file__).with_name("prediction.png"), dpi=120)


if __name__ == "__main__":
    main()
