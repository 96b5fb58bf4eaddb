"""Parameter sets with their uncertainty: files, what is refused, and how they drop into a crane file."""

from pathlib import Path

import numpy as np
import pytest
from tests.identify.refusals import refused

from stillhook import load_crane, simulate
from stillhook.formats.results import load_run, rerun, save_run
from stillhook.library import (
    FrictionSet,
    LossSet,
    crane_from_toml,
    crane_toml,
    frictions,
    load_friction,
    load_losses,
    load_set,
    motors,
    set_toml,
)
from stillhook.library.parameter_sets import Evidence, save_set
from stillhook.spec.crane import Source, SourceKind
from stillhook.spec.scenario import Scenario

EVIDENCE = """
[evidence]
names = ["Y_1", "Y_4"]
covariance = [[1e-12, 1e-7], [1e-7, 0.25]]
dof = 120
data = "7 tests of the crane, 0 to 107 t"
omega_m = ["25 rev/min", "1200 rev/min"]
T_d = ["0.1 MN m", "2 MN m"]
statements = ["Y_2 cannot be reported from Y_3: one displacement only"]
"""
FRICTION = """title = "My crane"
Y_1 = { value = 2e-05, kind = "fitted", source = "tests of spring" }
Y_2 = "0 N m"
Y_3 = "1.5 N m"
Y_4 = "200 rev/min"
Y_5 = "0.01 N m s/rad"
Y_6 = 1.5e-05
"""


