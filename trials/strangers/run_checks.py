"""What must hold of runs in time: `lower`, `compare`, and `stability` against the twin.

Signals are what was written every so often; limits are told by their own count in every cycle. A signal beyond a limit
must therefore have its word in the status, and a word must have its time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from scipy.signal import butter, hilbert, sosfiltfilt

from stillhook import Crane, Profile, Scenario, simulate
from stillhook.physics.scalar import G
from stillhook.spec.scenario import Operator
from trials.strangers.checks import HOLDS
from trials.strangers.draw import Place

OK, DIVERGED = "ok", "diverged"
WORDS = {"saturated": "saturation_time", "slack": "slack_time", "wire": "wire_time", "oscillates": "oscillation_time"}
"""Words of a status that every winch has, and the time at each limit."""
PRESSURES: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "active-passive": ("active.relief.p", ("p_a", "p_b")),
    "pure-active": ("active.relief.p", ("p_a", "p_b")),
    "cylinder": ("cylinder.relief.p", ("p_a", "p_b")),
    "open-circuit": ("open.relief.p", ("p_a", "p_b")),
    "secondary": ("secondary.relief.p", ("p_r",)),
}
"""Setting of the relief valves of a winch type, and the lines that they guard."""
FASTEST = {
    "active-passive": "active.motor.n_max",
    "pure-active": "active.motor.n_max",
    "open-circuit": "open.motor.n_max",
    "secondary": "secondary.unit.n_max",
    "electric": "electric.motor.n_max",
}
"""Highest speed of a winch type's motors, at any displacement [rad/s]."""
PAST = 1e-3
"""Part of a limit beyond which a signal is beyond it."""
ENERGY, FLOOR = 5e-3, 1e5
"""Energy not found again over that through the winch that a sound run stays below [-], and the energy from which it is
judged [J]."""
WEIGHT = 0.02
"""Part by which the work of gravity may differ from weight by way: stretch of the wire and the tip's last place [-]."""
_LOSSES = "friction leakage relief flushing valve counterbalance copper iron inverter resistor cushion piston drag"
LOSSES = frozenset(_LOSSES.split())
"""Powers that can only go out. That of the wire is none of them: it has the strain that leaves the drum with it."""
LEAST_EFFICIENCY, STANDS = 0.05, 0.05
"""Part of the tip's motion and height [m] within which a winch counts as compensating."""
CLEAR = 1.1
"""Gain margin from which a disturbance must die out in the twin: a limit in the linear plant is good to a tenth [-]."""
NEAR, LARGEST_GAIN = 0.8, 10.0
"""Part of the limit of the gain at which the twin is run as well [-]; largest gain of machines that were built [1/m]:
limits beyond it may fall fast as the tip slows down, and a run comes to its place through slower ones, where it takes
up a cycle that stays."""
STEP, SETTLED, KICK = 10.0, 4.0, 0.05
"""Time of a disturbance and after which others have died out [s]; wire speed that it gives over that of the tip [-]."""
SHORTEST, IN_STROKE = 25.0, 0.4
"""Shortest run that shows whether a disturbance dies out [s]; part of a cylinder's stroke that a run may use to one
side of its middle [-]."""
SWINGS = 0.02
"""Amplitude of the wire's speed over the tip's below which it does not swing [-]."""


def number(crane: Crane, path: str) -> float:
    """A number of a crane by its dotted path."""
    value: Any = crane
    for part in path.split("."):
        value = getattr(value, part)
    return float(value)


def words_of(status: str) -> set[str]:
    """Words of a status."""
    return set() if status == OK else set(status.split(", "))


def times(winch: Any, status: str, numbers: Mapping[str, Any]) -> Iterator[str]:
    """A status names a limit where the run has time at it, and only there."""
    if DIVERGED in status:
        yield f"{status}: lost its numbers"
        return
    words = words_of(status)
    of_word: dict[str, list[str]] = {}
    for name, word in (*((v, k) for k, v in WORDS.items()), *((f"{k}_time", w) for k, w in winch.causes.items())):
        of_word.setdefault(word, []).append(name)
    for word, names in of_word.items():
        at = {name: float(numbers[name]) for name in names}
        fits = (word in words) == any(t > 0.0 for t in at.values())
        yield HOLDS if fits else f'status "{status}" and {at}'
    if {"audit"} & words:
        yield f'status "{status}": energy does not add up'


