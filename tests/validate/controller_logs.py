"""Logs of cranes for tests of steps 2 and 3: simulated with known settings, every signal as a PLC has it in one cycle, without noise."""

import functools
from dataclasses import replace

import numpy as np
from tests.validate.ahc_logs import STEP, TWIN, record, sea

from stillhook import Scenario, simulate
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Commands, Mode, Operator
from stillhook.validate.data_set.campaign import Kind
from stillhook.validate.data_set.record import Record

NAMES = (
    "s_tip",
    "v_tip",
    "a_tip",
    "s_w",
    "v_w",
    "u_p",
    "u_m",
    "alpha_p",
    "alpha_m",
    "F_w",
    "e_c_measured",
    "v_op",
    "mode",
)


def _profile(*points: tuple[int, int]) -> tuple[tuple[str, str], ...]:
    """Points of a joystick: time [s], speed [m/min]."""
    return tuple((f"{t} s", f"{v} m/min") for t, v in points)


TO_THE_LIMIT = _profile((0, 0), (3, 0), (5, 130), (13, 130), (15, 0), (18, 0), (20, -130), (28, -130), (30, 0), (33, 0))
"""Joystick hoisting and lowering beyond what the winch can."""
_LATER = ((26, 30), (30, 30), (32, 80), (36, 80), (38, 20), (42, 20))
UNDER_WAY = _profile((0, 0), (3, 0), (5, 40), (18, 40), (20, 90), (24, 90), *_LATER)
"""Joystick that changes the speed of a winch whose start from the brake has faded (five times the bumpless 2 s)."""
LEAD = 20.0  # s in which the winch comes into its swing
Series = dict[str, np.ndarray]


def with_control(crane: Crane, **changes: float) -> Crane:
    """The crane with other control settings [SI]."""
    return crane.model_copy(update={"control": crane.control.model_copy(update=changes)})


def ahc_log(
    crane: Crane,
    *,
    duration: float = 160.0,
    seed: int = 1,
    height: float = 1.6,
    mode: str = "ssc",
    s_w: float = 487.0,
    commands: Commands | None = None,
) -> Series:
    """What the PLC logs in heave compensation, from a winch in full swing on."""
    case = Scenario(
        load="90 t",
        s_w=f"{s_w} m",
        tip=sea(seed, height),
        mode=mode,
        duration=f"{LEAD + duration} s",
        commands=commands,
    )
    run = simulate(crane, case, every="10 ms")
    return {name: run[name].values[round(LEAD / STEP) :].copy() for name in NAMES}


def limits_log(
    crane: Crane, *, profile: tuple = TO_THE_LIMIT, alpha_m: float | None = None, commands: Commands | None = None
) -> Series:
    """What the PLC logs in manual mode with the joystick of this profile."""
    operator = Operator(profile=profile, alpha_m=alpha_m)
    case = Scenario(
        load="90 t",
        s_w="500 m",
        mode="manual",
        duration=profile[-1][0],
        warm_up="0 s",
        operator=operator,
        commands=commands,
    )
    run = simulate(crane, case, every="10 ms")
    return {name: run[name].values.copy() for name in NAMES}


@functools.cache
def own_ahc_log() -> Series:
    """The twin's own, never to be changed: `bent` makes copies."""
    return ahc_log(TWIN)


@functools.cache
def own_limits_log() -> Series:
    """The twin's own, never to be changed."""
    return limits_log(TWIN)


def bent(log: Series, **changes) -> Series:
    """A copy of a log with signals replaced; None leaves one out."""
    return {name: x for name, x in {**log, **changes}.items() if x is not None}


def noisy(x: np.ndarray, sd: float, seed: int = 0) -> np.ndarray:
    """A signal with white noise of this standard deviation."""
    return x + sd * np.random.default_rng(seed).standard_normal(len(x))


def later(x: np.ndarray, samples: int) -> np.ndarray:
    """A signal that comes so many samples later; negative: earlier."""
    y = np.roll(x, samples)
    if samples > 0:
        y[:samples] = x[0]
    elif samples < 0:
        y[samples:] = x[-1]
    return y


def without(found: Record, *names: str) -> Record:
    """A record in which signals were not logged."""
    return replace(found, signals={k: v for k, v in found.signals.items() if k not in names})


def limits_record(log: Series, *, name: str = "limits") -> Record:
    """A record of kind limits in manual mode."""
    return record(log, name=name, mode=Mode.MANUAL, kind=Kind.LIMITS)
