"""Pictures of the linear analysis: gain limit over displacement (paper E figure 5), sweeps, Bode, root locus, poles
over tip speed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.analysis.loop_stability.stability import range_of_modes
from stillhook.analysis.loop_stability.sweeps import AXES, bode, root_locus, slow_sweep, sweep
from stillhook.analysis.loop_stability.transfer import about, full_matrices, motor_poles
from stillhook.analysis.steady.steady_state import moves, speed_limit
from stillhook.engine.pack.winch import gains
from stillhook.report.plots.colours import COLOURS, GREY, colours_of
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.units import in_display, show

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

SPEED_POINTS = 60
"""Tip speeds of the picture of pole movement."""


def gain_limit_figure(crane: Crane, data: xarray.Dataset, slow: xarray.Dataset) -> Figure:
    """K_p of marginal stability over displacement, with and without PLC, the range of each mode, K_p itself (paper E
    figure 5); next to the published loop the complete plant at low speed, with the crane's own damping of
    the wire and with that of paper C.

    data: `sweep(crane, "alpha_m")`; slow: `slow_sweep(crane)`.
    """
    figure, ax = _figure(7.5, 5.4)
    D = [in_display(a * crane.active.motor.D_total, "displacement") for a in data["alpha_m"].values]
    late = f" and {1e3 * data.attrs['delay']:g} ms of delay" if data.attrs["delay"] else ""
    ax.plot(D, data["K_p_ms"], color=COLOURS[0], label="published loop")
    ax.plot(
        D, data["K_p_ms_plc"], color=COLOURS[1], ls="--", label=f"with PLC ({1e3 * crane.control.t_cycle:g} ms){late}"
    )
    for colour, load in zip(COLOURS[2:], slow["load"].values, strict=False):
        name = "empty hook" if load == 0.0 else show(float(load), "mass", 4)
        x = [in_display(a * crane.active.motor.D_total, "displacement") for a in slow["alpha_m"].values]
        for style, zeta in zip(("-", ":"), slow["wire_zeta"].values, strict=False):
            label = f"slow plant, {name}, wire damping {zeta:g}"
            at = slow["K_p_ms_plc"].sel(load=load, wire_zeta=zeta).isel(s_w=0)
            ax.plot(x, at, color=colour, ls=style, lw=1.0, label=label)
    ax.axhline(crane.control.K_p, color=GREY, ls=":", label=f"K_p of the crane, {crane.control.K_p:g} 1/m")
    _mark_modes(ax, crane, lambda a: in_display(a * crane.active.motor.D_total, "displacement"))
    ax.set(
        xlabel="motor displacement [cm³/rev]",
        ylabel="K_p of marginal stability [1/m]",
        ylim=(0.0, None),
        xlim=(D[0], D[-1]),
    )
    ax.set_title(f"{crane.name}: position gain at which the winch starts to oscillate", fontsize="medium")
    ax.legend(loc="upper left", fontsize="x-small", ncols=2)
    return figure


def eigen_figure(crane: Crane, data: xarray.Dataset) -> Figure:
    """Eigenfrequency, period and damping ratio over displacement (paper C eqs 8 and 9); data as `gain_limit_figure`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 7.0), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    D = [in_display(a * crane.active.motor.D_total, "displacement") for a in data["alpha_m"].values]
    omega = data["omega_0"].values
    rows = (
        (omega, "eigenfrequency [rad/s]"),
        (2.0 * math.pi / omega, "period [s]"),
        (data["zeta"].values, "damping ratio [-]"),
    )
    for ax, (values, name) in zip(axes, rows, strict=True):
        ax.plot(D, values, color=COLOURS[0])
        ax.set(ylabel=name, ylim=(0.0, None), xlim=(D[0], D[-1]))
        ax.grid(alpha=0.3)
    axes[2].set_xlabel("motor displacement [cm³/rev]")
    axes[0].set_title(f"{crane.name}: active circuit, one line held, full drum", fontsize="medium")
    return figure


