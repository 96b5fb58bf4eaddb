"""Stability over one quantity: sweeps of the published loop and of the complete plant, Bode data, root locus, and
their pictures: gain limit over displacement (paper E figure 5), sweeps, Bode, root locus, poles over tip speed."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.analysis.loop_stability.governing import PAPER_C, place_limits, with_wire_damping
from stillhook.analysis.loop_stability.places import payloads_of_mode, places_of
from stillhook.analysis.loop_stability.stability import SHOWN, Stability, gain_limit, range_of_modes, stability
from stillhook.analysis.loop_stability.transfer import about, by_plc, full_matrices, motor_poles, position_loop
from stillhook.analysis.steady.steady_state import moves, speed_limit
from stillhook.base.arrays import FloatArray
from stillhook.control.registry import CLASSIC, DEFAULT_MODE
from stillhook.engine.pack.winch import gains
from stillhook.errors import StillhookError
from stillhook.library import changed
from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS, GREY, colours_of
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.units import KINDS, show
from stillhook.variables import attributes

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


TIMES = np.geomspace(0.25, 4.0, 17)
"""Default of those sweeps: the crane's own number times these. No source: wide enough for wear, aeration and a poor
guess."""


class Axis(NamedTuple):
    """What varies along a sweep: name in the nomenclature, kind of quantity ("": a pure number), label of pictures,
    default values for a crane [SI], and the number of the crane that it changes, as a dotted path."""

    name: str
    kind: str
    label: str
    default: Callable[[Crane], FloatArray]
    path: str = ""


AXES: Mapping[str, Axis] = {
    "alpha_m": Axis("alpha_m", "", "motor displacement [-]", lambda crane: np.linspace(0.05, 1.0, 39)),
    "layer": Axis("layer", "", "layer", lambda crane: np.arange(1.0, crane.drum.layers + 1.0)),
    "leakage": Axis(
        "C_leak", "leakage", "leakage [L/min/bar]", lambda crane: crane.active.C_leak * TIMES, "active.C_leak"
    ),
    "damping": Axis(
        "B_v",
        "viscous_torque",
        "viscous friction B_v [N m s/rad]",
        lambda crane: crane.control.B_v * TIMES,
        "control.B_v",
    ),
    "bulk_modulus": Axis(
        "bulk_modulus",
        "pressure",
        "bulk modulus [bar]",
        lambda crane: crane.active.line.bulk_modulus * TIMES,
        "active.line.bulk_modulus",
    ),
    "delay": Axis("delay", "time", "delay of the position feedback [s]", lambda crane: np.linspace(0.0, 1.0, 41)),
}
SWEPT = ("K_p_ms", "omega_c", "omega_0", "zeta", *SHOWN, "K_p_ms_plc", *(f"{name}_plc" for name in SHOWN))


SPEED_POINTS = 60
"""Tip speeds of the picture of pole movement."""
SWEPT_WIRE = 100.0
"""Wire paid out in sweeps of the slow plant [m]: that of the usual scenarios."""
SWEPT_SPEEDS = (2.0 / 60.0, 5.0 / 60.0)
"""Tip speeds of them [m/s], both directions."""


def slow_sweep(
    crane: Crane,
    values: Sequence[float] | None = None,
    *,
    loads: Sequence[float] | None = None,
    delay: float = 0.0,
) -> xarray.Dataset:
    """Gain limit of the complete plant with PLC where it is slow, over the wire's damping (the crane's own and that of
    paper C), displacement and payload, with 100 m of wire paid out: the least of 2 and 5 m/min up and down.

    Parameters: values displacements [-], default from 0.8 alpha_min to 1; loads payloads [kg], default empty hook, 60 %
    of the SWL (the most that HS carries) and SWL; delay [s].
    Returns: Dataset over ("wire_zeta", "alpha_m", "load") with K_p_ms_plc [1/m], 0 where the winch oscillates without
    feedback, NaN where nothing holds the load.
    """
    import xarray

    alphas = np.linspace(0.8 * crane.active.motor.alpha_min, 1.0, 14) if values is None else np.asarray(values)
    heaviest = payloads_of_mode(crane, CLASSIC[-1], shares=(0.0, 1.0))
    masses = (*heaviest, crane.SWL) if loads is None else tuple(loads)
    dampings = (crane.wire.zeta, PAPER_C)
    limits = np.full((len(dampings), len(alphas), len(masses)), math.nan)
    for at in np.ndindex(limits.shape):
        h, i, j = at
        machine = with_wire_damping(crane, dampings[h])
        places = places_of(masses[j : j + 1], (SWEPT_WIRE,), SWEPT_SPEEDS)
        with contextlib.suppress(StillhookError):
            result = place_limits(machine, DEFAULT_MODE, places, alpha_m=float(alphas[i]), delay=delay)
            limits[at] = min(0.0 if p.gains.alone else p.gains.high for p in result)
    coords = {"wire_zeta": list(dampings), "alpha_m": alphas, "load": list(masses)}
    data = {"K_p_ms_plc": (tuple(coords), limits, attributes("K_p_ms_plc"))}
    attrs = {"crane": crane.name, "delay": delay, "s_w": SWEPT_WIRE}
    return xarray.Dataset(data, coords={n: (n, v, attributes(n)) for n, v in coords.items()}, attrs=attrs)


def sweep(
    crane: Crane,
    over: str = "alpha_m",
    values: Sequence[float] | None = None,
    *,
    alpha_m: float = 1.0,
    delay: float = 0.0,
) -> xarray.Dataset:
    """Gain limit, eigenfrequency, damping and margins of the published loop over one quantity.

    Parameters: over "alpha_m", "layer", "leakage" (C_leak), "damping" (B_v), "bulk_modulus" or "delay"; values in SI,
    default a range about the crane's own; alpha_m of the sweeps over something else [-]; delay [s].
    Returns: Dataset over that quantity, variables as in `Stability`.
    Errors: StillhookError for an unknown quantity or a value outside its range.
    """
    import xarray

    if over not in AXES:
        raise StillhookError(f'over = "{over}": choose one of {", ".join(AXES)}.')
    name = AXES[over].name
    at = np.asarray(AXES[over].default(crane) if values is None else list(values), dtype=np.float64)
    rows = [_swept(crane, over, float(v), alpha_m, delay) for v in at]
    data = {n: (name, [getattr(r, n) for r in rows], attributes(n)) for n in SWEPT}
    fixed = {} if over == "alpha_m" else {"alpha_m": alpha_m}
    fixed |= {} if over == "delay" else {"delay": delay}
    return xarray.Dataset(
        data,
        coords={name: (name, at, attributes(name))},
        attrs={"crane": crane.name, "K_p": crane.control.K_p, **fixed},
    )


def _swept(crane: Crane, over: str, value: float, alpha_m: float, delay: float) -> Stability:
    axis, machine = AXES[over], crane
    if axis.path:
        changes: Any = f"{value!r} {KINDS[axis.kind].si}"
        for name in reversed(axis.path.split(".")):
            changes = {name: changes}
        machine = changed(crane, changes)
    return stability(
        machine,
        value if over == "alpha_m" else alpha_m,
        layer=int(value) if over == "layer" else None,
        delay=value if over == "delay" else delay,
        strong=False,
    )


def bode(crane: Crane, alpha_m: float = 1.0, *, delay: float = 0.0, omega: FloatArray | None = None) -> xarray.Dataset:
    """Magnitude [-] and unwrapped phase [rad] of the cut loop at the crane's K_p over omega [rad/s]: continuous, and
    with PLC and delay."""
    import xarray

    plain = position_loop(crane, alpha_m)
    with_plc = by_plc(crane, plain, delay)
    w = np.geomspace(0.01, with_plc.nyquist * 0.999, 1200) if omega is None else np.asarray(omega, dtype=np.float64)
    data = {}
    for end, loop in (("", plain), ("_plc", with_plc)):
        L = crane.control.K_p * loop.response(w)
        data[f"loop_gain{end}"] = ("omega", np.abs(L), attributes(f"loop_gain{end}"))
        data[f"loop_phase{end}"] = ("omega", np.unwrap(np.angle(L)), attributes(f"loop_phase{end}"))
    fixed = {"crane": crane.name, "K_p": crane.control.K_p, "alpha_m": alpha_m, "delay": delay}
    return xarray.Dataset(data, coords={"omega": ("omega", w, attributes("omega"))}, attrs=fixed)


def root_locus(
    crane: Crane, alpha_m: float = 1.0, *, K_wire: float = 1.0, K_p: Sequence[float] | None = None
) -> xarray.Dataset:
    """Poles of the published position loop [1/s] over K_p [1/m], each followed along its branch: real and imaginary
    part."""
    import xarray

    loop = position_loop(crane, alpha_m, K_wire=K_wire)
    limit = gain_limit(crane, alpha_m, K_wire).K_p_ms
    at = (
        np.concatenate([[0.0], np.geomspace(1e-3, 3.0, 200) * limit])
        if K_p is None
        else np.asarray(list(K_p), dtype=np.float64)
    )
    poles = [np.sort_complex(loop.closed_poles(float(at[0])))]
    for K in at[1:]:
        poles.append(_followed(poles[-1], loop.closed_poles(float(K))))
    P = np.array(poles)
    names = {"pole_re": P.real, "pole_im": P.imag}
    data = {n: (("K_p", "branch"), v, attributes(n)) for n, v in names.items()}
    return xarray.Dataset(
        data, coords={"K_p": ("K_p", at, attributes("K_p"))}, attrs={"crane": crane.name, "alpha_m": alpha_m}
    )


def _followed(before: NDArray[np.complex128], now: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Poles in the order of those before, each the nearest one."""
    from scipy.optimize import linear_sum_assignment

    _, order = linear_sum_assignment(np.abs(before[:, None] - now[None, :]))
    return np.asarray(now[order], dtype=np.complex128)