def written(folder: Path, text: str, name: str = "my.friction.toml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def crane(folder: Path, text: str) -> Path:
    """A crane file of this text on the library's nov-150t."""
    return written(folder, f'base = "nov-150t"\n{text}', "mine.toml")


OWN = '[friction]\nlibrary = "my.friction.toml"\n'


# Reading and writing


@pytest.mark.parametrize("name", [*frictions(), *motors()])
def test_every_set_of_the_library_is_read_with_its_sources_and_written_back_alike(name, tmp_path):
    item = load_set(name)
    assert isinstance(item, FrictionSet if name in frictions() else LossSet)
    spec = item.system if isinstance(item, FrictionSet) else item.motor
    assert all(
        place in item.sources
        for place in type(spec).model_fields
        if place != "loss" and getattr(spec, place) is not None
    )
    again = load_set(save_set(item, tmp_path / f"{name}.toml"))
    assert again == item


def test_a_set_of_a_file_keeps_its_evidence_through_writing(tmp_path):
    item = load_friction(written(tmp_path, FRICTION + EVIDENCE))
    evidence = item.evidence
    assert evidence is not None
    assert (item.name, item.title) == ("my.friction", "My crane")
    assert item.sources["Y_1"] == Source(text="tests of spring", kind=SourceKind.FITTED)
    assert item.sources["Y_3"].kind is SourceKind.USER
    assert evidence.deviation("Y_1") == pytest.approx(1e-6)
    assert evidence.deviation("Y_4") == pytest.approx(0.5)
    assert evidence.deviation("Y_6") == 0.0
    assert evidence.T_d == pytest.approx((1e5, 2e6))
    assert evidence.statements[0].startswith("Y_2 cannot be reported")
    again = load_set(save_set(item, tmp_path / "my.friction.toml"))
    assert again.evidence == evidence
    assert again == item


def test_a_motor_of_a_file_is_told_from_a_friction_by_what_it_holds(tmp_path):
    loss = load_losses("A6VM215")
    with_evidence = LossSet(
        "m",
        "My motor",
        loss.motor,
        loss.sources,
        Evidence(names=("X_4",), covariance=((0.04,),), dof=12.0, data="a map", D_m=("50 cm^3/rev", "215 cm^3/rev")),
    )
    again = load_set(save_set(with_evidence, tmp_path / "m.toml"))
    assert isinstance(again, LossSet)
    assert again == with_evidence


# Sets in a crane file


def test_a_crane_file_names_a_set_by_its_path_seen_from_its_own_folder(tmp_path, monkeypatch):
    folder = tmp_path / "cranes"
    folder.mkdir()
    written(folder, FRICTION + EVIDENCE)
    save_set(load_losses("A6VM215-crane-2-second-loop"), folder / "my-motor.toml")
    crane_file = crane(folder, OWN + '[active.motor]\ntype = "my-motor.toml"\n')
    monkeypatch.chdir(tmp_path)
    machine = load_crane(crane_file)
    assert machine.friction.system == load_friction(folder / "my.friction.toml").system
    assert machine.active.motor.loss == load_losses("A6VM215-crane-2-second-loop").motor.loss
    assert machine.active.motor.count == 3
    assert machine.sources["friction.system.Y_1"].text == "tests of spring"
    other = written(tmp_path, 'base = "cranes/mine.toml"\n[friction.system]\nY_5 = "0.02 N m s/rad"\n', "other.toml")
    changed = load_crane(other)
    assert changed.friction.system.Y_5 == 0.02
    assert changed.friction.system.Y_1 == machine.friction.system.Y_1


def test_what_a_crane_file_says_itself_wins_over_the_set(tmp_path):
    written(tmp_path, FRICTION)
    system = load_crane(crane(tmp_path, OWN + '[friction.system]\nY_4 = "150 rev/min"\n')).friction.system
    assert system.Y_4 == pytest.approx(150.0 * np.pi / 30.0)
    assert system.Y_3 == 1.5


@pytest.mark.thorough
def test_a_stored_crane_and_a_stored_run_need_no_file_of_their_sets_any_more(tmp_path):
    path = written(tmp_path, FRICTION)
    machine = load_crane(crane(tmp_path, OWN))
    run = simulate(machine, Scenario(load="50 t", s_w="100 m", duration="2 s", warm_up="1 s", tip="sine 1 m 8 s"))
    save_run(run, tmp_path / "run.nc")
    path.unlink()
    assert crane_from_toml(crane_toml(machine), "stored crane") == machine
    again = rerun(load_run(tmp_path / "run.nc"))
    assert float(again.p_max) == float(run.p_max)


@pytest.mark.parametrize(
    ("call", "argument", "line"),
    [
        (load_crane, '[friction]\nlibrary = "missing.toml"\n', 'mine.toml: friction.library = "missing.toml": no such'),
        (
            load_crane,
            '[active.motor]\ntype = "A6VM21"\n',
            'mine.toml: active.motor.type = "A6VM21": not in the library',
        ),
        (load_set, "crane-3", 'set "crane-3": the library has'),
        (load_friction, "A6VM215", 'friction set = "A6VM215": not in the library'),
    ],
)
def test_a_set_that_is_not_there_is_named_with_the_place_that_names_it(tmp_path, call, argument, line):
    assert refused(call, crane(tmp_path, argument) if call is load_crane else argument).startswith(line)


# What is refused


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ('"Y_4"]', '"Y_9"]', 'evidence.names: "Y_9" is not one of Y_1, Y_2, Y_3, Y_4, Y_5, Y_6.'),
        ('"Y_4"]', '"Y_1"]', "evidence: names: a name is given twice. Name each parameter once."),
        ("0.25]]", "0.25], [0.0, 0.0]]", "evidence: covariance: 3 rows of 2 values for 2 names. Give 2 rows of 2."),
        ("[1e-7, 0.25]]", "[1e-7]]", "evidence: covariance: 2 rows of 1, 2 values for 2 names. Give 2 rows of 2."),
        (
            "[1e-7, 0.25]]",
            "[2e-7, 0.25]]",
            "evidence: covariance: it is not symmetric. Give the covariance of each pair",
        ),
        ("0.25]]", "-0.25]]", "evidence: covariance: a variance on its diagonal is negative. Give variances and"),
        ("1e-7], [1e-7", "1e-6], [1e-6", "evidence: covariance: it is not positive semidefinite (least eigenvalue of "),
        ("dof = 120", "dof = 0", "evidence: dof = 0: it must be greater than 0."),
        ('"25 rev/min"', '"25 bar"', 'evidence: omega_m[0] = "25 bar": unit "bar" is not one of rad/s, rev/min, rpm.'),
        ('"25 rev', '"2500 rev', "evidence: omega_m = ['2500 rev/min', '1200 rev/min']: its second value is below its"),
        ("dof = 120", "dog = 120", "evidence: dog: unknown field"),
        ("[evidence]", "[[evidence]]", "evidence = [{"),
        ('title = "My crane"', "title = 3", "title = 3: give a text."),
        ('Y_2 = "0 N m"', "", "Y_2: missing (constant friction; in N m, kN m, MN m). Add it."),
        ('Y_2 = "0 N m"', 'Y_2 = "-1 N m"', 'Y_2 = "-1 N m": it must be greater than or equal to 0.'),
        ('Y_2 = "0 N m"', 'Y_2 = "0 N m"\nname = "x"', "name: unknown field"),
    ],
)
def test_a_mistake_in_a_set_is_one_line_that_says_where_and_what(tmp_path, old, new, text):
    line = refused(load_friction, written(tmp_path, (FRICTION + EVIDENCE).replace(old, new)))
    assert line.startswith(f"my.friction.toml: {text}")
    assert refused(load_crane, crane(tmp_path, OWN)) == line


