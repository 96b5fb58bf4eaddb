"""Pictures of one quantity over another: flow and torque balance (step 1), the law of the motors' displacement (2),
windows and spectra of the control error after Moslatt 2020 paper F figures 11 to 13 (5), and the gas curve (6)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stillhook.control.commands import reduction_cubic, reduction_linear
from stillhook.control.controllers import ssc_cubic
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.spec.crane import Crane, passive_of
from stillhook.spec.scenario import Mode
from stillhook.units import in_display
from stillhook.validate.ahc.check import AhcEstimates
from stillhook.validate.ahc.comparison import BAND, Comparison
from stillhook.validate.controller.check import ControllerEstimates
from stillhook.validate.controller.motor import SEMI, MotorLaw
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.figures.kit import (
    CRANE_FILE,
    FITTED,
    MEASURED,
    OTHER,
    SIMULATED,
    cloud,
    crane,
    finish,
    line,
    panels,
    twin,
)
from stillhook.validate.parameters.flow import Balance
from stillhook.validate.parameters.hoisting import Friction
from stillhook.validate.parameters.measures import ParameterEstimates
from stillhook.validate.passive.check import PassiveEstimates
from stillhook.validate.passive.gas import index

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Figures = dict[str, "Figure"]


def balances(estimates: ParameterEstimates, campaign: Campaign) -> Figures:
    """Flow and torque balance of the logs against the crane file, those whose signals were logged."""
    out: Figures = {}
    if estimates.balance is not None:
        out["flow-balance"] = _flow(campaign, estimates.balance)
    if estimates.frictions:
        out["torque-balance"] = _friction(campaign, estimates.frictions)
    return out


def _flow(campaign: Campaign, b: Balance) -> Figure:
    """Motor flow over pump flow, and the missing flow over the twin's leakage."""
    title = "Flow balance of the higher line of the active circuit, windows of half a second"
    figure, axes = panels(campaign, title, 1, 2, (11.0, 5.0))
    known, unit = np.isfinite(b.Q_m), in_display(1.0, "flow")
    Q_p, Q_m, Q_leak, Q_lost = (unit * x[known] for x in (b.Q_p, b.Q_m, b.Q_leak, b.Q_lost))
    ax, leak = axes[0]
    cloud(ax, Q_p, Q_m, MEASURED, "windows")
    line(ax, 1.0, ax.get_xlim(), CRANE_FILE, "crane file")
    ax.set(xlabel="pump flow [L/min]", ylabel="motor flow [L/min]")
    cloud(leak, Q_leak, Q_lost, MEASURED, "windows")
    ends, e = (0.0, float(np.nanmax(Q_leak))), b.leakage
    line(leak, 1.0, ends, CRANE_FILE, "crane file")
    of, low, high = (100.0 * x for x in (e.value, e.low, e.high))
    line(leak, 1.0 + e.value, ends, FITTED, f"log: leakage {of:+.1f} % ({low:+.1f} to {high:+.1f})")
    for end in (e.low, e.high):
        line(leak, 1.0 + end, ends, FITTED, None, ":")
    low, high = np.nanpercentile(Q_lost, [0.5, 99.5])  # single outliers do not set the limits of the axis
    leak.set(ylim=(min(0.0, low - 0.2 * (high - low)), high + 0.2 * (high - low)))
    leak.set(xlabel="leakage of the twin [L/min]", ylabel="missing flow [L/min]")
    return finish(figure, axes, ("motor flow [L/min]",), 3)


def _friction(campaign: Campaign, frictions: tuple[Friction, ...]) -> Figure:
    """Remaining torque at the motor shaft over the twin's friction, by test."""
    title = "Torque balance at the motors: remaining torque against the twin's friction"
    figure, axes = panels(campaign, title, 1, 2, (11.0, 5.0))
    for ax, up in zip(axes[0], (False, True), strict=True):
        for i, f in enumerate(frictions):
            some = np.isfinite(f.measured) & np.isfinite(f.twin) & ((f.twin > 0.0) == up)
            label = f"test {f.test}: {1.0 + f.scale.value:.2f} (+- {f.scale.half:.2f})"
            cloud(ax, np.abs(f.twin[some]), (f.measured * np.sign(f.twin))[some], COLOURS[i % 6], label)
        line(ax, 1.0, (0.0, ax.get_xlim()[1]), CRANE_FILE, "crane file")
        ax.set(xlabel="friction of the twin [N m]")
        ax.set_title("hoisting" if up else "lowering", fontsize="medium")
    return finish(figure, axes, ("remaining torque [N m]",), 4)


def motor_law(estimates: ControllerEstimates, campaign: Campaign) -> Figures:
    """Motor command over the feedforward, with the twin's law for every mode and least displacement."""
    laws = [m for m in estimates.motor_laws if m.mode in SEMI]
    return {"motor-law": _motor_law(laws, campaign)} if laws else {}