def gain_limit_figure(crane: Crane, data: xarray.Dataset, slow: xarray.Dataset) -> Figure:
    """K_p of marginal stability over displacement, with and without PLC, the range of each mode, K_p itself (paper E
    figure 5); next to the published loop the complete plant at low speed, with the crane's own damping of
    the wire and with that of paper C.

    data: `sweep(crane, "alpha_m")`; slow: `slow_sweep(crane)`.
    """

    def at(alpha_m: Any) -> Any:
        return kit.display(np.asarray(alpha_m) * crane.active.motor.D_total, "displacement")

    title = f"{crane.name}: position gain at which the winch starts to oscillate"
    figure, ax = kit.panel((7.5, 5.4), title)
    D, K_p = at(data["alpha_m"].values), crane.control.K_p
    late = f" and {1e3 * data.attrs['delay']:g} ms of delay" if data.attrs["delay"] else ""
    with_plc = f"with PLC ({1e3 * crane.control.t_cycle:g} ms){late}"
    ax.plot(D, data["K_p_ms"], color=COLOURS[0], label="published loop")
    ax.plot(D, data["K_p_ms_plc"], color=COLOURS[1], ls="--", label=with_plc)
    for colour, load in zip(COLOURS[2:], slow["load"].values, strict=False):
        name = "empty hook" if load == 0.0 else show(float(load), "mass", 4)
        for style, zeta in zip(("-", ":"), slow["wire_zeta"].values, strict=False):
            label = f"slow plant, {name}, wire damping {zeta:g}"
            limits = slow["K_p_ms_plc"].sel(load=load, wire_zeta=zeta)
            ax.plot(at(slow["alpha_m"].values), limits, color=colour, ls=style, lw=1.0, label=label)
    ax.axhline(K_p, color=GREY, ls=":", label=f"K_p of the crane, {K_p:g} 1/m")
    for i, (mode, ends) in enumerate(range_of_modes(crane).items()):  # the displacements that each mode takes
        x, y, frame = at(ends), 0.03 + 0.045 * i, ax.get_xaxis_transform()
        ax.plot(x, [y, y], color=GREY, lw=4, marker="D" if x[0] == x[1] else "", ms=5, transform=frame)
        ax.text(x[0], y, f"{mode.upper()}  ", fontsize="x-small", va="center", ha="right", transform=frame)
    ax.set(xlabel="motor displacement [cm³/rev]", ylabel="K_p of marginal stability [1/m]")
    ax.set(ylim=(0.0, None), xlim=(D[0], D[-1]))
    ax.legend(loc="upper left", fontsize="x-small", ncols=2)
    return figure


