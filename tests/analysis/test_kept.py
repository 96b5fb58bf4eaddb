"""What takes seconds to work out about a crane is kept on disk, and only as long as nothing has changed."""

from pathlib import Path

import pytest

from stillhook.analysis import kept as module
from stillhook.analysis.kept import kept
from stillhook.base.kept import checked
from stillhook.base.kept.checked import Kept, read_checked, write_checked
from stillhook.library import changed, load_crane


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(module, "cache_root", lambda: tmp_path)
    return tmp_path


NO_ANSWERS = ["", "[1.0", "[1.0]", "null", '{"a": 1}', '["x", "y"]']


class Asked:
    """Counts how often an answer is worked out."""

    def __init__(self) -> None:
        self.times = 0

    def __call__(self) -> tuple[float, str]:
        self.times += 1
        return 0.1 + 0.2 * self.times, f"time {self.times}"


def test_the_same_question_is_worked_out_once(folder: Path) -> None:
    crane, asked = load_crane("nov-250t"), Asked()
    answers = [kept(crane, ("v_top", 1.0, 100.0, "ns"), asked) for _ in range(3)]
    assert answers == [answers[0]] * 3
    assert asked.times == 1


def test_another_question_or_another_crane_is_worked_out_anew(folder: Path) -> None:
    crane, asked = load_crane("nov-250t"), Asked()
    stiffer = changed(crane, {"control": {"K_p": "0.2 1/m"}})
    for machine, question in ((crane, 1.0), (crane, 1.0 + 1e-12), (stiffer, 1.0)):
        kept(machine, ("v_top", question), asked)
    assert asked.times == 3


def test_other_code_is_worked_out_anew(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    crane, asked = load_crane("nov-250t"), Asked()
    kept(crane, ("v_top", 1.0), asked)
    monkeypatch.setattr(module, "code", lambda rooms: "other")
    kept(crane, ("v_top", 1.0), asked)
    assert asked.times == 2


@pytest.mark.parametrize("damage", [*NO_ANSWERS, '[0.15, "half of it", "x"]'])
def test_a_damaged_file_costs_time_only_and_is_noted(
    folder: Path, damage: str, caplog: pytest.LogCaptureFixture
) -> None:
    checked._NOTED.discard(Kept.ANSWER)
    crane, asked = load_crane("nov-250t"), Asked()
    kept(crane, ("v_top", 1.0), asked)
    (file,) = (folder / "capacities").iterdir()
    file.write_text(damage)
    assert kept(crane, ("v_top", 1.0), asked) == (0.1 + 0.4, "time 2")
    assert kept(crane, ("v_top", 1.0), asked) == (0.1 + 0.4, "time 2")
    assert len(caplog.records) == 1


@pytest.mark.parametrize("damage", NO_ANSWERS)
def test_what_is_no_answer_is_not_taken_for_one_though_its_checksum_fits(folder: Path, damage: str) -> None:
    crane, asked = load_crane("nov-250t"), Asked()
    kept(crane, ("v_top", 1.0), asked)
    (file,) = (folder / "capacities").iterdir()
    write_checked(file, damage.encode())
    assert kept(crane, ("v_top", 1.0), asked) == (0.1 + 0.4, "time 2")


def test_an_answer_of_a_wheel_holds_where_the_last_digits_of_a_number_differ(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    crane, asked = load_crane("nov-250t"), Asked()
    kept(crane, ("v_top", 1.0), asked)
    (file,) = (folder / "capacities").iterdir()
    shipped = folder / "wheel" / "capacities" / module.shared_name(crane, ("v_top", 1.0))
    write_checked(shipped, read_checked(file, Kept.ANSWER))
    file.unlink()
    monkeypatch.setattr(module, "SHIPPED", folder / "wheel")
    assert kept(crane, ("v_top", 1.0 + 1e-12), asked) == (0.1 + 0.2, "time 1")
    assert asked.times == 1
    kept(crane, ("v_top", 1.0 + 1e-6), asked)
    assert asked.times == 2
