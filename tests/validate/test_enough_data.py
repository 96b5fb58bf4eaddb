"""From how much data on a number is reported, and how much of a stretch is left out."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from tests.validate.ahc_logs import STEP, TWIN
from tests.validate.dynamics_logs import record

from stillhook.analysis.loop_stability.stability import eigenfrequency
from stillhook.control.registry import code_of
from stillhook.validate.controller import check
from stillhook.validate.dynamics.runs import dynamics_segment

U_THR, LEAST = 0.6, 0.4


def implied(monkeypatch: pytest.MonkeyPatch, samples: int):  # type: ignore[no-untyped-def]
    """u_thr from a log of 20 s at 10 ms in which the motors are between full and least displacement for so many
    samples, spread over all of it; the law of thesis eqs 2.9 and 2.10 holds exactly."""
    n = 2000
    u_ff = np.full(n, 0.3)  # below the threshold: full displacement
    where = np.linspace(0, n - 1, samples).round().astype(int)
    u_ff[where] = np.random.default_rng(1).uniform(0.65, 0.95, samples)
    u_m = 1.0 - (1.0 - LEAST) * np.clip((u_ff - U_THR) / (1.0 - U_THR), 0.0, 1.0)
    mode = np.full(n, code_of("ssc"))
    segment = SimpleNamespace(u_m=u_m, seen=SimpleNamespace(mode=mode), record=SimpleNamespace(step=STEP))
    monkeypatch.setattr(check, "difference", lambda run, name, cycles: np.zeros(n))
    monkeypatch.setattr(check, "feedforward_logged", lambda run, cycles: u_ff)
    monkeypatch.setattr(check, "least", lambda crane, run: np.full(n, LEAST))
    return check.threshold(TWIN, [SimpleNamespace(segment=segment)], 0)


def test_a_threshold_takes_a_second_of_reduced_displacement(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundred samples of 10 ms are one."""
    found = implied(monkeypatch, 100)
    assert found is not None
    assert found.value == pytest.approx(U_THR, abs=1e-9)
    assert implied(monkeypatch, 99) is None


def log(start: float) -> dict[str, np.ndarray]:
    """Ten seconds of a winch whose pumps are at `start` of full flow at first."""
    t = np.arange(0.0, 10.0, STEP)
    u_p = np.where(t < 5.0, start, 0.3)
    names = ("omega_m", "p_a", "p_b", "s_w")
    return {"u_p": u_p, "u_m": np.ones(len(t)), **{name: np.full(len(t), 20.0) for name in names}}


@pytest.mark.parametrize(("start", "periods"), [(0.015, 0.0), (0.03, 4.0)])
def test_of_a_winch_in_motion_four_of_its_periods_are_left_out(start: float, periods: float) -> None:
    """The twin starts at rest, and its transient rings at the eigenfrequency of the empty winch. In motion is a winch
    whose pumps are at more than 2 % of full flow."""
    log_record = record(log(start))
    (segment,) = log_record.segments
    used = dynamics_segment(TWIN, log_record, segment, 0, len(log_record.t))
    left_out = used.t[used.counted][0]
    period = eigenfrequency(TWIN, 1.0).period
    assert left_out == pytest.approx(periods * period, rel=0.1)