def sweep_figure(crane: Crane, sweeps: list[xarray.Dataset]) -> Figure:
    """Gain limits over layer, leakage, damping, bulk modulus, delay, each in its own panel."""
    columns, rows = 3, math.ceil(len(sweeps) / 3)
    title = f"{crane.name}: what the gain limit depends on, motors at {sweeps[0].attrs['alpha_m']:g}"
    figure, axes = kit.panels(rows, columns, (10.5, 3.4 * rows), title)
    axes = axes.ravel()
    for ax, data in zip(axes, sweeps, strict=False):
        name = str(data["K_p_ms"].dims[0])
        kind, label = next((axis.kind, axis.label) for axis in AXES.values() if axis.name == name)
        x = kit.display(data[name].values, kind)
        ax.plot(x, data["K_p_ms"], color=COLOURS[0], label="published loop")
        ax.plot(x, data["K_p_ms_plc"], color=COLOURS[1], ls="--", label="with PLC and delay")
        ax.axhline(crane.control.K_p, color=GREY, ls=":", label="K_p of the crane")
        ax.set(xlabel=label, ylabel="K_p limit [1/m]", ylim=(0.0, None))
        if name == "layer":
            ax.set_xticks([v for v in x if v % 2 == 0])
    for ax in axes[len(sweeps) :]:
        ax.set_axis_off()
    kit.legend_below(figure, [axes[0]], 4)
    return figure