def _motor_law(laws: list[MotorLaw], campaign: Campaign) -> Figure:
    figure, axes = panels(campaign, "Motor command over the feedforward in the logged pump command", 1, 1, (7.0, 5.2))
    ax, x = axes[0, 0], np.linspace(0.0, 1.0, 201)
    curves = list(dict.fromkeys((m.mode, round(m.lowest, 2)) for m in laws))
    for (mode, lowest), style in zip(curves, ("-", "--", ":", "-.") * 3, strict=False):
        y = [_law(float(u), mode, lowest, campaign.crane) for u in x]
        ax.plot(x, y, style, color=FITTED, lw=1.2, label=f"twin, {mode.value}, minimum {lowest:g}")
    for colour, m in zip(COLOURS * 3, laws, strict=False):
        cloud(ax, m.u_ff, m.u_m, colour, f"test {m.test}, measured")
    ax.axvline(campaign.crane.control.u_thr, color=GREY, lw=0.8, ls=":")
    ax.set(xlim=(0.0, 1.05), ylim=(min(0.5, min(n for _, n in curves) - 0.05), 1.05), xlabel="|u_ff| [-]")
    return finish(figure, axes, ("motor command [-]",), 3)


def _law(u_ff: float, mode: Mode, lowest: float, crane_file: Crane) -> float:
    u_thr = crane_file.control.u_thr
    reduction = reduction_cubic(u_ff, u_thr) if mode == ssc_cubic.NAME else reduction_linear(u_ff, u_thr)
    return 1.0 - float(reduction) * (1.0 - lowest)


BIN = 0.25
"""Width of the bins of tip motion [m]."""


def errors(estimates: AhcEstimates, campaign: Campaign) -> Figures:
    """The control error by windows, and its spectra."""
    out: Figures = {}
    if any(len(c.windows.x) for c in estimates.comparisons):
        out["windows"] = _windows(estimates.comparisons, campaign)
    if (x := estimates.spectra) is not None:
        figure, axes = panels(campaign, "Spectra of the control error, all load cases", 1, 1, (8.0, 4.6))
        ax, band = axes[0, 0], (x.f > 0.0) & (x.f <= 5.0)
        ax.axvspan(*BAND, color=GREY, alpha=0.12, lw=0, label="wave band")
        crane(ax, x.f[band], 1e4 * x.measured[band])
        twin(ax, x.f[band], 1e4 * x.simulated[band])
        ax.set(xscale="log", yscale="log", xlabel="frequency [Hz]", xlim=(x.f[band][0], x.f[band][-1]))
        out["spectra"] = finish(figure, axes, ("power density [cm$^2$/Hz]",), 3)
    return out


def _windows(comparisons: tuple[Comparison, ...], campaign: Campaign) -> Figure:
    """Control error, efficiency and the deviation of the error over the tip's motion, by windows."""
    figure, axes = panels(campaign, "Control error over moving windows, all load cases", 1, 3, (14.0, 5.0))
    w = {
        name: np.concatenate([getattr(c.windows, name) for c in comparisons])
        for name in ("s_tip_pp", "measured", "simulated", "eta_measured", "eta_simulated", "x")
    }
    tip, (error, efficiency, deviation) = w["s_tip_pp"], axes[0]
    for colour, label in ((MEASURED, "measured"), (SIMULATED, "simulated")):
        cloud(error, tip, 100.0 * w[label], colour, label)
        cloud(efficiency, tip, 100.0 * w[f"eta_{label}"], colour, label)
    cloud(deviation, tip, 100.0 * w["x"], OTHER, "deviation")
    cell = np.floor(tip / BIN)
    bins = np.unique(cell)
    means = [100.0 * w["x"][cell == i].mean() for i in bins]
    deviation.plot((bins + 0.5) * BIN, means, "o-", color=FITTED, lw=1.5, ms=4, label=f"average over {BIN:g} m")
    efficiency.set_ylabel("compensation efficiency [%]")
    deviation.set(ylabel="deviation of the control error [cm]", ylim=(0.0, None))
    error.set(ylim=(0.0, None))
    for ax in axes[0]:
        ax.set_xlabel("crane tip, peak to peak [m]")
    return finish(figure, axes, ("control error, peak to peak [cm]",), 4)


def gas_curve(estimates: PassiveEstimates, campaign: Campaign) -> Figures:
    """Pressure over the oil that the passive motors move, and over its flow, in windows, each without the other; none
    where their signals were not logged."""
    gas, acc = estimates.gas, passive_of(campaign.crane).accumulator
    if gas is None:
        return {}
    figure, axes = panels(campaign, "Passive pressure in windows of 2 s: gas curve and flow loss", 1, 2, (11.0, 5.0))
    stiff = acc.gas.p_0 / acc.gas.V_0 * index(estimates.parts[0])
    implied = stiff * (gas.p / acc.gas.p_0) * acc.gas.V_0 / gas.V.all.value
    bar, dp = in_display(1.0, "pressure"), gas.dp - gas.dry * gas.d_dry
    sides = (
        ("oil into the accumulator [L]", "volume", gas.dV, dp - gas.R * gas.dQ, stiff, implied),
        ("change of flow [L/min]", "flow", gas.dQ, dp - implied * gas.dV, acc.R_piston, gas.R),
    )
    for ax, (name, kind, x, y, file_slope, log_slope) in zip(axes[0], sides, strict=True):
        unit = in_display(1.0, kind)
        ends = (unit * float(np.nanmin(x)), unit * float(np.nanmax(x)))
        cloud(ax, unit * x, bar * y, MEASURED, "measured")
        line(ax, bar / unit * file_slope, ends, CRANE_FILE, "crane file")
        line(ax, bar / unit * log_slope, ends, FITTED, "log", "--")
        ax.set_xlabel(name)
    axes[0, 1].set_ylabel("change of pressure, less gas and dry friction [bar]")
    return {"gas-curve": finish(figure, axes, ("change of pressure, less flow loss [bar]",), 3)}
