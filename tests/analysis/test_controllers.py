"""Controllers by name and from files: what they change, what they refuse."""

from __future__ import annotations

from pathlib import Path

import pytest

from stillhook import load_crane
from stillhook.analysis.controllers import Controller, controller, controller_toml, controllers
from stillhook.errors import SpecError, UnitError
from stillhook.spec.scenario import Mode

CRANE = load_crane("nov-250t")
SOFT = """mode = "ssc-cubic"
[control]
K_p = "0.3 1/m"
u_thr = 0.5
[active.motor]
alpha_min = 0.55
servo.omega_n = "7 rad/s"
"""


def written(folder: Path, text: str, name: str = "soft.toml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", [m.value for m in CRANE.plant.type.modes if m.compensates])
def test_plain_names_leave_the_crane_as_it_is(name: str) -> None:
    which = controller(name)
    assert which.on(CRANE) is CRANE
    assert which.mode.value == name


def test_a_file_changes_what_it_names_and_nothing_else(tmp_path: Path) -> None:
    which = controller(written(tmp_path, SOFT))
    crane = which.on(CRANE)
    assert (which.name, which.mode) == ("soft", Mode.SSC_CUBIC)
    assert (crane.control.K_p, crane.control.u_thr, crane.active.motor.alpha_min) == (0.3, 0.5, 0.55)
    assert crane.active.motor.servo.omega_n == 7.0
    assert crane.active.motor.servo.zeta == CRANE.active.motor.servo.zeta
    assert crane.control.alpha_ns == CRANE.control.alpha_ns
    assert CRANE.control.K_p == 0.16


def test_a_written_controller_reads_back_as_the_same_one(tmp_path: Path) -> None:
    which = controller(written(tmp_path, SOFT))
    again = controller(written(tmp_path, controller_toml(which, CRANE, "what it is\nfor"), "again.toml"))
    assert again.on(CRANE) == which.on(CRANE)
    assert again.mode is which.mode


REFUSED = (
    ('mode = "ssc"\n[control]\nK_q = "1 1/m"\n', "control.K_q", 'did you mean "K_p"?'),
    ('mode = "manual"\n', "manual", "ns, hs, ssc"),
    ('[control]\nK_p = "1 1/m"\n', "mode: missing", "motor law"),
    ('mode = "ssc"\nK_p = "1 1/m"\n', "K_p: unknown field", "Allowed: mode, control, active"),
    ('mode = "ssc"\ncontrol = 3\n', "control = 3", "must be a table"),
    ('mode = "ssc"\nactive.motor = 3\n', "active.motor = 3", "must be a table"),
    ('mode = "ssc"\n[active]\nmotor.count = 7\n', "active.motor.count", "unknown field. Allowed: alpha_min"),
    ('mode = ["ssc"]\n', "mode", "Choose one of"),
    ("", "empty", 'mode = "ssc"'),
)


@pytest.mark.parametrize(("text", "where", "what"), REFUSED)
def test_a_file_that_is_no_controller_is_refused_in_one_line(tmp_path: Path, text: str, where: str, what: str) -> None:
    with pytest.raises(SpecError) as refused:
        controller(written(tmp_path, text))
    line = str(refused.value)
    assert where in line
    assert what in line
    assert line.startswith("soft.toml: ")
    assert "\n" not in line


def test_a_number_without_its_unit_is_refused_with_the_controllers_name(tmp_path: Path) -> None:
    which = controller(written(tmp_path, 'mode = "ssc"\n[control]\nK_p = 0.3\n'))
    with pytest.raises(UnitError, match=r'controller "soft".*control\.K_p = 0\.3.*unit'):
        which.on(CRANE)


@pytest.mark.parametrize("name", ["scc", "manual", "nowhere.toml", 3])
def test_a_name_that_there_is_not_is_refused_with_those_there_are(name: str) -> None:
    with pytest.raises(SpecError):
        controller(name)


def test_several_controllers_are_named_once_in_one_text() -> None:
    assert [c.name for c in controllers("ns, ssc")] == ["ns", "ssc"]
    with pytest.raises(SpecError, match="named twice"):
        controllers("ns,ns")
    with pytest.raises(SpecError, match="at least one"):
        controllers(" , ")


def test_a_rule_gives_the_changes_for_the_crane_at_hand() -> None:
    which = Controller("twice", Mode.SSC, lambda crane: {"control": {"K_p": f"{2.0 * crane.control.K_p} 1/m"}})
    assert which.on(CRANE).control.K_p == 0.32
