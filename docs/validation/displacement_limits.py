"""SSC's smallest displacement by load or by torque: operating range and maps of the library's cranes under both."""

from __future__ import annotations

from typing import NamedTuple

from blocks import Blocks, save

from stillhook.analysis.controllers import Controller
from stillhook.analysis.maps.figures import value_figure
from stillhook.analysis.maps.operability import map_of
from stillhook.analysis.maps.result import Map
from stillhook.analysis.steady.envelope import envelope
from stillhook.analysis.steady.figures import load_speed_figure
from stillhook.analysis.steady.limits import Direction, Station
from stillhook.analysis.steady.steady_state import wire_out_on
from stillhook.control.commands import displacement_for_speed, displacement_for_torque
from stillhook.engine.pack.displacement import speed_floor
from stillhook.engine.pack.winch import plc_record
from stillhook.library import load_crane
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.units import in_display

SLOW_PAGE = True
BY_TORQUE = Controller("SSC by torque", Mode("ssc"), {"control": {"displacement_limit": "torque"}})
LOWER = Controller("330 bar", Mode("ssc"), {"control": {"displacement_limit": "torque", "p_most": "330 bar"}})
LOADS = {"nov-150t": (100, 130, 150), "nov-250t": (180, 225, 250), "nov-100t-pure-active": (60, 80)}  # t
CELLS = {  # t, m/min
    "nov-250t": (250, (70, 90, 100)),
    "nov-150t": (150, (80, 90)),
    "nov-100t-pure-active": (80, (40, 70)),
}
SHOWN, HEAVY = "nov-150t", "50 % to 100 % by 5 %"


class Top(NamedTuple):
    """Highest speeds on the outermost layer, hoisting [m/min], of NS and of SSC by load and by torque; smallest
    displacement by both [-]; what holds that by torque, and what stops SSC then."""

    crane: str
    load: float
    ns: float
    load_rule: float
    torque_rule: float
    alpha_load: float
    alpha_torque: float
    holds: str
    binds: str


def station(crane: Crane, load: float) -> Station:
    return Station(crane, load, wire_out_on(crane, crane.drum.layers), Direction.HOISTING)


def holds(crane: Crane, F: float) -> str:
    """What sets the smallest displacement at a tension F on the outermost layer [N]."""
    limits = plc_record(crane).motors.limits
    speed, torque = displacement_for_speed(F, 1.0, limits), displacement_for_torque(F, 0.0, 1.0, limits)
    if max(speed, torque) <= crane.active.motor.alpha_min:
        return "`alpha_min`"
    if torque >= speed:
        return "torque"
    return "speed of the passive motors" if speed > speed_floor(crane, 0.0) else "speed of the active motors"


def tops(name: str) -> list[Top]:
    crane, out = load_crane(name), []
    other = BY_TORQUE.on(crane)
    for t in LOADS[name]:
        a, b = station(crane, 1e3 * t), station(other, 1e3 * t)
        of_rule = b.top_of_mode(Mode("ssc"))
        out.append(
            Top(
                name,
                t,
                60.0 * a.top_of_mode(Mode("ns")).v_w,
                60.0 * a.top_of_mode(Mode("ssc")).v_w,
                60.0 * of_rule.v_w,
                a.alpha_least,
                b.alpha_least,
                holds(other, a.F_w),
                str(of_rule.binds),
            )
        )
    return out


def cells(name: str) -> list[tuple[str, ...]]:
    """Error, highest pressure and the map's cause: by load, by torque, with a lower permitted pressure."""
    load, speeds = CELLS[name]
    of = map_of(load_crane(name), ("ssc", BY_TORQUE, LOWER), loads=[f"{load} t"], speeds=[f"{v} m/min" for v in speeds])
    rows: list[tuple[str, ...]] = []
    for j, v in enumerate(speeds):
        texts = []
        for k in (of.labels.index(x) for x in ("ssc", BY_TORQUE.name, LOWER.name)):
            at = (k, 0, j, 0, 0)
            numbers = (
                f"{100.0 * of.values['e_c_pp'][at]:.0f} cm, {in_display(of.values['p_max'][at], 'pressure'):.0f} bar"
            )
            texts.append(numbers + (f"; {cause}" if (cause := str(of.cause[at])) else ""))
        rows.append((f"{name}, {load} t, {v} m/min", *texts))
    return rows


def compute() -> tuple[Blocks, Map]:
    rows = [top for name in LOADS for top in tops(name)]
    gains = {(r.crane, r.load): (r.load_rule / r.ns - 1.0, r.torque_rule / r.ns - 1.0) for r in rows}
    crane = load_crane(SHOWN)
    both = map_of(crane, ("ssc", BY_TORQUE), loads=HEAVY)
    by_load, by_torque = (both.applicable[both.labels.index(x)] for x in ("ssc", BY_TORQUE.name))
    return {
        "claims": {"at": gains, "rows": rows},
        "envelope": rows,
        "maps": [row for name in CELLS for row in cells(name)],
        "range": {"n": by_load.size, "a": int(by_load.sum()), "b": int(by_torque.sum())},
    }, both


def draw(both: Map) -> None:
    crane = load_crane(SHOWN)
    save(load_speed_figure(envelope(crane, modes=("ns", "ssc", BY_TORQUE))), "displacement-limits-envelope.png")
    save(value_figure(both, "e_c_pp", labels=("ssc", BY_TORQUE.name)), "displacement-limits-map.png")
