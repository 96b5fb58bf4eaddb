"""From the log of one crane test to measured friction: signals, steady stretches, pairs, speed grid, and checks on the
way."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.engine.pack.lift import wire_carried
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import IdentifyError, LogError, StillhookError
from stillhook.identify.steady_state.pairs import Pairs, pair_windows
from stillhook.identify.steady_state.steps import Rejected, Steady, Window
from stillhook.identify.steady_state.windows import steady_windows
from stillhook.identify.system_friction.campaign import Campaign, CraneTest
from stillhook.identify.system_friction.diagnosis import Statement
from stillhook.identify.system_friction.fitting.model import Points
from stillhook.identify.system_friction.thesis import Grid, grid_points, on_grid
from stillhook.logs.campaign import wire_text
from stillhook.logs.log import Log, read_log
from stillhook.physics.load_path.drum import wire_to_layer
from stillhook.physics.scalar import G
from stillhook.units import parse, show

LOAD_DOUBT, LOAD_WRONG = 0.03, 0.07
"""Difference between the load that is stated and the one that the pressures carry, over the carried one, from which a
test is called into question, and from which its friction must not be used. The mean of both directions gives the load
to some tenths of a per cent; a wrong load, layer, displacement or gain makes the friction wrong in the same proportion,
and the system
friction by
about twice that."""
LOAD_TOLERANCE, LOAD_MATTERS = parse("1.5 t", "mass"), parse("3 t", "mass")
"""What the weight of hook and wire may be off by, so that a smaller difference says nothing (half a hook block and some
wire), and what it cannot be off by: both count where the load is light."""
SPEED_DOUBT, SPEED_WRONG = 0.03, 0.25
"""The same for the motor speed against the wire paid out; a wrong layer makes four per cent."""
CELL_DOUBT = 0.1  # of the load: a load cell in a sheave has its own friction
LEAST_TRAVEL = parse("0.2 m", "length")  # of wire in a stretch from which a speed can be determined
MOST_LOST = 0.5  # share of the stretches that are not used from which that is worth reporting
WIRE_ROOM = parse("20 m", "length")  # by which a wire counter's zero may be off
SAME_SPEED = 1.05  # ratio of speeds that are one where the slope of friction over speed is taken
D_DOUBT, D_WRONG = 0.02, 0.25
"""Difference between the stated and the logged displacement, over D_max; a closed servo holds it within one per
cent."""

LOAD_CODE = "load"
speed_text = partial(show, kind="rotation", digits=3)


@dataclass(frozen=True)
class Measured:
    """What one test gave: its log, steady stretches with rejects, pairs, and points for a fit.

    ``log`` with omega_m and dp_m among its signals regardless of what was logged; ``points`` one entry a pair;
    ``grid_points`` one entry a grid speed (as the thesis fits); ``notes`` what a reader must know.
    """

    test: CraneTest
    log: Log
    steady: Steady
    pairs: Pairs
    points: Points
    grid_points: Points
    notes: tuple[Statement, ...]


def measure(campaign: Campaign, test: CraneTest, *, progress: Progress | None = None) -> Measured:
    """Read one test's log and reduce it to measured friction.

    Errors: LogError, IdentifyError of one line that names the test: signals that are missing, that contradict each
    other, no pair of steady stretches.
    """
    try:
        return _measure(campaign, test, progress)
    except StillhookError as e:
        place = f'{campaign.source}: test "{test.name}": '
        raise type(e)(str(e) if str(e).startswith(place) else place + str(e)) from None


def _measure(campaign: Campaign, test: CraneTest, progress: Progress | None) -> Measured:
    notes: list[Statement] = []
    log = cut(read_log(test.log, test.mapping, progress=progress), test)
    if (campaign.diameter(test) is None or test.hook is not None) and "s_w" in log.signals:
        log = _with_full_wire_length(campaign, log, notes)
    dp_m = pressure_drop(log)
    omega_m, d = shaft_speed(campaign, test, log)
    signals = {**log.signals, "omega_m": omega_m, "dp_m": dp_m}
    doubtful = {**log.doubtful, **_inherited(log)}
    extended = replace(log, signals=signals, doubtful=doubtful)
    names = [n for n in ("alpha_m", "D_m") if n in log.signals]
    command = "u_p" if "u_p" in log.signals else None
    limits = layer_limits(campaign) if "s_w" in log.signals else ()
    steady = steady_windows(extended, "omega_m", "dp_m", command=command, held=names, layer_limits=limits)
    pairs = pair_windows(steady.windows, text=speed_text)
    if not pairs.pairs:
        raise IdentifyError(_no_pair(log, steady))
    grid = _grid(steady.windows, notes)
    D_m = _displacement(campaign, test, pairs, notes)
    wire = _wire(campaign, test, log, pairs, notes)
    test = replace(test, wire=float(np.mean(wire)))
    weight = campaign.weight(test)
    diameters = np.full(len(pairs.pairs), d)
    if d is None:
        diameters = _mean_of_pairs(pairs, lambda w: campaign.layer_diameter(w.others["s_w"]))
    points = _points(campaign, test, pairs, D_m, (weight + (wire - test.wire) * G) * 0.5 * diameters)
    if len(np.unique(np.round(diameters, 6))) > 1:
        notes.append(Statement("layers", "the wire changed its layer; every pair has the drum torque of its own layer"))
    notes += _speed_check(campaign, extended, pairs, diameters)
    notes += _load_check(campaign, test, points)
    notes += _cell_check(weight, pairs)
    unused, used = (*steady.rejected, *pairs.unpaired), 2 * len(pairs.pairs)
    if len(unused) > MOST_LOST * (len(unused) + used):
        text = f"{len(unused)} stretches are not used and {used} are; most often: {_commonest(unused)}"
        notes.append(Statement("few stretches", text))
    return Measured(test, extended, steady, pairs, points, grid_points(grid, points, campaign.accuracy.p), tuple(notes))


def _with_full_wire_length(campaign: Campaign, log: Log, notes: list[Statement]) -> Log:
    """The log with holes in the wire paid out filled by straight lines: it states the layer, and moves steadily.

    Errors: LogError where the wire is not on the drum.
    """
    s_w = log.signals["s_w"]
    good = np.isfinite(s_w)
    L_full = drum_record(campaign.crane).L_full
    low, high = float(s_w[good].min()), float(s_w[good].max())
    if low < -WIRE_ROOM or high > L_full + WIRE_ROOM:
        raise LogError(
            f"{log.source}: s_w goes from {show(low, 'length')} to {show(high, 'length')}, the drum holds 0 m to"
            f" {show(L_full, 'length')}. Check its unit, sign and zero, or give the layer."
        )
    if good.all():
        return log
    text = f"s_w is missing in {np.mean(~good):.1%} of the log: filled by straight lines, for the layer and the wire's"
    notes.append(Statement("wire", f"{text} weight"))
    return replace(log, signals={**log.signals, "s_w": np.interp(log.t, log.t[good], s_w[good])})


def _wire(campaign: Campaign, test: CraneTest, log: Log, pairs: Pairs, notes: list[Statement]) -> FloatArray:
    """Mass of the wire out that the winch carries at every pair, less its buoyancy [kg]; 0 where the file does not say
    how deep the hook is. Errors: IdentifyError where depth and wire out contradict each other."""
    n, crane = len(pairs.pairs), campaign.crane
    if test.hook is None:
        return np.zeros(n)
    if "s_w" in log.signals:
        h_tip = test.hook.tip_height(float(log.signals["s_w"][0]))
        s_w = _mean_of_pairs(pairs, lambda w: w.others["s_w"])
    elif test.s_w is not None:
        h_tip, s_w = test.hook.tip_height(test.s_w), np.full(n, test.s_w)
    else:
        s_w, h_tip = np.full(n, test.hook.wire_out()), float(test.hook.h_tip or 0.0)
    on_hook = show(test.load + crane.hook_mass, "mass", 3)
    text = f"the winch carries load and hook, {on_hook}, and {wire_text(crane, float(s_w.mean()), h_tip)}"
    notes.append(Statement("wire weight", f"{text} in the mean of the pairs" if np.ptp(s_w) > LEAST_TRAVEL else text))
    return np.array([wire_carried(crane, float(x), h_tip) for x in s_w])


def _no_pair(log: Log, steady: Steady) -> str:
    directions = {w.direction for w in steady.windows} | {r.direction for r in steady.rejected if r.direction}
    if steady.windows and len(directions) == 1:
        direction = "negative" if steady.windows[0].direction > 0 else "positive"
        return (
            f"{log.source}: all {len(steady.windows)} steady stretches run one way: the speed is never {direction}. Is"
            " its sensor unsigned, or was the winch only hoisted or only lowered? Friction needs both directions."
        )
    reason = f", most often: {_commonest(steady.rejected)}" if steady.rejected else ""
    return (
        f"{log.source}: no hoisting and lowering stretch of one speed among {len(steady.windows)} steady ones "
        f"({len(steady.rejected)} were rejected{reason}). Hold each speed for 10 s or more, up and down."
    )


def _commonest(unused: Sequence[Rejected]) -> str:
    """The reason that most stretches share, in the words of the first of them."""
    code = Counter(r.code for r in unused).most_common(1)[0][0]
    return next(r.reason for r in unused if r.code == code)


def _grid(windows: Sequence[Window], notes: list[Statement]) -> Grid:
    """The thesis's grid; an empty one, with a note, where a direction has fewer than two speeds."""
    try:
        return on_grid(windows)
    except IdentifyError as problem:
        notes.append(Statement("grid", f"not on the thesis's speed grid: {str(problem).rstrip('.')}"))
        none = np.zeros(0)
        return Grid(none, none, none, np.zeros((0, 0)))