def sweep_figure(crane: Crane, sweeps: list[xarray.Dataset]) -> Figure:
    """Gain limits over layer, leakage, damping, bulk modulus, delay, each in its own panel."""
    from matplotlib.figure import Figure

    columns = 3
    figure = Figure(figsize=(10.5, 3.4 * math.ceil(len(sweeps) / columns)), layout="constrained")
    axes = np.atleast_1d(figure.subplots(math.ceil(len(sweeps) / columns), columns, squeeze=False)).ravel()
    for ax, data in zip(axes, sweeps, strict=False):
        name = str(data["K_p_ms"].dims[0])
        kind, label = next((axis.kind, axis.label) for axis in AXES.values() if axis.name == name)
        x = [in_display(v, kind) if kind else v for v in data[name].values]
        ax.plot(x, data["K_p_ms"], color=COLOURS[0], label="published loop")
        ax.plot(x, data["K_p_ms_plc"], color=COLOURS[1], ls="--", label="with PLC and delay")
        ax.axhline(crane.control.K_p, color=GREY, ls=":", label="K_p of the crane")
        ax.set(xlabel=label, ylabel="K_p limit [1/m]", ylim=(0.0, None))
        if name == "layer":
            ax.set_xticks([v for v in x if v % 2 == 0])
        ax.grid(alpha=0.3)
    for ax in axes[len(sweeps) :]:
        ax.set_axis_off()
    figure.legend(
        *axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize="small", frameon=False
    )
    figure.suptitle(
        f"{crane.name}: what the gain limit depends on, motors at {sweeps[0].attrs['alpha_m']:g}", fontsize="medium"
    )
    return figure


def bode_figure(crane: Crane, alphas: tuple[float, ...] = (1.0,), *, delay: float = 0.0) -> Figure:
    """Magnitude and phase of the cut loop at the crane's K_p, solid as published, dashed with PLC and delay."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 6.5), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    for colour, alpha in zip(COLOURS * 2, alphas, strict=False):
        data = bode(crane, alpha, delay=delay)
        w = data["omega"].values
        for end, style, label in (("", "-", f"motors at {alpha:.3g}"), ("_plc", "--", None)):
            top.loglog(w, data[f"loop_gain{end}"], color=colour, ls=style, lw=1.2, label=label)
            bottom.semilogx(w, np.degrees(data[f"loop_phase{end}"]), color=colour, ls=style, lw=1.2)
    top.axhline(1.0, color=GREY, lw=0.8)
    bottom.axhline(-180.0, color=GREY, lw=0.8)
    top.set(ylabel="loop gain [-]", ylim=(1e-5, 30.0))
    bottom.set(ylabel="phase [deg]", xlabel="frequency [rad/s]", ylim=(-720.0, 0.0), yticks=range(-720, 1, 90))
    for ax in (top, bottom):
        ax.grid(alpha=0.3)
    late = f" and {1e3 * delay:g} ms of delay" if delay else ""
    title = f"{crane.name}, K_p = {crane.control.K_p:g} 1/m: solid as published, dashed with PLC{late}"
    top.set_title(title, fontsize="medium")
    top.legend(fontsize="small")
    return figure


def root_locus_figure(crane: Crane, alphas: tuple[float, ...] = (1.0, 0.6)) -> Figure:
    """Poles of the published loop as K_p grows from 0 to three times its limit; dots at the crane's own K_p."""
    figure, ax = _figure(7.5, 5.5)
    for colour, alpha in zip(COLOURS, alphas, strict=False):
        data = root_locus(crane, alpha)
        for branch in range(data.sizes["branch"]):
            re, im = data["pole_re"].values[:, branch], data["pole_im"].values[:, branch]
            ax.plot(re, im, color=colour, lw=1.2, label=f"motors at {alpha:.3g}" if branch == 0 else None)
            ax.plot(re[0], im[0], "x", color=colour)
        current = root_locus(crane, alpha, K_p=[crane.control.K_p])
        ax.plot(current["pole_re"].values.ravel(), current["pole_im"].values.ravel(), "o", color=colour, ms=4)
    ax.axvline(0.0, color=GREY, lw=0.8)
    ax.set(xlabel="real part [1/s]", ylabel="imaginary part [1/s]")
    ax.set_title(
        f"{crane.name}: poles for K_p from 0 (crosses) to three times the limit; dots: K_p of the crane",
        fontsize="medium",
    )
    ax.legend(fontsize="small")
    return figure


