"""The analyses of one operating point as users call them: quantities are text with a unit. The modules below calculate
in SI."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from stillhook.analysis import controllers
from stillhook.analysis.controllers import Controller
from stillhook.analysis.loop_stability import margins, sweeps
from stillhook.analysis.loop_stability import stability as loop_stability
from stillhook.analysis.loop_stability.stability import Stability
from stillhook.analysis.loop_stability.sweeps import Over
from stillhook.analysis.steady import operating_point as operation
from stillhook.analysis.steady.operating_point import OperatingPoint
from stillhook.control.registry import DEFAULT_MODE
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import FrictionModel, Mode, Water
from stillhook.units import parse

if TYPE_CHECKING:
    import xarray


def stability(
    crane: Crane, alpha_m: float | None = None, *, layer: int | None = None, v_tip: str = "0 m/s", delay: str = "0 s"
) -> Stability:
    """Margins of the published position loop; see `stillhook.analysis.loop_stability.stability.stability`.

    Parameters: alpha_m displacement of the motors [-]; layer of the drum; v_tip steady speed of the tip, such as "60
    m/min"; delay of the position feedback, such as "50 ms". Errors: UnitError for a quantity without its unit, else as
    there.
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
    """The same of the complete plant at an operating point; see
    `stillhook.analysis.loop_stability.stability.full_stability`.

    Parameters: load "100 t"; s_w wire paid out, "100 m"; v_tip "60 m/min", up positive; alpha_m [-]; mode; delay "50
    ms".
    Errors: UnitError for a quantity without its unit, else as there.
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
    over: Over | str = Over.ALPHA_M,
    values: Sequence[str] | Sequence[float] | None = None,
    *,
    alpha_m: float = 1.0,
    delay: str = "0 s",
) -> xarray.Dataset:
    """Gain limit and margins over one quantity; see `stillhook.analysis.loop_stability.sweeps.sweep`.

    Parameters: over as there; values with their unit, such as ["0 ms", "50 ms"], and numbers of displacements and
    layers alone; alpha_m [-]; delay "50 ms". Errors: UnitError for a quantity without its unit, else as there.
    """
    kind = sweeps.AXES[Over(over)].kind if over in tuple(Over) else ""
    at = [parse(v, kind, f"values[{i}]") for i, v in enumerate(values)] if kind and values is not None else values
    return sweeps.sweep(crane, over, at, alpha_m=alpha_m, delay=parse(delay, "time", "delay"))  # type: ignore[arg-type]


def strongest_gain(
    crane: Crane,
    *,
    alpha_m: float | None = None,
    delay: str = "0 s",
    gain_margin: float = margins.GAIN_MARGIN,
    phase_margin: str = "45 deg",
    sensitivity: float = margins.SENSITIVITY_PEAK,
) -> float:
    """Largest position gain K_p [1/m] that keeps all three margins; see
    `stillhook.analysis.loop_stability.margins.strongest_gain`.

    Parameters: alpha_m, gain_margin, sensitivity [-]; delay "50 ms"; phase_margin "60 deg".
    Errors: UnitError for a quantity without its unit, else as there.
    """
    return margins.strongest_gain(
        crane,
        alpha_m=alpha_m,
        delay=parse(delay, "time", "delay"),
        gain_margin=gain_margin,
        phase_margin=parse(phase_margin, "angle", "phase_margin"),
        sensitivity=sensitivity,
    )


def strong_ssc(crane: Crane, *, delay: str = "0 s") -> Controller:
    """SSC with the strongest gain, aligned in time, for a motion signal that is `delay` late; see
    `controllers.strong_ssc`.

    Parameters: delay "100 ms". Errors: UnitError for a delay without its unit, else as there.
    """
    return controllers.strong_ssc(crane, delay=parse(delay, "time", "delay"))


def operating_point(
    crane: Crane,
    v_w: str,
    alpha_m: float,
    *,
    load: str,
    s_w: str,
    v_tip: str = "0 m/s",
    water: Water | None = None,
    friction: FrictionModel = FrictionModel.LUGRE,
    V_o: str | None = None,
    alpha_pp: float | None = None,
) -> OperatingPoint:
    """Operating point of the complete plant at a constant wire speed; see
    `stillhook.analysis.steady.operating_point.operating_point`.

    Parameters: v_w wire speed "80 m/min", hoisting positive; alpha_m, alpha_pp [-]; load "90 t"; s_w wire paid out "100
    m"; v_tip of the tip "-80 m/min"; water and friction as in a Scenario; V_o oil in the accumulator "600 L".
    Errors: UnitError for a quantity without its unit, else as there.
    """
    return operation.operating_point(
        crane,
        parse(v_w, "speed", "v_w"),
        alpha_m,
        load=parse(load, "mass", "load"),
        s_w=parse(s_w, "length", "s_w"),
        v_tip=parse(v_tip, "speed", "v_tip"),
        water=water,
        friction=friction,
        V_o=None if V_o is None else parse(V_o, "volume", "V_o"),
        alpha_pp=alpha_pp,
    )