def layer_limits(campaign: Campaign) -> tuple[float, ...]:
    """Wire paid out at which the wire in use changes its layer [m]."""
    drum = drum_record(campaign.crane)
    return tuple(drum.L_full - wire_to_layer(float(n), drum) for n in range(1, campaign.crane.drum.layers))


def pressure_drop(log: Log) -> FloatArray:
    s = log.signals
    if "dp_m" in s:
        return s["dp_m"]
    for name in ("p_a", "p_b"):
        if name not in s:
            raise LogError(f"{log.source}: no signal {name}. Map p_a and p_b, or their difference dp_m.")
    return s["p_a"] - s["p_b"]


def shaft_speed(campaign: Campaign, test: CraneTest, log: Log) -> tuple[FloatArray, float | None]:
    """Motor speed [rad/s], from the wire speed where the log has no other; and the layer's diameter where it is stated
    [m].

    Errors: LogError where there is no speed, or a wire speed without a layer; IdentifyError where nothing gives the
    layer.
    """
    s, d = log.signals, campaign.diameter(test)
    if d is None and "s_w" not in s:
        raise IdentifyError(
            "layer: missing, and the log has no signal s_w. Give layer or s_w: the drum torque depends on it."
        )
    if "omega_m" in s:
        return s["omega_m"], d
    if "v_w" not in s:
        raise LogError(f"{log.source}: no signal omega_m. Map the motor speed omega_m, or the wire speed v_w.")
    diameter = np.array([campaign.layer_diameter(float(x)) for x in s["s_w"]]) if d is None else d
    return s["v_w"] * campaign.crane.i_hD / (0.5 * diameter), d


