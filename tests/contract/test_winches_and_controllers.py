"""Every command runs on every registered winch type with every registered controller."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from tests.contract.commands import OF_CLOSED_CIRCUITS, OF_CONTROLLER, OF_NUMBERS, OF_OPERATOR, OF_WINCH, answer

from stillhook import Scenario, load_crane
from stillhook.control.registry import MANUAL_MODE, Mode
from stillhook.engine.scenario.summary import POSITION, numbers_of
from stillhook.engine.simulate import run_cases
from stillhook.library import cranes
from stillhook.winches import types
from stillhook.winches.registry import WINCH_TYPES

CRANES = {str(load_crane(name).plant): name for name in cranes()}
"""Winch type -> a crane of the library."""
NOT_AT_REST = (*POSITION, "energy_unaccounted")
OF_AN_OSCILLATION = ("oscillation_period", "oscillation_v_w", "oscillation_F_w")
"""Numbers that a winch in manual mode does not have while it stands still."""

every_winch = pytest.mark.parametrize("winch", CRANES)
every_pair = pytest.mark.parametrize(
    ("winch", "mode"), [(winch, mode) for winch in CRANES for mode in WINCH_TYPES[winch].modes]
)


def usual_of(winch: str) -> str:
    """The controller of a winch type where a user names none."""
    return WINCH_TYPES[winch].default_mode.value


@pytest.mark.long
def test_a_controller_of_another_kind_of_drive_is_refused_in_one_line(tmp_path: Path) -> None:
    for winch, crane in CRANES.items():
        for mode in set(Mode) - set(WINCH_TYPES[winch].modes):
            for command in ("compare", "run", "map", "envelope", "lower"):
                found = answer(command, crane, mode.value, tmp_path)
                assert found.refused, (winch, mode, command, found.error)
                assert "is for another kind of drive" in found.error


def test_the_library_has_a_crane_of_every_winch_type() -> None:
    shipped = Path(types.__file__).parent
    assert set(CRANES) == {name for name, each in WINCH_TYPES.items() if each.file.parent == shipped}


def test_every_winch_runs_under_every_controller_with_the_numbers_of_its_type() -> None:
    case = Scenario(load="10 t", s_w="100 m", tip="sine 1 m 10 s", duration="20 s", warm_up="10 s")
    for name in CRANES.values():
        crane = load_crane(name)
        modes = crane.plant.type.modes
        for mode, run in zip(modes, run_cases(crane, [case.with_mode(mode) for mode in modes]), strict=True):
            known = [n for n in numbers_of(crane) if mode.compensates or n not in NOT_AT_REST]
            assert set(run) == {*numbers_of(crane), "status", "notes"}
            known = [n for n in known if run["oscillation_time"] > 0.0 or n not in OF_AN_OSCILLATION]
            assert all(math.isfinite(run[n]) for n in known), (name, mode)


@pytest.mark.thorough
@every_pair
@pytest.mark.parametrize("command", OF_CONTROLLER)
def test_every_command_runs_on_every_winch_with_every_controller_of_its(
    command: str, winch: str, mode: Mode, tmp_path: Path
) -> None:
    found = answer(command, CRANES[winch], mode.value, tmp_path)
    assert found.given or (found.refused and mode is MANUAL_MODE and command not in OF_OPERATOR), found.error


def reason(command: str, winch: str) -> str:
    """What the one line says in which a command is refused on a winch type; "" where it must answer."""
    number = OF_NUMBERS.get(command)
    if number is not None and number not in {row.name for row in WINCH_TYPES[winch].numbers}:
        return f"has no {number}"
    return "" if load_crane(CRANES[winch]).circuits else OF_CLOSED_CIRCUITS.get(command, "")


@pytest.mark.thorough
@every_winch
@pytest.mark.parametrize("command", OF_WINCH)
def test_every_other_form_of_a_command_runs_on_every_winch_or_says_why_not(
    command: str, winch: str, tmp_path: Path
) -> None:
    found = answer(command, CRANES[winch], usual_of(winch), tmp_path)
    if why := reason(command, winch):
        assert found.refused, found.error
        assert why in found.error
    else:
        assert found.given, found.error


@pytest.mark.long
@every_winch
@pytest.mark.parametrize("command", ["map", "calc steady", "uncertainty"])
def test_quick_commands_run_on_every_winch(command: str, winch: str, tmp_path: Path) -> None:
    found = answer(command, CRANES[winch], usual_of(winch), tmp_path)
    assert found.given, found.error