def signals(crane: Crane, status: str, series: Any, first: float) -> Iterator[str]:
    """A signal beyond a limit in the part that counts, from `first` [s], has its word in the status."""
    words, at = words_of(status), series.sel(time=slice(first, None))
    if len(at["time"]) == 0 or DIVERGED in words:
        return

    def told(signal: str, value: float, limit: float, *of: str) -> str:
        beyond = value > limit * (1.0 + PAST)
        return (
            f'{signal} {value:.5g} beyond {limit:.5g}, status "{status}"' if beyond and not words & set(of) else HOLDS
        )

    plant = str(crane.plant)
    if plant in PRESSURES:
        path, lines = PRESSURES[plant]
        for line in lines:
            if line in at:
                yield told(line, float(at[line].max()), number(crane, path), "relief")
                yield (
                    told(f"-{line}", -float(at[line].min()), 0.0, "cavitation")
                    if float(at[line].min()) < -1e3
                    else HOLDS
                )
    if plant in FASTEST and "omega_m" in at:
        yield told("omega_m", float(abs(at["omega_m"]).max()), number(crane, FASTEST[plant]), "overspeed")
    if "Q_relief" in at:
        yield told("Q_relief", float(at["Q_relief"].max()), 1e-6, "relief")
    if "P_hpu" in at and crane.hpu is not None and crane.hpu.P_max is not None:
        yield told("P_hpu", float(at["P_hpu"].max()), crane.hpu.P_max, "power")
    F = at["F_w"]
    yield told("F_w", float(F.max()), (crane.SWL + crane.hook_mass) * G, "overload", "peak load")
    slack = float(F.min()) <= 0.0 and "slack" not in words
    yield f'F_w down to {float(F.min()):.4g} N, status "{status}"' if slack else HOLDS


def compensates(status: str, summary: Mapping[str, Any]) -> Iterator[str]:
    """A run whose error is about as large as the motion says so."""
    error, tip = float(summary["e_c_pp"]), float(summary["s_tip_pp"])
    if not (math.isfinite(error) and tip > 0.0):
        return
    poor = error > max(STANDS, (1.0 - LEAST_EFFICIENCY) * tip)
    fits = poor == ("uncompensated" in words_of(status))
    yield HOLDS if fits else f'error {error:.3f} m of {tip:.3f} m, status "{status}"'


def energy(summary: Mapping[str, Any], powers: Mapping[str, float] | None = None) -> Iterator[str]:
    """What goes in is found again as work, as a loss or stored, and no loss gives energy. powers [J]."""
    through, missing = float(summary["energy_through"]), float(summary["energy_unaccounted"])
    if not (through > FLOOR) or float(summary["slack_time"]) > 0.0:
        return
    fits = abs(missing) < ENERGY
    yield HOLDS if fits else f'{missing:.2e} of {through:.3g} J not found, status "{summary["status"]}"'
    for name, joules in (powers or {}).items():
        if name in LOSSES:
            gives = joules < -1e-6 * through
            yield f"{name} gives {-joules:.4g} J of {through:.3g} J through the winch" if gives else HOLDS


def weight_by_way(crane: Crane, lift: Any, run: Any) -> Iterator[str]:
    """The work of gravity in a lowering is weight by way of payload, hook and wire, by hand."""
    if not math.isfinite(float(run["work_gravity"])):
        return
    down = lift.z_0 - float(run["z_load_end"])
    hook = (lift.payload.mass + crane.hook_mass) * G * down
    ends = (float(run["s_w"].values[0]), float(run["s_w"].values[-1]))
    wire = crane.wire.mass_per_length * G * 0.5 * (ends[1] ** 2 - ends[0] ** 2)
    found, right = abs(float(run["work_gravity"])), abs(hook + wire)
    if right > FLOOR:
        fits = abs(found - right) < WEIGHT * right
        yield HOLDS if fits else f"work of gravity {found:.5g} J, weight by way {right:.5g} J"


def lowered(lift: Any, status: str, run: Any) -> Iterator[str]:
    """The status tells of slings slack while the load hangs, of a touch that nobody planned and of a programme that is
    not at its end."""
    words = words_of(status)
    if DIVERGED in words:
        return
    landed = float(run["t_landed"]) if math.isfinite(float(run["t_landed"])) else math.inf
    hangs = run.sel(time=slice(None, landed - 1.0)) if math.isfinite(landed) else run
    slack = bool((hangs["F_sling"].values <= 0.0).any()) and "sling" not in words
    yield f'F_sling is 0 before the load lands, status "{status}"' if slack else HOLDS
    slings = float(run["sling_slack_time"]) > 0.0
    yield (
        HOLDS if slings == ("sling" in words) else f'slings slack {float(run["sling_slack_time"])} s, status "{status}"'
    )
    lands = any(s.landed or s.mode == "landing" for s in lift.programme)
    touch = math.isfinite(landed) and not lands and "touchdown" not in words
    yield f'touches the bed after {landed:.1f} s, status "{status}"' if touch else HOLDS
    ended = math.isfinite(float(run["programme_time"]))
    yield HOLDS if ended != bool(words & {"stuck", "unfinished"}) else f'programme ends: {ended}, status "{status}"'