def cut(log: Log, test: CraneTest) -> Log:
    if not (math.isfinite(test.start) or math.isfinite(test.end)):
        return log
    keep = (log.t >= test.start) & (log.t <= test.end)
    if not keep.any():
        raise IdentifyError(
            f"start, end: nothing of the log {log.source} ({log.t[-1]:.1f} s long) is between them. Change them."
        )
    signals, doubtful = {k: v[keep] for k, v in log.signals.items()}, {k: v[keep] for k, v in log.doubtful.items()}
    findings = tuple(f for f in log.findings if not (f.end < test.start or f.start > test.end))
    return replace(log, t=log.t[keep], signals=signals, doubtful=doubtful, findings=findings)


def _inherited(log: Log) -> Mapping[str, np.ndarray]:
    """What makes p_a, p_b or v_w doubtful makes dp_m and omega_m doubtful."""
    none = np.zeros(len(log.t), dtype=bool)
    pressures = [log.doubtful.get(n, none) for n in ("p_a", "p_b", "dp_m") if n in log.signals]
    speeds = [log.doubtful.get(n, none) for n in ("omega_m", "v_w") if n in log.signals]
    return {"dp_m": np.any(pressures, axis=0), "omega_m": np.any(speeds[:1], axis=0)}


def _mean_of_pairs(pairs: Pairs, value: Callable[[Window], float]) -> FloatArray:
    """Mean of both stretches of every pair, shape (n,)."""
    return np.array([0.5 * (value(p.up) + value(p.down)) for p in pairs.pairs])


