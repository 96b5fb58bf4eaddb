"""What `tune` says of the one margin beside its tables, and its refusals where no gain has one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from stillhook import Crane, load_crane
from stillhook.analysis.controllers import Controller, controller
from stillhook.analysis.loop_stability.governing import Governing, governing
from stillhook.analysis.tuning.objective import Limits, linear_broken
from stillhook.analysis.tuning.parameters import space
from stillhook.cli import run as command
from stillhook.cli.analysis.tune import _Report
from stillhook.errors import StillhookError
from stillhook.library import changed
from stillhook.spec.scenario import Mode
from stillhook.units import show

HOPELESS = """\
base = "nov-250t-secondary"
[wire]
zeta = 1e-4
zeta_low = 1e-4
zeta_high = 1e-4
[control]
tau_F = "0.05 s"
"""
"""A wire that hardly takes anything, and its ringing fed ahead: every payload swings without feedback at some speed, and
no place is clear of those."""


def remarks(crane: Crane, mode: Mode, K_p: str) -> tuple[list[str], Governing]:
    """What is said of a tuned controller with this gain, and the margin that it is said of."""
    tuned: Any = SimpleNamespace(
        start=controller(mode.value), controller=Controller("tuned", mode, {"control": {"K_p": K_p}})
    )
    report = object.__new__(_Report)
    report.crane, report.tuned = crane, [tuned]
    report.stable = [governing(tuned.controller.on(crane), mode, wires=(100.0,))]
    return report._stability_remarks(), report.stable[0]


@pytest.mark.slow
def test_places_that_no_gain_stabilises_are_remarked_with_their_number() -> None:
    lines, found = remarks(load_crane("nov-250t"), Mode.SSC, "0.16 1/m")
    (line,) = lines
    first = found.no_gain[0]
    assert not first.gains.any
    assert line.startswith(f"ssc: No gain K_p stabilises the complete plant at {first.place.describe()} and at ")
    assert line.endswith(f"and at {len(found.no_gain) - 1} more places of {len(found.places)}")


@pytest.mark.slow
def test_a_gain_above_the_limit_is_remarked_and_one_below_is_not() -> None:
    crane = load_crane("nov-250t-secondary")
    assert remarks(crane, Mode.POSITION, "0.14 1/m")[0] == []
    (line,), found = remarks(crane, Mode.POSITION, "3 1/m")
    assert found.limit is not None
    assert found.limit.gains.high < 3.0
    assert (
        f"above {show(found.limit.gains.high, 'gain_per_length', 2)} the complete plant oscillates with {found.limit.describe()}, and K_p is 3 1/m"
        in line
    )


@pytest.mark.slow
def test_a_crane_without_a_place_that_decides_is_refused_in_one_line(
    tmp_path: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "hopeless.toml"
    file.write_text(HOPELESS)
    assert command(["tune", str(file), "--controllers", "position", "--free", "K_p"]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    (line,) = (line for line in shown.err.splitlines() if not line.startswith("compiling the winch model"))
    assert line.startswith("error: ")
    assert line.endswith("the complete plant oscillates without feedback at every speed. There is no gain to tune.")


@pytest.mark.slow
def test_no_gain_keeps_the_margins_where_no_place_decides() -> None:
    wire = {"zeta": 1e-4, "zeta_low": 1e-4, "zeta_high": 1e-4}
    crane = changed(load_crane("nov-250t-secondary"), {"control": {"tau_F": "0.05 s"}, "wire": wire})
    with pytest.raises(StillhookError, match="There is no gain to tune"):
        space(crane, Mode.POSITION)
    (line,) = linear_broken(crane, Mode.POSITION, Limits(), ())
    assert line.startswith("no gain K_p keeps the margins: no place decides")