def dies_out(crane: Crane, answer: Mapping[str, Any], place: Place) -> Iterator[str]:
    """Where `stability` says stable with a margin of `CLEAR`, a small disturbance dies out in the twin at the place."""
    margin, omega = answer["gain_margin_plc"], answer["omega_c_plc"]
    if not answer["stable"] or margin is None or not margin >= CLEAR or not omega:
        return
    v, time = place.v_tip, run_time(crane, place)
    if time < SHORTEST:
        return
    try:
        run = disturbed(crane, place, float(omega), time)
    except Exception as problem:  # a place that the winch cannot be run at is none of this check
        if type(problem).__module__.startswith("stillhook"):
            return
        raise
    t, late = run["time"].values, run["time"].values > STEP + SETTLED
    counted = late & (t < time - SETTLED)
    status = str(run["status"].item())
    if DIVERGED in status:
        yield f"{place}: stable with a margin of {margin:.3g}, and the twin loses its numbers"
        return
    sos = butter(3, np.array([0.6, 1.6]) * omega / (2.0 * math.pi), "bandpass", fs=50.0, output="sos")
    size = np.abs(hilbert(sosfiltfilt(sos, run["v_w"].values + v))) / abs(v)
    first, last = size[counted][: len(size[counted]) // 4], size[counted][-len(size[counted]) // 4 :]
    grows = float(last.mean()) > max(SWINGS, float(first.mean()))
    swings = "oscillates" in words_of(status) and float(last.mean()) > SWINGS
    text = f"{place}: stable with a margin of {margin:.3g}, the twin at {omega:.3g} rad/s goes from {first.mean():.4f}"
    yield f"{text} to {last.mean():.4f} of the tip's speed ({status})" if grows or swings else HOLDS


def near_the_limit(crane: Crane, answer: Mapping[str, Any], place: Place) -> Iterator[str]:
    """With `NEAR` of the gain that `stability` gives as the limit of a place, or the largest that is plausible, a
    disturbance dies out in the twin."""
    least, limit = answer["least_at"], answer["K_p_ms_plc"]
    if least is None or not limit or least["K_p_low"] > 0.0:
        return
    gain = min(NEAR * float(limit), LARGEST_GAIN)
    control = crane.control.model_copy(update={"K_p": gain})
    of_limit = {**answer, "stable": True, "gain_margin_plc": float(limit) / gain}
    yield from dies_out(crane.model_copy(update={"control": control}), of_limit, place)


def run_time(crane: Crane, place: Place) -> float:
    """Length of a run at a place [s]: until growth shows, and with a cylinder within the middle of its stroke."""
    usual = min(90.0, max(40.0, 25.0 / abs(place.v_tip)))
    stroke = crane.plant.type.stroke(crane, (place.load + crane.hook_mass) * G)
    within = math.inf if stroke is None else IN_STROKE * float(stroke.length) / abs(place.v_tip)
    return min(usual, within) if "cylinder" in crane.plant.type.tables else usual


def disturbed(crane: Crane, place: Place, omega: float, time: float) -> Any:
    """The twin on an evenly moving tip, with a small step of the operator's place, so that the place of the answer is
    that of the middle of the run."""
    v = place.v_tip
    tip = Profile([("0 s", "0 m/s"), ("5 s", f"{v} m/s"), (f"{time} s", f"{v} m/s"), (f"{time + 5.0} s", "0 m/s")])
    step = Operator(steps=((f"{STEP} s", f"{KICK * abs(v) / omega * 1e3} mm"),))
    held = {"gas_held": True} if "passive" in crane.circuits else {}
    case = Scenario(
        load=f"{place.load!r} kg",
        s_w=f"{place.s_w - 0.5 * v * time!r} m",
        tip=tip,
        mode=crane.plant.type.usual_modes[-1] if "ssc" not in crane.plant.type.modes else "ssc",
        operator=step,
        duration=f"{time} s",
        warm_up=f"{STEP + SETTLED} s",
        ramp="0 s",
        **held,
    )
    return simulate(crane, case, every="0.02 s", on_failure="mark")