def _displacement(campaign: Campaign, test: CraneTest, pairs: Pairs, notes: list[Statement]) -> FloatArray:
    """Displacement of one motor at every pair [m^3/rad]: the logged one where there is one, else the stated one."""
    logged: FloatArray | None = None
    others = pairs.pairs[0].up.others
    if "D_m" in others:
        logged = _mean_of_pairs(pairs, lambda w: w.others["D_m"])
    elif "alpha_m" in others:
        logged = campaign.motor.D_max * _mean_of_pairs(pairs, lambda w: w.others["alpha_m"])
    if logged is None:
        if test.D_m is None:
            raise IdentifyError(
                "D_m: missing, and the log has neither D_m nor alpha_m. Give the displacement of one motor."
            )
        return np.full(len(pairs.pairs), test.D_m)
    if np.any(logged <= 0.0) or np.any(logged > 1.05 * campaign.motor.D_max):
        worst = float(logged[np.argmax(np.abs(logged - 0.5 * campaign.motor.D_max))])
        raise LogError(
            f"displacement {show(worst, 'displacement')} in the log: the motors have above 0 up to "
            f"{show(campaign.motor.D_max, 'displacement')} each. Check unit and scale of the signal."
        )
    mean = float(logged.mean())
    stated = mean if test.D_m is None else test.D_m
    off = abs(mean - stated) / campaign.motor.D_max
    if off > D_DOUBT:
        text = (
            f"displacement {show(mean, 'displacement')} a motor in the log, {show(stated, 'displacement')} in the"
            " campaign file: the log's is used"
        )
        notes.append(Statement("displacement", text, severe=off > D_WRONG))
    return logged


def _points(campaign: Campaign, test: CraneTest, pairs: Pairs, D_m: FloatArray, T_d: FloatArray) -> Points:
    up, down = [p.up for p in pairs.pairs], [p.down for p in pairs.pairs]
    omega_up, omega_down = np.array([w.speed for w in up]), np.array([-w.speed for w in down])
    dp_up, dp_down = np.array([w.effort for w in up]), np.array([w.effort for w in down])
    u_dp = 0.5 * np.hypot([w.u_effort for w in up], [w.u_effort for w in down])
    u_speed = 0.5 * np.hypot(
        np.hypot([w.u_speed for w in up], campaign.accuracy.omega_m * omega_up),
        np.hypot([w.u_speed for w in down], campaign.accuracy.omega_m * omega_down),
    )
    slope = _slope(0.5 * (omega_up + omega_down), 0.5 * (dp_up - dp_down))
    u_dp = np.sqrt(u_dp**2 + campaign.accuracy.p**2 + (slope * u_speed) ** 2)
    n = len(pairs.pairs)
    return Points(
        names=(test.name,),
        test=np.zeros(n, dtype=np.intp),
        omega_up=omega_up,
        omega_down=omega_down,
        dp_up=dp_up,
        dp_down=dp_down,
        D_m=D_m,
        T_d=T_d,
        count=np.full(n, float(campaign.count)),
        u_dp=u_dp,
        hold_out=np.full(n, test.hold_out),
        t_up=np.array([w.middle for w in up]),
        t_down=np.array([w.middle for w in down]),
    )