def test_an_empty_set_and_one_of_the_wrong_kind_are_refused(tmp_path):
    assert refused(load_set, written(tmp_path, "  \n")).startswith("my.friction.toml: empty. Copy a set of the library")
    save_set(load_losses("A6VM215"), tmp_path / "motor.toml")
    wrong = "motor.toml is a motor set, not a friction set: stillhook friction draws reads it"
    assert refused(load_friction, tmp_path / "motor.toml").startswith(wrong)
    assert refused(load_crane, crane(tmp_path, '[friction]\nlibrary = "motor.toml"\n')).startswith(wrong)


def test_evidence_is_made_from_the_numbers_of_a_fit_and_checked_as_that_of_a_file():
    made = Evidence.fitted(
        ["Y_1", "Y_4"],
        np.array([[1e-12, 1e-7], [1e-7, 0.25]]),
        dof=120,
        data="tests",
        ranges={"T_d": (1e5, 2e6)},
        statements=["one load only"],
    )
    assert made.T_d == (1e5, 2e6)
    assert made.matrix.tolist() == [[1e-12, 1e-7], [1e-7, 0.25]]
    line = refused(Evidence.fitted, ["Y_1", "Y_4"], np.array([[1.0, 2.0], [2.0, 1.0]]), dof=5, data="tests")
    assert line.startswith("fit: evidence: covariance: it is not positive semidefinite")


def test_a_covariance_of_parameters_that_were_held_may_be_zero():
    evidence = Evidence(names=("Y_1", "Y_2"), covariance=((1e-12, 0.0), (0.0, 0.0)), dof=3.0, data="tests")
    assert evidence.deviation("Y_2") == 0.0


def test_nothing_is_written_where_a_folder_is_in_the_way(tmp_path):
    assert "cannot be written" in refused(save_set, load_friction("crane-1"), tmp_path)
    assert set_toml(load_friction("crane-1")).startswith('title = "System friction of crane 1')


def test_a_motor_of_a_set_brings_the_range_in_which_its_loss_was_fitted(tmp_path):
    """Where the set has evidence, its ranges say it, and no longer those of the motor that lent the rest."""
    plain = set_toml(load_losses("A6VM215"))
    known = '\n[evidence]\nnames = ["X_4"]\ncovariance = [[0.01]]\ndof = 9\ndata = "a bench"\nD_m = ["110 cm^3/rev", "215 cm^3/rev"]\n'
    written(tmp_path, plain + known + 'dp_m = ["-250 bar", "200 bar"]\n', "ours.toml")
    machine = load_crane(crane(tmp_path, '[active.motor]\ntype = "ours.toml"\n'))
    motor = machine.active.motor
    assert motor.D_loss_min * 2e6 * np.pi == pytest.approx(110.0)
    assert motor.dp_loss_max == pytest.approx(250e5)
    assert motor.n_loss_max == load_losses("A6VM215").motor.n_loss_max
    again = crane_from_toml(crane_toml(machine), "stored")
    assert again.active.motor == motor
