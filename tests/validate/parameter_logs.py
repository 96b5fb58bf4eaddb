"""Logs of a simulated crane with the noise of typical sensors, for tests of step 1: every signal, two loads on two layers."""

import functools
from collections.abc import Callable, Mapping

import numpy as np
from tests.validate.ahc_logs import STEP, TWIN, campaign, record, sea

from stillhook import Scenario, simulate
from stillhook.spec.crane import Crane
from stillhook.validate.criteria.results import Step
from stillhook.validate.data_set.record import Record
from stillhook.validate.parameters.check import ParameterEstimates, check_parameters

NOISE = {
    "s_tip": (2e-3, 1e-3),
    "v_tip": (3e-3, 1e-3),
    "a_tip": (1e-2, 1e-3),
    "s_w": (0.0, 1e-3),
    "v_w": (1.5e-3, 1e-4),
    "omega_m": (0.3, 0.05),
    "p_a": (5e4, 1e4),
    "p_b": (5e4, 1e4),
    "p_hp": (5e4, 1e4),
    "u_p": (0.0, 1e-4),
    "u_m": (0.0, 1e-4),
    "alpha_p": (5e-4, 1e-4),
    "alpha_m": (5e-4, 1e-4),
    "alpha_pm": (5e-4, 1e-4),
    "F_w": (3e3, 1e2),
    "e_c_measured": (0.0, 1e-4),
    "v_op": (0.0, 0.0),
}
"""Standard deviation of the noise and smallest step of each signal [SI]: a PLC's 12 to 14 bits, transmitters of class 0.2 to 0.5."""
CASES = {"1": (82e3, 487.0, 1, 2.0), "2": (162e3, 2314.0, 2, 2.0)}
"""Load [kg], wire out [m], seed of the sea and its height [m] by test."""
LEAD, LENGTH = 30.0, 150.0  # s before the log, and of it
LATE = 0.04  # s by which the tip comes late to every crane here, as the campaign states

Signals = dict[str, np.ndarray]


@functools.cache
def twin_run(test: str, delay: float) -> Mapping[str, np.ndarray]:
    """`simulated` with the twin as the crane."""
    return simulated(TWIN, test, delay)


def simulated(crane: Crane, test: str, delay: float = LATE) -> Mapping[str, np.ndarray]:
    """The signals of a test without noise; the tip as the PLC gets it, delayed [s]."""
    load, s_w, seed, height = CASES[test]
    case = Scenario(
        load=f"{load} kg",
        s_w=f"{s_w} m",
        tip=sea(seed, height),
        mode="ssc",
        duration=f"{LEAD + LENGTH} s",
        sensors={"delay": f"{delay} s"},
    )
    run = simulate(crane, case, every="10 ms")
    log = {name: run[name].values for name in NOISE}
    late, first = round(delay / STEP), round(LEAD / STEP)
    for name in ("s_tip", "v_tip", "a_tip"):
        log[name] = np.concatenate((np.full(late, log[name][0]), log[name][: len(log[name]) - late]))
    return {name: x[first:] for name, x in log.items()}


def logged(clean: Mapping[str, np.ndarray], seed: int, sensors: Mapping[str, tuple[float, float]] = NOISE) -> Signals:
    """The signals with noise and steps."""
    rng = np.random.default_rng(seed)
    out = {}
    for name, x in clean.items():
        sd, step = sensors[name]
        y = x + sd * rng.standard_normal(len(x))
        out[name] = np.round(y / step) * step if step else y
    return out


def records(
    crane: Crane = TWIN, *, delay: float = LATE, spoil: Callable[[Signals], Signals] | None = None, seed: int = 0
) -> tuple[Record, ...]:
    """Both tests of a crane as records; spoil: what is wrong with the log."""
    out = []
    for i, (test, (load, *_)) in enumerate(CASES.items()):
        log = logged(twin_run(test, delay) if crane is TWIN else simulated(crane, test, delay), 10 * seed + i)
        out.append(record(spoil(log) if spoil is not None else log, name=test, load=load))
    return tuple(out)


def checked(found: tuple[Record, ...], twin: Crane = TWIN) -> Step[ParameterEstimates]:
    """Step 1 on these records."""
    return check_parameters(campaign(*found, twin=twin, delay=LATE), found, lambda share: None)
