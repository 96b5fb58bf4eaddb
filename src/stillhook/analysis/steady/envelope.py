"""How fast a winch can follow at each load and layer, under each controller, and what stops it; settings against wire
speed."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook._version import __version__
from stillhook.analysis.axes import Texts, quantities
from stillhook.analysis.controllers import Controller, controllers
from stillhook.analysis.steady.limits import RESERVE, Direction, Limit, Station, Top, top_of_drive
from stillhook.analysis.steady.steady_state import steady, wire_out_on
from stillhook.base.progress import Meter, Progress
from stillhook.control.commands import displacement_calc_min
from stillhook.control.registry import CLASSIC, Mode
from stillhook.engine.pack.winch import plc_record, wire_speed_max
from stillhook.engine.scenario.checks import notes_of
from stillhook.errors import StillhookError
from stillhook.library import crane_toml
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.spec.settings import left_out
from stillhook.tables.plausible import implausible_values
from stillhook.units import parse
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    import xarray

PHYSICAL = "physical"
"""Label of what the machine can do with any controller."""


def _standard(crane: Crane) -> Controllers:
    """Controllers of a range where none are named: those with settings of the motors, or those of the drive."""
    modes = [mode for mode in crane.plant.type.modes if mode.compensates]
    return [mode for mode in modes if mode.law.uses] or modes


LOADS = tuple(n / 20 for n in range(21))
"""Default loads over the SWL."""
SPEEDS = 121
"""Default number of wire speeds of setting curves."""
CELL = ("mode", "layer", "load", "direction")
Controllers = Sequence[Mode | str | Controller]


def envelope(
    crane: Crane,
    *,
    layers: Sequence[int] | None = None,
    loads: Texts | None = None,
    modes: Controllers | None = None,
    reserve: float = RESERVE,
    progress: Progress | None = None,
) -> xarray.Dataset:
    r"""Load-speed operating range: highest wire speed of every controller, and of the machine with any controller.

    Parameters
    ----------
    crane : Crane
        The machine.
    layers : sequence of int, optional
        Counted from the bare drum; default the outermost alone.
    loads : str or sequence of str, optional
        Payloads as for a map, ["90 t", "120 t"] or "0 % to 100 % by 20 %" of the SWL; default 0 to the SWL in steps of
        5 %.
    modes : sequence of str, Mode or Controller, optional
        Controllers; default those with settings of the motors, or those of the drive.
    reserve : float, default 0.3
        Part of the static load that the active motors can deliver on top of what they hold [-].
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Dataset
        Over ("mode", "layer", "load", "direction") in SI. v_w_top [m/s] without sign, NaN where the mode may not be
        used, and binds, the limit that stops it; alpha_m_top, alpha_p_top [-], dp_m_top [Pa], omega_m_top [rad/s]
        there; v_w_limit over "limit" as well: the speed that each limit alone allows (inf: it never binds, NaN: it
        allows none); by layer and load alpha_least (D_m_min of SSC), alpha_reserve, alpha_pm_hold [-], and the
        hyperbolas of constant power v_w_power (the reserve at relief pressure) and v_w_power_rule (the same force at
        the pressure at which alpha_swl holds it) [m/s]; load_most(mode) [kg]; attribute notes: what the winch type
        means at the heaviest load, and implausible numbers.

    Raises
    ------
    UnitError
        For a load without its unit.
    StillhookError
        For an unknown layer, a load above the SWL, a mode named twice or manual mode.

    Notes
    -----
    At a constant wire speed, compensating, with leakage and friction of the complete plant, a winch is stopped by the
    first of: full pumps; relief valves opening; less torque in reserve than the rule requires; active or passive motors
    turning faster than their displacement allows (the limit rises from n_max_full to n_max as the displacement falls).
    Gears and drum have no separate limit in a crane file: the makers' limits are part of the motors' smallest
    displacement (Moslatt 2020 eq. 2.11). NS may carry the SWL, HS 60 % of it. Without a mode ("physical") the
    motors are at the best displacement of all.

    Source: Moslatt 2020 paper C figure 4 and section "Considered system".
    Differs from print: paper C's rectangles end at one speed for all loads; here leakage and friction grow with the
    load.
    """
    kg = [f * crane.SWL for f in LOADS] if loads is None else quantities(loads, "mass", "loads", percent_of=crane.SWL)
    return envelope_at(crane, kg, layers=layers, modes=modes, reserve=reserve, progress=progress)


SEARCHED = 100.0
"""Time of a machine that power stops, whose best displacement is searched for, over that of other cells."""


def envelope_at(
    crane: Crane,
    loads: Sequence[float],
    *,
    layers: Sequence[int] | None = None,
    modes: Controllers | None = None,
    reserve: float = RESERVE,
    progress: Progress | None = None,
) -> xarray.Dataset:
    """The same at loads in kg; see `envelope`."""
    if not 0.0 <= reserve <= 1.0:
        raise StillhookError(f"reserve = {reserve:g}: a part of the load, from 0 to 1. Give a value in between.")
    chosen, kg = controllers(_standard(crane) if modes is None else modes, "modes"), list(loads)
    numbers = [crane.drum.layers] if layers is None else list(layers)
    cranes = [*(c.on(crane) for c in chosen), crane]
    attrs: dict[str, Any] = {"crane": crane_toml(crane), "stillhook": __version__}
    if crane.plant.type.steady_operation:
        attrs["reserve"] = reserve
        columns = _of_circuit(crane, cranes, chosen, kg, numbers, reserve, progress)
    else:
        columns = _of_drive(crane, cranes, kg, numbers, progress)
    columns["load_most"] = np.array([*(c.mode.law.swl_share * crane.SWL for c in chosen), crane.SWL])
    attrs["notes"] = "; ".join((*implausible_values(crane), *_notes(crane, cranes[:-1], chosen, numbers, kg)))
    return _dataset(columns, [*(c.name for c in chosen), PHYSICAL], numbers, kg, attrs)


def _of_circuit(
    crane: Crane,
    cranes: Sequence[Crane],
    chosen: Sequence[Controller],
    kg: list[float],
    layers: list[int],
    reserve: float,
    progress: Progress | None,
) -> dict[str, Any]:
    """The range of a closed circuit: every limit of every controller and, last, of the machine."""
    wire = [wire_out_on(crane, n) for n in layers or [0]]
    shape = (len(cranes), len(layers), len(kg), len(Direction))
    columns = _columns(shape)

    def station_at(i: int, j: int, k: int, n: int) -> Station:
        return Station(cranes[i], kg[k], wire[j], tuple(Direction)[n], reserve)

    of_machine = {at: station_at(*at) for at in np.ndindex(*shape) if at[0] == len(chosen)}
    weights = {at: SEARCHED if station.power_binds else 1.0 for at, station in of_machine.items()}
    meter = Meter(math.prod(shape) - len(weights) + sum(weights.values()), progress)
    meter.tell()
    for at in np.ndindex(*shape):
        station = of_machine[at] if at in of_machine else station_at(*at)
        top = station.top_of_machine() if at in of_machine else station.top_of_mode(chosen[at[0]].mode)
        _store(columns, at, station, top)
        meter.part(weights.get(at, 1.0))(1.0)
    return columns


def _of_drive(
    crane: Crane, cranes: Sequence[Crane], kg: list[float], layers: list[int], progress: Progress | None
) -> dict[str, Any]:
    """The range of a winch type that states its own speed limit: v_w_top, omega_m_top and binds alone, for every
    controller the same. A drive whose wire speed is the same on every layer turns no drum: it has no omega_m_top."""
    shape = (len(cranes), len(layers), len(kg), len(Direction))
    v, omega, binds = np.full(shape, math.nan), np.full(shape, math.nan), np.full(shape, "", dtype=object)
    meter = Meter(math.prod(shape), progress)
    meter.tell()
    for at in np.ndindex(*shape):
        i, j, k, n = at
        s_w = wire_out_on(crane, layers[j])
        v[at], omega[at], binds[at] = top_of_drive(cranes[i], kg[k], s_w, tuple(Direction)[n])
        meter.part(1.0)(1.0)
    turns = crane.plant.type.full_wire_speed(crane) is None
    return {"v_w_top": v, "binds": binds} | ({"omega_m_top": omega} if turns else {})


def _notes(
    crane: Crane,
    cranes: Sequence[Crane],
    chosen: Sequence[Controller],
    layers: Sequence[int],
    loads: Sequence[float],
) -> list[str]:
    """What the winch type means at the heaviest load that each controller may be used with, on the outermost of the
    layers."""
    s_w = wire_out_on(crane, max(layers))
    cases, machines = [], []
    for machine, c in zip(cranes, chosen, strict=True):
        most = c.mode.law.swl_share * crane.SWL * (1.0 + 1e-9)
        carried = [load for load in loads if load <= most]
        if carried:
            machines.append(machine)
            cases.append(Scenario(load=f"{max(carried)!r} kg", s_w=f"{s_w!r} m", mode=c.mode))
    return [*notes_of(machines, cases), *left_out(crane.sensors)]


def setting_curves(
    crane: Crane,
    *,
    modes: Controllers | None = None,
    v_w: Texts | None = None,
    load: str = "0 t",
    layer: int | None = None,
    direction: Direction | str = Direction.HOISTING,
) -> xarray.Dataset:
    """Steady pump and motor setting against wire speed.

    Of the ideal machine of the published figures and of the whole plant.

    Parameters
    ----------
    crane : Crane
        The machine.
    modes : sequence of str, Mode or Controller, optional
        Controllers; default those with settings of the motors, or those of the drive.
    v_w : str or sequence of str, optional
        Wire speeds without sign, ["40 m/min", "80 m/min"] or "0 m/s to 2 m/s by 0.1 m/s"; default from 0 to a little
        above the speed of full pumps and the smallest displacement.
    load : str, default "0 t"
        Payload, such as "100 t".
    layer : int, optional
        Counted from the bare drum; default the outermost (the ideal machine then turns the published outer diameter).
    direction : {"hoisting", "lowering"}
        Direction of the wire; default hoisting.

    Returns
    -------
    Dataset
        Over ("mode", "v_w"): alpha_m_ideal, alpha_p_ideal [-], alpha_m, alpha_p [-] and dp_m [Pa] of the plant, all as
        magnitudes; alpha_p above 1 cannot be reached. v_w_cross, v_w_cross_ideal over ("mode", "classic") [m/s]: the
        speed at which a mode's motors come down to those of the classic ones, NaN where they never do.

    Raises
    ------
    UnitError, StillhookError
        As `envelope`.

    Notes
    -----
    Source: Moslatt 2020 figure 2.17, paper E figure 4 (ideal).
    """
    chosen = controllers(_standard(crane) if modes is None else modes, "modes")
    way, mass = Direction(direction), parse(load, "mass", "load")
    number = crane.drum.layers if layer is None else layer
    stations = [Station(c.on(crane), mass, wire_out_on(crane, number), way) for c in chosen]
    K_wire = 1.0 if layer is None else stations[0].ratio
    fastest = 1.1 * wire_speed_max(crane, min(s.crane.active.motor.alpha_min for s in stations)) / K_wire
    speeds = np.linspace(0.0, fastest, SPEEDS) if v_w is None else np.array(quantities(v_w, "speed", "v_w"))
    ideal = [[_ideal(s.crane, c.mode, v, mass, K_wire) for v in speeds] for c, s in zip(chosen, stations, strict=True)]
    laws = [s.displacement(c.mode) for c, s in zip(chosen, stations, strict=True)]
    points = [[s.at(v, law(v)) for v in speeds] for s, law in zip(stations, laws, strict=True)]
    curve = ("mode", "v_w")
    fields: dict[str, Any] = {
        "alpha_m_ideal": (curve, [[a for a, _ in row] for row in ideal]),
        "alpha_p_ideal": (curve, [[u for _, u in row] for row in ideal]),
        "alpha_m": (curve, [[o.alpha_m for o in row] for row in points]),
        "alpha_p": (curve, [[way.sign * o.alpha_p for o in row] for row in points]),
        "dp_m": (curve, [[way.sign * o.dp_m for o in row] for row in points]),
    }
    crossings = _crossings(crane, chosen, stations, mass, K_wire, fastest)
    attrs = {
        "crane": crane_toml(crane),
        "stillhook": __version__,
        "layer": number,
        "load": mass,
        "direction": way.value,
    }
    coords = {"mode": [c.name for c in chosen], "v_w": speeds, "classic": [mode.value for mode in CLASSIC]}
    return _labelled(fields | crossings, coords, attrs)


def _ideal(crane: Crane, mode: Mode, v: float, load: float, K_wire: float) -> tuple[float, float]:
    """Motors and pumps of the ideal machine [-]; the pumps beyond 1 where they cannot."""
    s = steady(crane, v, mode, load, K_wire=K_wire)
    return s.alpha_m, v * K_wire / wire_speed_max(crane, s.alpha_m)


def _crossings(
    crane: Crane, chosen: Sequence[Controller], stations: Sequence[Station], load: float, K_wire: float, fastest: float
) -> dict[str, Any]:
    """Speeds at which a mode's motors come down to the classic ones, for the plant and for the ideal machine."""
    cross, ideal = [], []
    for c, s in zip(chosen, stations, strict=True):
        base = Station(crane, load, s.winch.s_w, Direction.HOISTING)
        cross.append([_meeting(s.displacement(c.mode), base.displacement(m)(0.0), fastest) for m in CLASSIC])

        def motors(v: float, machine: Crane = s.crane, mode: Mode = c.mode) -> float:
            return steady(machine, v, mode, load, K_wire=K_wire).alpha_m

        ideal.append([_meeting(motors, motors(0.0, crane, m), fastest) for m in CLASSIC])
    return {"v_w_cross": (("mode", "classic"), cross), "v_w_cross_ideal": (("mode", "classic"), ideal)}


