"""Logs of a crane's passive circuit for tests of step 6 and of rests: two loads in heave compensation, and rests on the brake."""

import functools
from collections.abc import Callable, Mapping

import numpy as np
from tests.validate.ahc_logs import STEP, TWIN, campaign, record, sea
from tests.validate.parameter_logs import CASES, NOISE, Signals, logged

from stillhook import Scenario, simulate
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Operator
from stillhook.validate.criteria.criteria import load_criteria
from stillhook.validate.criteria.judge import judge
from stillhook.validate.criteria.results import Step, StepNumber
from stillhook.validate.data_set.campaign import Kind
from stillhook.validate.data_set.record import Record
from stillhook.validate.parameters.check import ParameterEstimates, check_parameters
from stillhook.validate.passive.check import PassiveEstimates, check_passive

SENSORS = {**NOISE, "alpha_pp": (5e-4, 1e-4), "V_acc": (1e-3, 1e-3), "mode": (0.0, 0.0)}
"""As `parameter_logs.NOISE`, with the make-up pumps and a piston that is measured to a litre."""
USUAL = tuple(name for name in SENSORS if name not in ("alpha_pp", "V_acc"))
"""Signals of a usual log: neither the passive pumps nor the place of the piston."""
LEAD, LENGTH = 60.0, 150.0  # s before the log, and of it

Spoil = Callable[[Signals], Signals]


@functools.cache
def twin_run(test: str) -> Mapping[str, np.ndarray]:
    """`simulated` with the twin as the crane."""
    return simulated(TWIN, test)


def simulated(crane: Crane, test: str) -> Mapping[str, np.ndarray]:
    """The signals of a test without noise."""
    load, s_w, seed, height = CASES[test]
    case = Scenario(load=f"{load} kg", s_w=f"{s_w} m", tip=sea(seed, height), mode="ssc", duration=f"{LEAD + LENGTH} s")
    run = simulate(crane, case, every="10 ms")
    return {name: run[name].values[round(LEAD / STEP) :] for name in SENSORS}


def with_noise(clean: Mapping[str, np.ndarray], seed: int, names: tuple[str, ...]) -> Signals:
    """Signals with noise and steps."""
    return logged({name: clean[name] for name in names}, seed, SENSORS)


def records(
    crane: Crane = TWIN, *, spoil: Spoil | None = None, seed: int = 0, names: tuple[str, ...] = USUAL
) -> tuple[Record, ...]:
    """Both tests of a crane as records; spoil: what is different in the crane or wrong in the log, applied before the noise."""
    out = []
    for i, (test, (load, *_)) in enumerate(CASES.items()):
        clean = dict(twin_run(test) if crane is TWIN else simulated(crane, test))
        log = with_noise(spoil(clean) if spoil is not None else clean, 10 * seed + i, names)
        out.append(record(log, name=test, load=load))
    return tuple(out)


def checked(found: tuple[Record, ...], twin: Crane = TWIN) -> Step[PassiveEstimates]:
    """Step 6 on these records."""
    return check_passive(campaign(*found, twin=twin), found, lambda share: None)


def lines(step: Step) -> dict:
    """The verdict lines of a step by key."""
    return {line.key: line for line in judge(load_criteria("paper-f"), step.measures, (StepNumber(step.number),))}


def dead(count: int, of: int = 16, p_lp: float = 15e5) -> Spoil:
    """Passive motors that turn without oil: the active motors take their torque, the gas sees less oil. Exact to first order in the swing
    of the pressure; the PLC does not know."""

    def spoil(log: Signals) -> Signals:
        share = count / of
        D_p, D = TWIN.passive.motor.D_total, TWIN.active.motor.D_total
        missing = share * D_p * log["alpha_pm"] * (log["p_hp"] - p_lp) / (D * log["alpha_m"])
        mean = log["p_hp"].mean()
        return log | {"p_a": log["p_a"] + missing, "p_hp": mean + (1.0 - share) * (log["p_hp"] - mean)}

    return spoil


# --- rests ------------------------------------------------------------------------------------------------------------------------------


@functools.cache
def rest_run(load: float = 60e3) -> Mapping[str, np.ndarray]:
    """Hoisting and lowering in manual mode with rests of five seconds on the brake."""
    points, t = [("0 s", "0 m/s")], 3.0
    for v in (0.3, -0.3, 0.4, -0.4):
        for wait, speed in ((0.0, 0.0), (0.5, v), (5.0, v), (0.5, 0.0), (5.0, 0.0)):
            t += wait
            points.append((f"{t:.2f} s", f"{speed} m/s"))
    case = Scenario(
        load=f"{load} kg", s_w="400 m", mode="manual", duration=f"{t:.2f} s", operator=Operator(profile=points)
    )
    run = simulate(TWIN, case, every="10 ms")
    return {name: run[name].values for name in SENSORS}


def rest_records(*, spoil: Spoil | None = None, seed: int = 0) -> tuple[Record, ...]:
    """The rests as a record of a test in manual mode."""
    clean = dict(rest_run())
    log = with_noise(spoil(clean) if spoil is not None else clean, seed, USUAL)
    return (record(log, name="rests", load=60e3, mode=Mode.MANUAL, kind=Kind.LIMITS),)


def rested(found: tuple[Record, ...], twin: Crane = TWIN) -> Step[ParameterEstimates]:
    """Step 1 on these records."""
    return check_parameters(campaign(*found, twin=twin), found, lambda share: None)
