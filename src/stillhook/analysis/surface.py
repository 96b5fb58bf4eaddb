"""The analyses of one operating point as users call them: quantities are text with a unit. The modules below calculate
in SI."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from stillhook.analysis import controllers
from stillhook.analysis.controllers import Controller
from stillhook.analysis.loop_stability import stability as loop_stability
from stillhook.analysis.loop_stability import sweeps
from stillhook.analysis.loop_stability.margins import GAIN_MARGIN, SENSITIVITY_PEAK, strongest_up_to
from stillhook.analysis.loop_stability.stability import Stability
from stillhook.analysis.loop_stability.transfer import by_plc, position_loop
from stillhook.analysis.steady import operating_point as operation
from stillhook.analysis.steady.operating_point import OperatingPoint
from stillhook.control.registry import DEFAULT_MODE
from stillhook.errors import StillhookError
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Water
from stillhook.units import parse

if TYPE_CHECKING:
    import xarray


def stability(
    crane: Crane, alpha_m: float | None = None, *, layer: int | None = None, v_tip: str = "0 m/s", delay: str = "0 s"
) -> Stability:
    """Margins of the published position loop; see `stillhook.analysis.loop_stability.stability.stability`.

    Parameters
    ----------
    crane : Crane
        The machine.
    alpha_m : float, optional
        Displacement of the motors over its maximum [-]; default that of SSC at v_tip.
    layer : int, optional
        Layer of the drum; default the published outer diameter.
    v_tip : str, default "0 m/s"
        Steady speed of the tip, such as "60 m/min", up positive.
    delay : str, default "0 s"
        Delay of the position feedback, such as "50 ms".

    Returns
    -------
    Stability
        Gain limit [1/m], margins and poles, without and with the PLC.

    Raises
    ------
    UnitError
        For a quantity without its unit.
    StillhookError
        As there.
    """
    return loop_stability.stability(
        crane, alpha_m, layer=layer, v_tip=parse(v_tip, "speed", "v_tip"), delay=parse(delay, "time", "delay")
    )


def full_stability(
    crane: Crane,
    *,
    load: str,
    s_w: str,
    v_tip: str,
    alpha_m: float | None = None,
    mode: Mode | str = DEFAULT_MODE,
    delay: str = "0 s",
) -> tuple[Stability, OperatingPoint]:
    """Margins of the complete plant at an operating point.

    See `stillhook.analysis.loop_stability.stability.full_stability`.

    Parameters
    ----------
    crane : Crane
        The machine.
    load : str
        Payload, such as "100 t".
    s_w : str
        Wire paid out, such as "100 m".
    v_tip : str
        Steady speed of the tip, such as "60 m/min", up positive.
    alpha_m : float, optional
        Displacement of the motors over its maximum [-]; default where the mode's law holds them.
    mode : Mode or str, default "ssc"
        Controller.
    delay : str, default "0 s"
        Delay of the position feedback, such as "50 ms".

    Returns
    -------
    Stability
        Gain limit [1/m], margins and poles.
    OperatingPoint
        The point at which they hold.

    Raises
    ------
    UnitError
        For a quantity without its unit.
    StillhookError
        As there.
    """
    return loop_stability.full_stability(
        crane,
        load=parse(load, "mass", "load"),
        s_w=parse(s_w, "length", "s_w"),
        v_tip=parse(v_tip, "speed", "v_tip"),
        alpha_m=alpha_m,
        mode=mode,
        delay=parse(delay, "time", "delay"),
    )


def sweep(
    crane: Crane,
    over: str = "alpha_m",
    values: Sequence[str] | Sequence[float] | None = None,
    *,
    alpha_m: float = 1.0,
    delay: str = "0 s",
) -> xarray.Dataset:
    """Gain limit and margins over one quantity; see `stillhook.analysis.loop_stability.sweeps.sweep`.

    Parameters
    ----------
    crane : Crane
        The machine.
    over : {"alpha_m", "layer", "leakage", "damping", "bulk_modulus", "delay"}
        The quantity; default "alpha_m".
    values : sequence of str or float, optional
        With their unit, such as ["0 ms", "50 ms"]; plain numbers of displacements and layers alone; default a range
        about the crane's own.
    alpha_m : float, default 1.0
        Displacement in sweeps over something else [-].
    delay : str, default "0 s"
        Delay of the position feedback, such as "50 ms".

    Returns
    -------
    Dataset
        Over that quantity [SI], variables as in `Stability`.

    Raises
    ------
    UnitError
        For a quantity without its unit.
    StillhookError
        As there.
    """
    kind = sweeps.AXES[over].kind if over in sweeps.AXES else ""
    at = [parse(v, kind, f"values[{i}]") for i, v in enumerate(values)] if kind and values is not None else values
    return sweeps.sweep(crane, over, at, alpha_m=alpha_m, delay=parse(delay, "time", "delay"))  # type: ignore[arg-type]


def strongest_gain(
    crane: Crane,
    *,
    alpha_m: float | None = None,
    delay: str = "0 s",
    gain_margin: float = GAIN_MARGIN,
    phase_margin: str = "45 deg",
    sensitivity: float = SENSITIVITY_PEAK,
) -> float:
    """Largest position gain that keeps all three margins, with the PLC and any delay up to the given one.

    Of the published loop on the outermost layer; the delay is that of the complete path around the loop.

    Parameters
    ----------
    crane : Crane
        The machine.
    alpha_m : float, optional
        Displacement of the motors over its maximum [-]; default the least that any mode may use.
    delay : str, default "0 s"
        Delay of the position feedback, such as "50 ms".
    gain_margin : float, default 2.0
        Gain margin to keep, above 1 [-].
    phase_margin : str, default "45 deg"
        Phase margin to keep, such as "60 deg".
    sensitivity : float, default 2.0
        Sensitivity peak to keep, above 1 [-].

    Returns
    -------
    float
        K_p [1/m].

    Raises
    ------
    UnitError
        For a quantity without its unit.
    StillhookError
        For a margin or a delay outside its range.
    """
    late, phase = parse(delay, "time", "delay"), parse(phase_margin, "angle", "phase_margin")
    if not 0.0 <= late < 10.0:
        raise StillhookError(f"delay = {late:g} s: allowed is 0 up to 10 s.")
    if not (gain_margin > 1.0 and sensitivity > 1.0 and 0.0 < phase < math.pi / 2.0):
        raise StillhookError(
            f"gain_margin = {gain_margin:g}, phase_margin = {math.degrees(phase):.4g} deg, sensitivity ="
            f" {sensitivity:g}:"
            " gain margin and sensitivity peak must be above 1, the phase margin above 0 and below 90 deg."
        )
    alpha = crane.active.motor.alpha_min if alpha_m is None else alpha_m
    loop = by_plc(crane, position_loop(crane, alpha), late)
    return strongest_up_to(loop, (gain_margin, phase, sensitivity))


def strong_ssc(crane: Crane, *, delay: str = "0 s", command_delay: str = "0 s") -> Controller:
    """SSC with the strongest gain, aligned in time, for late signals or commands; see `controllers.strong_ssc`.

    Parameters
    ----------
    crane : Crane
        The machine.
    delay : str, default "0 s"
        By which the motion signal is late, such as "100 ms".
    command_delay : str, default "0 s"
        By which commands reach the drive late, as over a bus: the lead of the feedforward alone is longer by it.

    Returns
    -------
    Controller
        "strong-ssc" for this crane.

    Raises
    ------
    UnitError
        For a delay without its unit.
    StillhookError
        As there.
    """
    late = parse(command_delay, "time", "command_delay")
    return controllers.strong_ssc(crane, delay=parse(delay, "time", "delay"), command_delay=late)


def operating_point(
    crane: Crane,
    v_w: str,
    alpha_m: float,
    *,
    load: str,
    s_w: str,
    v_tip: str = "0 m/s",
    water: Water | None = None,
    V_o: str | None = None,
    alpha_pp: float | None = None,
) -> OperatingPoint:
    """Operating point of the complete plant at a constant wire speed.

    See `stillhook.analysis.steady.operating_point.operating_point`.

    Parameters
    ----------
    crane : Crane
        The machine.
    v_w : str
        Wire speed, such as "80 m/min", hoisting positive.
    alpha_m : float
        Displacement of the active motors over its maximum, above 0 up to 1 [-].
    load : str
        Payload, such as "90 t".
    s_w : str
        Wire paid out, such as "100 m".
    v_tip : str, default "0 m/s"
        Constant speed of the tip, such as "-80 m/min", up positive.
    water : Water, optional
        As in a Scenario; default none.
    V_o : str, optional
        Oil in the accumulator, such as "600 L"; default mid stroke.
    alpha_pp : float, optional
        Setting of the passive pumps [-]; default the PLC's command once the mean pressure has settled.

    Returns
    -------
    OperatingPoint
        State of the plant [SI].

    Raises
    ------
    UnitError
        For a quantity without its unit.
    StillhookError
        As there.
    """
    parts = {} if V_o is None else {"V_o": parse(V_o, "volume", "V_o")}
    if alpha_pp is not None:
        parts["alpha_pp"] = alpha_pp
    return operation.operating_point(
        crane,
        parse(v_w, "speed", "v_w"),
        alpha_m,
        load=parse(load, "mass", "load"),
        s_w=parse(s_w, "length", "s_w"),
        v_tip=parse(v_tip, "speed", "v_tip"),
        water=water,
        **parts,
    )