def motor_pole_figure(crane: Crane, modes: tuple[Mode, ...] | None = None) -> Figure:
    """Poles of the motors' own loop and of the circuit in the position loop as the tip's speed rises under SSC, at the
    crane's K_p."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    modes = tuple(mode for mode in Mode if mode.compensates and moves(crane, mode)) if modes is None else modes
    colours = colours_of(map(str, modes))
    for mode in modes:
        colour = colours[str(mode)]
        speeds = _speeds(crane, mode)
        poles = np.array([motor_poles(crane, v, mode=mode) for v in speeds])
        zeta = -poles[:, 0].real / np.abs(poles[:, 0])
        left.plot([in_display(v, "speed") for v in speeds], zeta, color=colour, label=f"{mode}: motors' own loop")
        width = 3.0 if mode is modes[0] else 1.2
        right.plot(poles.real, poles.imag, color=colour, lw=width)
        swing = np.array([_swing(crane, v, mode) for v in speeds])
        left.plot(
            [in_display(v, "speed") for v in speeds],
            -swing.real / np.abs(swing),
            color=colour,
            ls=":",
            lw=width,
            label=f"{mode}: oil spring",
        )
        right.plot(swing.real, swing.imag, color=colour, ls=":", lw=width)
    left.set(xlabel="steady tip speed [m/min]", ylabel="damping ratio [-]", ylim=(0.0, 1.05))
    right.set(xlabel="real part [1/s]", ylabel="imaginary part [1/s]")
    left.legend(fontsize="small")
    for ax in (left, right):
        ax.grid(alpha=0.3)
    figure.suptitle(
        f"{crane.name}: what SSC's measured displacement does to the poles as the tip moves faster", fontsize="medium"
    )
    return figure


def _speeds(crane: Crane, mode: Mode) -> Any:
    return np.linspace(0.0, 0.999 * speed_limit(crane, mode), SPEED_POINTS)


def _swing(crane: Crane, v_tip: float, mode: Mode) -> complex:
    """The pole of the position loop of the inertia on the oil spring."""
    A = full_matrices(crane, about(crane, v_tip, mode=mode), K_p=gains(crane).K_p)[0]
    poles = np.linalg.eigvals(A[2:, 2:])
    return complex(max((p for p in poles if p.imag > 0.0), key=lambda p: p.real))


def _mark_modes(ax: Any, crane: Crane, at: Any) -> None:
    """The displacements that each mode takes."""
    for i, (mode, (lo, hi)) in enumerate(range_of_modes(crane).items()):
        y = 0.03 + 0.045 * i
        ax.plot([at(lo), at(hi)], [y, y], color=GREY, lw=4, solid_capstyle="butt", transform=ax.get_xaxis_transform())
        if lo == hi:
            ax.plot([at(lo)], [y], "D", color=GREY, ms=5, transform=ax.get_xaxis_transform())
        place = {
            "xy": (at(lo), y),
            "xytext": (-6, 0),
            "xycoords": ax.get_xaxis_transform(),
            "textcoords": "offset points",
        }
        ground = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
        ax.annotate(mode.upper(), **place, fontsize="x-small", va="center", ha="right", bbox=ground)


def _figure(width: float, height: float) -> tuple[Figure, Any]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    ax = figure.subplots()
    ax.grid(alpha=0.3)
    return figure, ax


def all_sweeps(crane: Crane, alpha_m: float, *, delay: float = 0.0) -> dict[str, xarray.Dataset]:
    """The data behind the pictures, by file name without its ending."""
    data = {
        over: sweep(crane, over, alpha_m=alpha_m, delay=delay)
        for over in ("alpha_m", "layer", "leakage", "damping", "bulk_modulus")
    }
    data["delay"] = sweep(crane, "delay", alpha_m=alpha_m)
    return data | {"slow": slow_sweep(crane, delay=delay)}


def all_figures(
    crane: Crane, alphas: tuple[float, ...], data: Mapping[str, xarray.Dataset], *, delay: float = 0.0
) -> dict[str, Figure]:
    """Pictures by file name without its ending; data of `all_sweeps`."""
    return {
        "gain-limit": gain_limit_figure(crane, data["alpha_m"], data["slow"]),
        "eigenfrequency": eigen_figure(crane, data["alpha_m"]),
        "sweeps": sweep_figure(crane, [d for name, d in data.items() if name not in ("alpha_m", "slow")]),
        "bode": bode_figure(crane, alphas, delay=delay),
        "root-locus": root_locus_figure(crane, alphas),
        "motor-poles": motor_pole_figure(crane),
    }
