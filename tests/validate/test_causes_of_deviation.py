"""Causes of a deviation: which change of each parameter is believed, in a twin whose effects are known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from tests.validate.ahc_logs import TWIN

from stillhook.validate.ahc import replay
from stillhook.validate.ahc.replay import CAUSES, explain, statements

STEP, SECONDS = 0.05, 200.0
T = np.arange(0.0, SECONDS, STEP)
BAR = 1e5
ORDER_OF_SIZE = ("leakage", "friction", "K_2", "K_p", "C_h", "motor_servo")
"""Parameters that nobody knows well: each may be some times what the file says."""
TWICE = ("J_m_eff", "pump_servo")
"""Those that a data sheet gives: no more than twice."""
WELL_KNOWN = ("K_1", "speed", "motor_offset")
"""Those that are read off the machine, or from full command: tens of per cent."""
BELIEVED = {
    **dict.fromkeys(ORDER_OF_SIZE, (2.0, 4.0)),
    **dict.fromkeys(TWICE, (0.7, 1.5)),
    **dict.fromkeys(WELL_KNOWN, (0.2, 0.5)),
}
"""Relative change of a parameter that is plausible, and one that is not."""


def wave(k: int) -> np.ndarray:
    """Effect of a change of all of the k-th parameter on the control error [m]: one frequency each."""
    return 0.05 * np.sin(2.0 * np.pi * (0.05 + 0.01 * k) * T)


def effects(cranes, replays, names, *, quick):  # type: ignore[no-untyped-def]
    """Linear twin: the file's has no error, and each parameter has its own wave in error and pressures."""
    runs = []
    for k in range(len(cranes)):
        e = np.zeros(len(T)) if k == 0 else CAUSES[k - 1].x * wave(k)
        runs.append({"e_c_measured": e, "p_a": 100.0 * BAR + 50.0 * BAR * e, "p_b": np.full(len(T), 20.0 * BAR)})
    return runs


def explained(monkeypatch: pytest.MonkeyPatch, error: np.ndarray):  # type: ignore[no-untyped-def]
    """What `explain` says of a crane with this error [m] beside the twin's."""
    monkeypatch.setattr(replay, "run_twin", effects)
    logged = {"p_a": 100.0 * BAR + 50.0 * BAR * error, "p_b": np.full(len(T), 20.0 * BAR)}
    segment = SimpleNamespace(record=SimpleNamespace(step=STEP), measured=logged.__getitem__)
    segment.shortened = lambda duration: segment
    return explain(TWIN, [segment], [error])


@pytest.mark.parametrize("k", range(1, len(CAUSES) + 1), ids=[c.name for c in CAUSES])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_plausible_change_of_a_parameter_is_found_and_an_implausible_one_is_not(
    monkeypatch: pytest.MonkeyPatch, k: int, sign: float
) -> None:
    plausible, implausible = (sign * x for x in BELIEVED[CAUSES[k - 1].name])
    (first, *_), deviation = explained(monkeypatch, plausible * wave(k))
    assert first.cause.name == CAUSES[k - 1].name
    assert first.amount == pytest.approx(plausible, rel=1e-3)
    assert first.share == pytest.approx(1.0, abs=1e-3)
    assert deviation.e_c == pytest.approx(abs(plausible) * 0.05 / np.sqrt(2.0), rel=0.02)
    causes, _ = explained(monkeypatch, implausible * wave(k))
    assert max(c.share for c in causes) < 0.1


def test_a_deviation_of_a_millimetre_needs_no_cause(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice the resolution of a PLC's error in millimetres is the least that does; rms values."""
    causes, deviation = explained(monkeypatch, 0.0275 * wave(1) * np.sqrt(2.0))
    assert deviation.e_c < 2e-3
    assert causes == ()
    causes, _ = explained(monkeypatch, 0.0425 * wave(1) * np.sqrt(2.0))
    assert causes[0].cause.name == CAUSES[0].name


def test_a_cause_is_stated_where_it_explains_half_of_the_deviation(monkeypatch: pytest.MonkeyPatch) -> None:
    """The rest is a wave that no parameter makes."""
    strange = 0.05 * np.sin(2.0 * np.pi * 0.2 * T)
    for share, stated in ((0.55, True), (0.45, False)):
        error = np.sqrt(share) * 0.2 * wave(3) + np.sqrt(1.0 - share) * 0.2 * strange
        causes, deviation = explained(monkeypatch, error)
        assert causes[0].share == pytest.approx(share, abs=0.04)
        assert bool(statements(causes, deviation)) is stated
