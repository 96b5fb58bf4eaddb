"""Inputs that end: a session runs to the last cycle that they have, and no further."""

from __future__ import annotations

import numpy as np
import pytest

import stillhook
from stillhook.errors import StillhookError
from stillhook.sea.motion.recorded import Recorded

CRANE = stillhook.load_crane("nov-250t")
CYCLE = CRANE.control.t_cycle
LAST = 203
"""Cycles that the motion is known for: no multiple of what is prepared at a time."""
pytestmark = pytest.mark.slow


def recorded() -> stillhook.Scenario:
    t = np.linspace(0.0, LAST * CYCLE, 30)
    tip = Recorded(t, 0.3 * np.sin(t), source="log")
    fields = {"load": "50 t", "s_w": "100 m", "mode": "ssc", "ramp": "0 s", "warm_up": "0 s", "duration": "2 s"}
    return stillhook.Scenario(tip=tip, **fields)


def test_a_session_runs_to_the_last_cycle_of_a_recorded_motion() -> None:
    session = stillhook.Session(CRANE, recorded())
    session.step(cycles=LAST)
    assert session.time == pytest.approx(LAST * CYCLE)
    with pytest.raises(StillhookError):
        session.step(cycles=2)


def test_a_session_in_pieces_ends_where_one_in_a_go_does() -> None:
    whole, pieces = stillhook.Session(CRANE, recorded()), stillhook.Session(CRANE, recorded())
    whole.step(cycles=LAST)
    for _ in range(LAST):
        pieces.step()
    assert pieces.save() == whole.save()
