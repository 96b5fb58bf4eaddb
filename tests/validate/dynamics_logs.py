"""Records of a winch that turns quickly without load, for tests of step 4: simulated, with the noise of a PLC's log."""

import functools
from dataclasses import replace

import numpy as np
from tests.validate import ahc_logs
from tests.validate.ahc_logs import STEP, TWIN

from stillhook import Scenario, library, simulate
from stillhook.spec.scenario import Mode, Operator
from stillhook.validate.data_set.campaign import Kind
from stillhook.validate.data_set.record import Record
from stillhook.validate.dynamics.model import bent

NOISE = {"p_a": 0.5e5, "p_b": 0.5e5, "omega_m": 0.1, "alpha_p": 5e-4, "v_w": 1e-3}
NAMES = ("s_w", "v_w", "omega_m", "p_a", "p_b", "u_p", "u_m", "alpha_p", "alpha_m")
SPEEDS = (25.0, -25.0, 35.0, -35.0)  # m/min: a third and a half of full speed, both ways


def turns(ramp: float) -> Operator:
    """From rest to each speed within `ramp` seconds, held, and back."""
    profile, t = [("0 s", "0 m/min"), ("2 s", "0 m/min")], 2.0
    for v in SPEEDS:
        for dt, x in ((ramp, v), (4.0, v), (ramp, 0.0), (3.0, 0.0)):
            t += dt
            profile.append((f"{t:.2f} s", f"{x} m/min"))
    return Operator(profile=profile)


@functools.cache
def signals(
    logs: tuple[tuple[str, float], ...] = (),
    ramp: float = 0.3,
    load: float = 0.0,
    s_w: float = 15.0,
    *,
    brake: bool = True,
    form: str = "",
) -> dict[str, np.ndarray]:
    """What a crane logs whose numbers lie off the twin's by exp(logs), without noise; brake: whether it closes between the turns; form: of
    the active circuit's leak, default the twin's."""
    duration = 2.0 + len(SPEEDS) * (2.0 * ramp + 7.0)
    case = Scenario(
        load=f"{load} kg",
        s_w=f"{s_w} m",
        mode="manual",
        duration=f"{duration:.2f} s",
        warm_up="0 s",
        ramp="0 s",
        operator=turns(ramp),
    )
    twin = TWIN if not form else library.changed(TWIN, {"active": {"leak": {"form": form}}})
    twin = twin if brake else twin.model_copy(update={"brake": None})
    run = simulate(bent(twin, dict(logs)), case, every="10 ms")
    return {name: run[name].values for name in NAMES}


def record(
    log: dict[str, np.ndarray], *, seed: int = 1, load: float = 0.0, without: tuple[str, ...] = (), every: int = 1
) -> Record:
    """A log as a record, noisy; every: only each so many samples."""
    rng = np.random.default_rng(seed)
    noisy = {
        name: x + NOISE.get(name, 0.0) * rng.standard_normal(len(x)) for name, x in log.items() if name not in without
    }
    noisy = {name: x[::every] for name, x in noisy.items()}
    kind, mode = Kind.DYNAMICS, Mode.MANUAL
    return ahc_logs.record(noisy, name="turns", load=load, mode=mode, kind=kind, step=STEP * every)


def changed(r: Record, **new: np.ndarray) -> Record:
    """A record with some signals replaced."""
    return replace(r, signals={**r.signals, **new})