def _meeting(alpha_m: Callable[[float], float], classic: float, fastest: float) -> float:
    """Speed at which a falling displacement first reaches a fixed one [m/s]; NaN where it starts there or never comes
    down to it."""
    from scipy.optimize import brentq

    if alpha_m(0.0) <= classic or alpha_m(fastest) > classic + ALPHA_SAME:
        return math.nan
    return float(brentq(lambda v: alpha_m(v) - classic - ALPHA_SAME, 0.0, fastest, xtol=1e-10))


ALPHA_SAME = 1e-12
"""Displacements that count as one [-]: a law that only touches the classic displacement comes down to it too."""


def _columns(shape: tuple[int, int, int, int]) -> dict[str, Any]:
    names = ("v_w_top", "alpha_m_top", "alpha_p_top", "dp_m_top", "omega_m_top")
    by_load = ("alpha_least", "alpha_reserve", "alpha_pm_hold", "v_w_power", "v_w_power_rule")
    return {
        **{n: np.full(shape, math.nan) for n in names},
        "binds": np.full(shape, "", dtype=object),
        "v_w_limit": np.full((*shape, len(Limit)), math.nan),
        **{n: np.full(shape[1:3], math.nan) for n in by_load},
    }


def _store(columns: Mapping[str, Any], at: tuple[int, ...], s: Station, top: Top) -> None:
    """The numbers of one mode, layer, load and direction; those that depend on layer and load alone are last written
    for the machine."""
    columns["v_w_top"][at], columns["binds"][at] = top.v_w, top.binds.value
    for n, limit in enumerate(Limit):
        columns["v_w_limit"][(*at, n)] = top.limits.get(limit, math.nan if limit is top.binds else math.inf)
    if top.point is not None:
        o, sign = top.point, s.sign
        values = {
            "alpha_m_top": o.alpha_m,
            "alpha_p_top": sign * o.alpha_p,
            "dp_m_top": sign * o.dp_m,
            "omega_m_top": sign * o.omega_m,
        }
        for name, value in values.items():
            columns[name][at] = value
    plc, d = plc_record(s.crane), s.winch.geometry.d
    rule = float(displacement_calc_min(s.F_w, s.ratio, plc.motors))
    flat = {
        "alpha_least": s.alpha_least,
        "alpha_reserve": s.alpha_reserve,
        "alpha_pm_hold": s.alpha_pm,
        "v_w_power": _full_pumps(s.crane, s.alpha_reserve, d),
        "v_w_power_rule": _full_pumps(s.crane, rule, d),
    }
    for name, value in flat.items():
        columns[name][at[1:3]] = value