def bode_figure(crane: Crane, alpha_m: Sequence[float] = (1.0,), *, delay: float = 0.0) -> Figure:
    """Loop gain and phase of the position loop over frequency, as published (solid) and with PLC and delay (dashed).

    Parameters
    ----------
    crane : Crane
        With a closed circuit.
    alpha_m : sequence of float, default (1.0,)
        Displacement of the motors over their largest [1], a colour each.
    delay : float, default 0.0
        Of the motion signals [s].

    Returns
    -------
    Figure
        Of matplotlib.
    """
    late = f" and {1e3 * delay:g} ms of delay" if delay else ""
    title = f"{crane.name}, K_p = {crane.control.K_p:g} 1/m: solid as published, dashed with PLC{late}"
    figure, axes = kit.panels(2, 1, (7.5, 6.5), title, sharex=True)
    top, bottom = axes.ravel()
    for colour, alpha in zip(COLOURS * 2, alpha_m, strict=False):
        data = bode(crane, alpha, delay=delay)
        w = data["omega"].values
        for end, style, label in (("", "-", f"motors at {alpha:.3g}"), ("_plc", "--", None)):
            top.loglog(w, data[f"loop_gain{end}"], color=colour, ls=style, lw=1.2, label=label)
            bottom.semilogx(w, np.degrees(data[f"loop_phase{end}"]), color=colour, ls=style, lw=1.2)
    top.axhline(1.0, color=GREY, lw=0.8)
    bottom.axhline(-180.0, color=GREY, lw=0.8)
    top.set(ylabel="loop gain [-]", ylim=(1e-5, 30.0))
    bottom.set(ylabel="phase [deg]", xlabel="frequency [rad/s]", ylim=(-720.0, 0.0), yticks=range(-720, 1, 90))
    top.legend(fontsize="small")
    return figure


