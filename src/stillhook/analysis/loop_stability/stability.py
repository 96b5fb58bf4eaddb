"""`stability`: how far a crane's position loop is from swinging, as published and with its PLC.

The published loop (Moslatt 2020 paper E section 3) turns on the outer diameter with a full drum, one line at constant
pressure, B_v for all friction. `full_stability` does the same for the complete plant at an operating point,
`both_loops` which of the two holds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy

from stillhook.analysis.loop_stability.governing import (
    SHORTEST,
    SLOW,
    WIRES,
    Place,
    engine_loops,
    payloads_of_mode,
    plant_loop_at,
    slow_places,
    swings_alone,
    with_damped_wire,
)
from stillhook.analysis.loop_stability.linearisation import linearise, plant_loop, plc_loop, settled_displacement
from stillhook.analysis.loop_stability.margins import Margins, gain_limit_of, margins, strongest_up_to
from stillhook.analysis.loop_stability.reduced import eigenfrequency, gain_limit
from stillhook.analysis.loop_stability.transfer import (
    Loop,
    SampledLoop,
    about_at,
    command_pole,
    effective_radius,
    full_matrices,
    on_layer,
    position_loop,
    sampled,
)
from stillhook.analysis.steady.operating_point import OperatingPoint, operating_point
from stillhook.analysis.steady.steady_state import motor_law, steady
from stillhook.control.registry import DEFAULT_MODE, USUAL
from stillhook.engine.pack.winch import drum_record, wire_speed_max
from stillhook.errors import StillhookError
from stillhook.physics.load_path.drum import K_wire as ratio_of
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode


class Stability(NamedTuple):
    """The position loop of one crane at one displacement, SI.

    alpha_m [-], K_wire [-], J_m [kg m^2], v_tip [m/s]: where; K_p, K_p_ms [1/m], omega_c [rad/s]: the crane's gain,
    that of marginal stability and the frequency there; omega_0 [rad/s], zeta [-], period [s] of the active circuit;
    gain_margin, phase_margin [rad], omega_gc [rad/s], delay_margin [s], sensitivity_peak of the continuous loop (see
    `margins.Margins`); t_cycle, delay [s] and the same with PLC and delay, ending in _plc; K_p_strong [1/m] the largest
    gain that keeps a gain margin of 2, 45 degrees and a sensitivity peak of 2 with PLC and delay; poles of the whole
    closed loop [1/s]; stable, stable_plc.
    """

    alpha_m: float
    K_wire: float
    J_m: float
    v_tip: float
    K_p: float
    K_p_ms: float
    omega_c: float
    omega_0: float
    zeta: float
    period: float
    gain_margin: float
    phase_margin: float
    omega_gc: float
    delay_margin: float
    sensitivity_peak: float
    t_cycle: float
    delay: float
    K_p_ms_plc: float
    omega_c_plc: float
    gain_margin_plc: float
    phase_margin_plc: float
    omega_gc_plc: float
    delay_margin_plc: float
    sensitivity_peak_plc: float
    K_p_strong: float
    poles: tuple[complex, ...]
    stable: bool
    stable_plc: bool

    @property
    def ok(self) -> bool:
        """Whether the loop dies out, as published and with PLC and delay, with positive margins."""
        return self.stable and self.stable_plc and self.gain_margin > 1.0 and self.gain_margin_plc > 1.0

    def table(self) -> dict[str, Any]:
        """Name -> value in SI; poles as pairs of real and imaginary part."""
        return self._asdict() | {"poles": [[p.real, p.imag] for p in self.poles]}


def stability(
    crane: Crane, alpha_m: float | None = None, *, layer: int | None = None, v_tip: float = 0.0, delay: float = 0.0
) -> Stability:
    """Margins of the published position loop.

    Parameters: alpha_m displacement of the motors [-], default the displacement of SSC at v_tip: 1 at rest; layer that
    the drum turns on, with the inertia of a drum that is full up to it, default the published outer diameter and full
    drum; v_tip steady speed of the tip [m/s], which closes the motors' own loop through the measured displacement (it
    moves two poles and no limit); delay [s] of the position feedback's complete path around the loop, for the values
    that end in _plc. It is not the delay of the motion unit, which is outside the loop and affects the error, not
    stability.

    Errors: StillhookError for a number outside its range, K_p = 0, or a tip so fast that the pumps are full, which have
    no feedback.
    Source: Moslatt 2020 paper E eqs 12 to 21, corrected (`stillhook.analysis.loop_stability.transfer`); PLC and
    delay are not in print.
    """
    return published_stability(crane, alpha_m, layer, v_tip, delay, strong=True)


def published_stability(
    crane: Crane, alpha_m: float | None, layer: int | None, v_tip: float, delay: float, *, strong: bool
) -> Stability:
    machine, K_wire = (crane, 1.0) if layer is None else on_layer(crane, layer)
    _check(v_tip, delay)
    alpha = steady(machine, -v_tip, DEFAULT_MODE, K_wire=K_wire).alpha_m if alpha_m is None else alpha_m
    e, limit = eigenfrequency(machine, alpha), gain_limit(machine, alpha, K_wire)
    plain = position_loop(machine, alpha, K_wire=K_wire)
    with_plc = sampled(plain, crane.control.t_cycle, delay + crane.control.computing)
    at = about_at(machine, v_tip, alpha, -v_tip / effective_radius(machine, K_wire), K_wire=K_wire)
    v_full = wire_speed_max(crane, alpha) / K_wire
    if abs(v_tip) > v_full:
        raise StillhookError(
            f"v_tip = {v_tip:g} m/s: the pumps are full at {v_full:.3g} m/s with the motors at {alpha:.3g}. Give a"
            " slower tip."
        )
    A = full_matrices(machine, at, K_wire=K_wire)[0]
    where = {"alpha_m": alpha, "K_wire": K_wire, "J_m": e.J_m, "v_tip": v_tip}
    values = {
        "K_p_ms": limit.K_p_ms,
        "omega_c": limit.omega_c,
        "omega_0": e.omega_0,
        "zeta": e.zeta,
        "period": e.period,
    }
    result = _stability(crane, where, values, (plain, with_plc), delay, np.linalg.eigvals(A), strong=strong)
    settles = abs(command_pole(machine, at, K_wire=K_wire)) < 1.0
    return result._replace(stable_plc=result.stable_plc and settles)


def full_stability(
    crane: Crane,
    *,
    load: float,
    s_w: float,
    v_tip: float,
    alpha_m: float | None = None,
    mode: Mode | str = DEFAULT_MODE,
    delay: float = 0.0,
) -> tuple[Stability, OperatingPoint]:
    """The same of the complete plant while it compensates a steady tip speed, by numeric linearisation, and the
    operating point.

    Parameters: load payload [kg]; s_w wire paid out [m]; v_tip steady speed of the tip, up positive [m/s]; alpha_m [-],
    default where the mode's law holds the motors; mode; delay [s] of the position feedback.
    K_p_ms is that of the plant with motors and passive circuit standing, as in paper E; with PLC all loops are closed,
    poles as well. omega_0 and zeta are those of the mode in which the winch oscillates on the oil of its lines.
    Errors: StillhookError for a point that the winch cannot reach, or a winch at rest, which sticks.
    """
    _check(v_tip, delay)
    if v_tip == 0.0:
        raise StillhookError(
            "v_tip = 0: a winch at rest sticks, and its loop has no limit until it slides. Give a speed, such as 10"
            " m/min."
        )

    def at(alpha: float) -> OperatingPoint:
        return operating_point(crane, -v_tip, alpha, load=load, s_w=s_w, v_tip=v_tip)

    point = settled_displacement(crane, at, mode) if alpha_m is None else at(alpha_m)
    linear = linearise(point)
    plain, with_plc = plant_loop(linear), plc_loop(crane, point, mode=mode, delay=delay)
    swing = max((m for m in linear.modes() if m.pole.imag > 0.0), key=lambda m: m.share("p_a", "p_b", "omega_m"))
    limit = margins(plain, crane.control.K_p)
    where = {
        "alpha_m": point.alpha_m,
        "K_wire": float(ratio_of(point.geometry.d, drum_record(crane))),
        "J_m": 1.0 / point.geometry.i_J,
        "v_tip": v_tip,
    }
    values = {
        "K_p_ms": limit.gain_margin * crane.control.K_p,
        "omega_c": limit.omega_c,
        "omega_0": swing.omega_0,
        "zeta": swing.zeta,
        "period": 2.0 * math.pi / swing.omega_0,
    }
    z = with_plc.closed_poles(crane.control.K_p)
    poles = np.log(z[np.abs(z) > 1e-6]) / with_plc.t_cycle
    return _stability(crane, where, values, (plain, with_plc), delay, poles), point


class BothLoops(NamedTuple):
    """The published loop and the complete plant where it has the lowest gain limit: place, None where the gain
    decides nowhere; swings: places where the plant oscillates whatever the gain."""

    published: Stability
    plant: Stability | None
    place: Place | None
    swings: tuple[Place, ...] = ()

    @property
    def governing(self) -> Stability:
        """The one of the two with the lower gain limit, with PLC and delay or without."""
        if self.plant is None or min(self.published.K_p_ms, self.published.K_p_ms_plc) < min(
            self.plant.K_p_ms, self.plant.K_p_ms_plc
        ):
            return self.published
        return self.plant

    @property
    def ok(self) -> bool:
        """Whether both die out with positive margins; oscillations whatever the gain are not caused by the position
        loop."""
        return self.published.ok and (self.plant is None or self.plant.ok)

    def table(self) -> dict[str, Any]:
        """Name -> value in SI of the published loop; under "plant" the same of the plant, its payload and wire;
        "governs" which holds; "swings" where the plant oscillates whatever the gain."""
        plant = (
            None
            if self.plant is None or self.place is None
            else self.plant.table() | {"load": self.place.load, "s_w": self.place.s_w}
        )
        governs = "published" if self.governing is self.published else "plant"
        return self.published.table() | {
            "governs": governs,
            "plant": plant,
            "swings": [p._asdict() for p in self.swings],
        }


def both_loops(
    crane: Crane,
    alpha_m: float | None = None,
    *,
    v_tip: float = 0.0,
    delay: float = 0.0,
    loads: Sequence[float] | None = None,
    wires: Sequence[float] = (SHORTEST, *WIRES),
) -> BothLoops:
    """Margins of the published loop, and of the complete plant at that of its operating points where the gain limit is
    lowest.

    Parameters: alpha_m, v_tip, delay as in `stability`; the plant has the same displacement, or the one that SSC sets
    at each point. loads payloads [kg], default empty hook and SWL; wires paid out [m]. The tip moves at v_tip, or at 2
    and 5 m/min up and down where v_tip is 0: there friction falls with speed most.
    Limits are those of a load that does not ring on its wire (`stillhook.analysis.loop_stability.governing`); where the
    real one swings is in `swings`. Errors: as `stability` and `full_stability`.
    """
    published = stability(crane, alpha_m, v_tip=v_tip, delay=delay)
    masses = payloads_of_mode(crane, DEFAULT_MODE) if loads is None else tuple(loads)
    places = (
        slow_places(masses, wires, SLOW) if v_tip == 0.0 else [Place(m, s_w, v_tip) for m in masses for s_w in wires]
    )
    damped_crane, swings = with_damped_wire(crane), []
    limits: dict[Place, float] = {}
    for place in places:
        damped, real = (
            plant_loop_at(c, DEFAULT_MODE, place, alpha_m=alpha_m, delay=delay) for c in (damped_crane, crane)
        )
        if damped is not None:
            limits[place] = gain_limit_of(damped.loop)[0]
        if real is not None and gain_limit_of(real.loop)[0] == 0.0:
            swings.append(place)
    if not limits:
        return BothLoops(published, None, None)
    least = min(limits, key=lambda p: limits[p])
    plant, _ = full_stability(
        damped_crane, load=least.load, s_w=least.s_w, v_tip=least.v_tip, alpha_m=alpha_m, delay=delay
    )
    return BothLoops(published, plant, least, tuple(swings))


class EngineStability(NamedTuple):
    """The position loop of a winch type without the closed circuit of the thesis, out of its linearised engine, at the
    place where the gain limit is lowest: load [kg], s_w [m], v_tip [m/s]; K_p, and with the PLC and delay K_p_ms_plc
    [1/m], omega_c_plc [rad/s] and the margins of `margins.Margins`; K_p_strong [1/m] as in `Stability`; swings: places
    where the plant oscillates whatever the gain."""

    load: float
    s_w: float
    v_tip: float
    K_p: float
    K_p_ms_plc: float
    omega_c_plc: float
    gain_margin_plc: float
    phase_margin_plc: float
    omega_gc_plc: float
    delay_margin_plc: float
    sensitivity_peak_plc: float
    K_p_strong: float
    t_cycle: float
    delay: float
    stable_plc: bool
    swings: tuple[Place, ...]

    @property
    def ok(self) -> bool:
        """Whether the loop dies out with a positive margin."""
        return self.stable_plc and self.gain_margin_plc > 1.0

    @property
    def place(self) -> Place:
        """Where the winch compensates."""
        return Place(self.load, self.s_w, self.v_tip)

    def table(self) -> dict[str, Any]:
        """Name -> value in SI."""
        return self._asdict() | {"swings": [p._asdict() for p in self.swings]}


def engine_stability(
    crane: Crane,
    mode: Mode | None = None,
    *,
    v_tip: float = 0.0,
    delay: float = 0.0,
    loads: Sequence[float] | None = None,
    wires: Sequence[float] = (SHORTEST, *WIRES),
) -> EngineStability:
    """Margins of any winch type's position loop, out of its engine as it runs; parameters as `both_loops`.

    mode: default the usual one of the winch type. Loads do not ring on their wire, as in `both_loops`; where the real
    one swings is in `swings`. On closed circuits this agrees with `full_stability` within 1 %.
    """
    _check(v_tip, delay)
    law = crane.plant.type.default_mode if mode is None else mode
    masses = payloads_of_mode(crane, law) if loads is None else tuple(loads)
    places = (
        slow_places(masses, wires, SLOW) if v_tip == 0.0 else [Place(m, s_w, v_tip) for m in masses for s_w in wires]
    )
    loops = engine_loops(with_damped_wire(crane), law, places, delay=delay)
    place, loop = min(loops, key=lambda pair: gain_limit_of(pair[1])[0])
    found = margins(loop, crane.control.K_p)
    return EngineStability(
        *place,
        K_p=crane.control.K_p,
        K_p_ms_plc=found.gain_margin * crane.control.K_p,
        omega_c_plc=found.omega_c,
        **_named(found, "_plc"),
        K_p_strong=min(strongest_up_to(each) for _, each in loops),
        t_cycle=crane.control.t_cycle,
        delay=delay,
        stable_plc=found.stable,
        swings=tuple(p for p, each in engine_loops(crane, law, places, delay=delay) if swings_alone(each)),
    )


def _check(v_tip: float, delay: float) -> None:
    if not math.isfinite(v_tip):
        raise StillhookError(f"v_tip = {v_tip:g} m/s: give a finite speed.")
    if not 0.0 <= delay < 10.0:
        raise StillhookError(f"delay = {delay:g} s: allowed is 0 up to 10 s.")


def _stability(
    crane: Crane,
    where: Mapping[str, float],
    values: Mapping[str, float],
    loops: tuple[Loop, SampledLoop],
    delay: float,
    poles: Any,
    *,
    strong: bool = True,
) -> Stability:
    K_p = crane.control.K_p
    plain, with_plc = (margins(loop, K_p) for loop in loops)
    return Stability(
        **where,
        **values,
        **_named(plain, ""),
        **_named(with_plc, "_plc"),
        K_p=K_p,
        t_cycle=crane.control.t_cycle,
        delay=delay,
        K_p_ms_plc=with_plc.gain_margin * K_p,
        omega_c_plc=with_plc.omega_c,
        K_p_strong=strongest_up_to(loops[1]) if strong else math.nan,
        poles=tuple(complex(p) for p in sorted(poles, key=lambda p: (abs(p), p.imag))),
        stable=plain.stable,
        stable_plc=with_plc.stable,
    )


def _named(m: Margins, end: str) -> dict[str, Any]:
    names = ("gain_margin", "phase_margin", "omega_gc", "delay_margin", "sensitivity_peak")
    return {f"{n}{end}": getattr(m, n) for n in names}


def least_limit(crane: Crane) -> tuple[float, float]:
    """Displacement at which the gain limit is lowest [-], and that limit [1/m]: below, where no mode goes, it rises
    again.

    There the winch oscillates so slowly that the decay of the circuit alone, which does not depend on the displacement,
    holds it.
    """
    minimum = scipy.optimize.minimize_scalar(
        lambda a: gain_limit(crane, a).K_p_ms, bounds=(1e-3, 1.0), method="bounded", options={"xatol": 1e-9}
    )
    return float(minimum.x), float(minimum.fun)


def range_of_modes(crane: Crane) -> dict[str, tuple[float, float]]:
    """Least and largest displacement that each mode takes on the outermost layer [-]; under SSC with a load that asks
    for no more."""
    laws = {mode.value: motor_law(crane, mode) for mode in reversed(USUAL)}
    ends = {name: (law(0.0), law(1.0)) for name, law in laws.items()}
    return {name: (min(both), max(both)) for name, both in ends.items()}