def _full_pumps(crane: Crane, alpha_m: float, d: float) -> float:
    return wire_speed_max(crane, alpha_m, d) if alpha_m > 0.0 else math.inf


def _dataset(
    columns: Mapping[str, Any], modes: list[str], layers: list[int], loads: list[float], attrs: Mapping[str, Any]
) -> xarray.Dataset:
    dims = {1: ("mode",), 2: ("layer", "load"), 4: CELL, 5: (*CELL, "limit")}
    fields = {n: (dims[values.ndim], values.astype(str) if n == "binds" else values) for n, values in columns.items()}
    coords = {
        "mode": modes,
        "layer": layers,
        "load": loads,
        "direction": [d.value for d in Direction],
        "limit": [limit.value for limit in Limit],
    }
    return _labelled(fields, coords, attrs)


def _labelled(fields: Mapping[str, Any], coords: Mapping[str, Any], attrs: Mapping[str, Any]) -> xarray.Dataset:
    """Dataset with unit and meaning of every variable from `stillhook.variables`."""
    import xarray

    data = xarray.Dataset(dict(fields), coords=dict(coords), attrs=dict(attrs))
    for name in set(BY_NAME).intersection(map(str, data.variables)):
        data[name].attrs = {"units": BY_NAME[name].unit, "long_name": BY_NAME[name].meaning}
    return data