def _slope(omega: FloatArray, dp: FloatArray) -> FloatArray:
    """Slope of the measured friction over speed [Pa s/rad], by which a speed's uncertainty becomes one of pressure."""
    order = np.argsort(omega)
    first = [0]
    for i, x in enumerate(omega[order]):
        if x > SAME_SPEED * omega[order][first[-1]]:
            first.append(i)
    count = np.diff([*first, len(order)])
    x, y = (np.add.reduceat(values[order], first) / count for values in (omega, dp))
    return np.zeros_like(omega) if len(x) < 3 else np.asarray(np.interp(omega, x, np.gradient(y, x)))


def carried(campaign: Campaign, test: CraneTest, points: Points) -> float:
    """Load on the hook that the pressures of a test carry in the mean of both directions [kg]; NaN where nothing
    hangs."""
    if not len(points) or float(points.T_d.min()) <= 0.0:
        return math.nan
    torque = points.count * points.D_m * points.dp_L * campaign.crane.i_hD
    return float(np.mean(torque / points.T_d)) * campaign.weight(test) / G - campaign.crane.hook_mass - test.wire


def _load_check(campaign: Campaign, test: CraneTest, points: Points) -> list[Statement]:
    """A line where pressures and stated load do not belong together."""
    mass = carried(campaign, test, points)
    off, gross = abs(mass - test.load), abs(mass + campaign.crane.hook_mass + test.wire)
    if math.isnan(mass) or off <= max(LOAD_TOLERANCE, LOAD_DOUBT * gross):
        return []
    text = (
        f"the pressures carry {show(mass, 'mass', 3)}, the campaign file states {show(test.load, 'mass', 3)}: check"
        " load, hook, depth, layer, displacement, number of motors, gear ratio and the pressure sensors' gain and"
        f" offset ({off / gross:.1%} of the carried weight; from {LOAD_WRONG:.0%} on no set is written)"
    )
    return [Statement(LOAD_CODE, text, severe=off > max(LOAD_MATTERS, LOAD_WRONG * gross))]


def _cell_check(weight: float, pairs: Pairs) -> list[Statement]:
    """A line where the load cell, if it is logged, reads another load."""
    read = [
        0.5 * (p.up.others["F_w"] + p.down.others["F_w"])
        for p in pairs.pairs
        if "F_w" in p.up.others and "F_w" in p.down.others
    ]
    force = float(np.mean(read)) if read else math.nan
    if math.isnan(force) or abs(force - weight) <= max(CELL_DOUBT * weight, LOAD_TOLERANCE * G):
        return []
    text = f"the load cell reads {show(force, 'force', 3)} where load and hook weigh {show(weight, 'force', 3)}"
    return [Statement("load cell", f"{text}: check its unit and the load")]


def _speed_check(campaign: Campaign, log: Log, pairs: Pairs, diameters: FloatArray) -> list[Statement]:
    """A line where motor speed and wire paid out, if both are logged, do not belong together. Errors: LogError for a
    wrong unit."""
    if "s_w" not in log.signals:
        return []
    ratios = []
    for p, d in zip(pairs.pairs, diameters, strict=True):
        for w in (p.up, p.down):
            inside = (log.t >= w.start) & (log.t <= w.end) & np.isfinite(log.signals["s_w"])
            t, s_w = log.t[inside], log.signals["s_w"][inside]
            if len(t) > 1 and abs(s_w[-1] - s_w[0]) > LEAST_TRAVEL:
                ratios.append(-w.speed * 0.5 * d / campaign.crane.i_hD / float(np.polyfit(t, s_w, 1)[0]))
    if not ratios:
        return []
    ratio = float(np.median(ratios))
    if abs(ratio - 1.0) <= SPEED_DOUBT:
        return []
    text = (
        f"the motor speed is {ratio:.3g} times what the wire paid out indicates: check units of omega_m and s_w, gear"
        " ratio and layer"
    )
    if not 1.0 - SPEED_WRONG < ratio < 1.0 / (1.0 - SPEED_WRONG):
        raise LogError(f"{log.source}: {text}.")
    return [Statement("speed", text)]