def root_locus_figure(crane: Crane, alpha_m: Sequence[float] = (1.0, 0.6)) -> Figure:
    """Poles of the published position loop as K_p grows from 0 to three times its limit; dots at the crane's own K_p.

    Parameters
    ----------
    crane : Crane
        With a closed circuit.
    alpha_m : sequence of float, default (1.0, 0.6)
        Displacement of the motors over their largest [1], a colour each.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    title = f"{crane.name}: poles for K_p from 0 (crosses) to three times the limit; dots: K_p of the crane"
    figure, ax = kit.panel((7.5, 5.5), title)
    for colour, alpha in zip(COLOURS, alpha_m, strict=False):
        locus, now = root_locus(crane, alpha), root_locus(crane, alpha, K_p=[crane.control.K_p])
        lines = ax.plot(locus["pole_re"], locus["pole_im"], color=colour, lw=1.2)
        lines[0].set_label(f"motors at {alpha:.3g}")
        ax.plot(locus["pole_re"][0], locus["pole_im"][0], "x", color=colour)
        ax.plot(now["pole_re"].values.ravel(), now["pole_im"].values.ravel(), "o", color=colour, ms=4)
    ax.axvline(0.0, color=GREY, lw=0.8)
    ax.set(xlabel="real part [1/s]", ylabel="imaginary part [1/s]")
    ax.legend(fontsize="small")
    return figure


def motor_pole_figure(crane: Crane) -> Figure:
    """Poles of the motors' own loop and of the circuit in the position loop as the tip's speed rises under SSC, at the
    crane's K_p."""
    title = f"{crane.name}: what SSC's measured displacement does to the poles as the tip moves faster"
    figure, axes = kit.panels(1, 2, (10.0, 4.4), title)
    left, right = axes.ravel()
    modes = tuple(mode for mode in Mode if mode.compensates and moves(crane, mode))
    colours, alike = colours_of(map(str, modes)), dict[bytes, tuple[list[str], FloatArray, FloatArray]]()
    for mode in modes:
        speeds = np.linspace(0.0, 0.999 * speed_limit(crane, mode), SPEED_POINTS)
        poles = np.array([motor_poles(crane, v, mode=mode) for v in speeds])
        loops = [full_matrices(crane, about(crane, v, mode=mode), K_p=gains(crane).K_p)[0][2:, 2:] for v in speeds]
        oil = [max((p for p in np.linalg.eigvals(A) if p.imag > 0.0), key=lambda p: p.real) for A in loops]
        both = np.column_stack((poles, oil))
        alike.setdefault(np.column_stack((both, speeds)).round(6).tobytes(), ([], speeds, both))[0].append(str(mode))
    for i, (names, speeds, both) in enumerate(alike.values()):
        for p, style, what in ((both[:, :-1], "-", "motors' own loop"), (both[:, -1:], ":", "oil spring")):
            line: dict[str, Any] = {"color": colours[names[0]], "ls": style, "lw": 1.2 if i else 3.0}
            damping = -p[:, 0].real / np.abs(p[:, 0])
            left.plot(kit.display(speeds, "speed"), damping, label=f"{', '.join(names)}: {what}", **line)
            right.plot(p.real, p.imag, **line)
    left.set(xlabel="steady tip speed [m/min]", ylabel="damping ratio [-]", ylim=(0.0, 1.05))
    right.set(xlabel="real part [1/s]", ylabel="imaginary part [1/s]")
    left.legend(fontsize="small")
    return figure


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
        "sweeps": sweep_figure(crane, [d for name, d in data.items() if name not in ("alpha_m", "slow")]),
        "bode": bode_figure(crane, alphas, delay=delay),
        "root-locus": root_locus_figure(crane, alphas),
        "motor-poles": motor_pole_figure(crane),
    }
