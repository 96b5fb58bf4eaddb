"""Campaigns over years on disk: gathered, measured once, crane files by date, and what can go wrong between them."""

import json
import shutil
from pathlib import Path

import pytest
from tests.live.conditions import DATES, WEAR, campaign, certified, fits, settle, worn

from stillhook import load_crane
from stillhook.base.gateway.named_files import VARIABLE
from stillhook.base.kept import checked
from stillhook.cli import run as command
from stillhook.engine.certificate import objections
from stillhook.errors import LiveError, StillhookError
from stillhook.library.condition import read_state, state_file
from stillhook.live.condition import follow_condition, outputs, save_condition, sources

__all__ = ["fits"]


@pytest.fixture
def root(tmp_path: Path, fits, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A crane that wears, with its campaigns, which name it in a folder next to theirs: one that is given by itself
    needs leave for it."""
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    worn(tmp_path)
    return tmp_path


def told(root: Path, *words: str, code: int, capsys: pytest.CaptureFixture[str]) -> str:
    assert command(["condition", *words, "--out", str(root / "out"), "--verbose"]) == code
    return capsys.readouterr().out


@pytest.mark.long
def test_a_worn_crane_is_withdrawn_and_the_command_says_no(root: Path, capsys: pytest.CaptureFixture[str]):
    out = told(root, str(root), code=1, capsys=capsys)
    assert "NOT valid for planning since the campaign of 2027-09-17: friction of the winch +" in " ".join(out.split())
    assert "withdrawn" in objections(load_crane(root / "certified" / "crane.toml"))[0]


@pytest.mark.long
def test_json_has_numbers_cranes_and_the_state(root: Path, capsys: pytest.CaptureFixture[str]):
    said = json.loads(told(root, str(root), "--json", code=1, capsys=capsys))
    friction = said["numbers"]["friction"]
    assert friction["dates"] == list(DATES)
    assert friction["since_certificate"]["shown"] is True
    assert friction["today"]["low"] < WEAR[-1] < friction["today"]["high"]
    assert said["valid"] is False
    assert [c["file"] for c in said["cranes"]] == [f"crane-{d}.toml" for d in DATES]
    assert set(said["not_followed"]) == {"leakage", "gas", "capacitance", "inertia"}
    assert json.loads((root / "out" / "condition.json").read_text()) == said


@pytest.mark.long
def test_a_crane_that_stays_as_it_is_stays_valid(tmp_path: Path, fits, capsys: pytest.CaptureFixture[str]):
    worn(tmp_path, (0.0, 0.01, -0.01, 0.005))
    out = told(tmp_path, str(tmp_path), code=0, capsys=capsys)
    assert f"Valid for planning by the campaigns until {DATES[3]}" in " ".join(out.split())
    assert "cannot tell" in out


@pytest.mark.long
def test_a_later_run_computes_nothing_that_is_known_and_writes_the_same(root: Path, fits):
    def everything() -> dict[str, bytes]:
        return {str(p): p.read_bytes() for p in sorted(root.rglob("*")) if p.is_file()}

    for _ in range(2):
        save_condition(follow_condition([root], root / "out"), root / "out")
        calls, content = len(fits.calls), everything()
        assert fits.fitted == len(DATES)
    assert calls == len(fits.calls)
    save_condition(follow_condition([root], root / "out"), root / "out")
    assert everything() == content


@pytest.mark.long
@pytest.mark.parametrize("moment", range(1, 11))
def test_a_run_that_is_killed_between_two_writes_is_completed_by_the_next(
    root: Path, fits, monkeypatch: pytest.MonkeyPatch, moment: int
):
    """Every file appears whole; what was measured is not measured again."""
    from stillhook.base import atomic

    written, replace_ = 0, atomic.os.replace

    def dies(a, b):
        nonlocal written
        written += 1
        if written == moment * 2:
            raise KeyboardInterrupt
        replace_(a, b)

    with monkeypatch.context() as patch:
        patch.setattr(atomic.os, "replace", dies)
        with pytest.raises(KeyboardInterrupt):
            save_condition(follow_condition([root], root / "out"), root / "out")
    known = len(list((root / "out").glob("campaigns/*.json")))
    before = fits.fitted
    save_condition(follow_condition([root], root / "out"), root / "out")
    assert fits.fitted - before <= len(DATES) - known
    assert (root / "out" / "condition.json").is_file()
    assert not [p for p in (root / "out").rglob(".*") if p.is_file()]
    assert read_state(state_file(root / "certified" / "crane.toml")).history[-1].state == "withdrawn"


@pytest.mark.long
def test_held_out_tests_never_reach_the_fit_and_judge_both_crane_files(root: Path, fits):
    result = follow_condition([root], root / "out")
    fitted = [tests for steps, tests, _ in fits.calls if 1 in steps]
    judged = [tests for steps, tests, _ in fits.calls if 2 in steps]
    assert fitted == [["a", "c"]] * len(DATES)
    assert set(map(tuple, judged)) == {("b",)}
    last = result.cranes[-1]
    assert last.after["2b"] < last.before["2b"]
    assert last.after["3"] == last.before["3"]  # the controller alone: friction does not reach it


@pytest.mark.long
def test_a_crane_file_of_a_date_has_what_was_known_then_with_its_source(root: Path):
    save_condition(follow_condition([root], root / "out"), root / "out")
    first, last = (load_crane(root / "out" / f"crane-{d}.toml") for d in (DATES[0], DATES[-1]))
    of = load_crane(root / "certified" / "crane.toml")
    assert last.certified is None
    assert first.friction.system.Y_5 == pytest.approx(of.friction.system.Y_5, rel=0.02)
    assert last.friction.system.Y_5 / of.friction.system.Y_5 == pytest.approx(1.0 + WEAR[-1], abs=0.03)
    assert last.active.motor.loss.X_4 / of.active.motor.loss.X_4 == pytest.approx(1.0 + WEAR[-1], abs=0.03)
    source = last.sources["friction.system.Y_5"]
    assert source.kind.value == "fitted"
    assert f"followed through {len(DATES)} campaigns until {DATES[-1]}" in source.text
    assert last.active.C_leak == of.active.C_leak


@pytest.mark.long
def test_campaigns_in_any_order_say_the_same(root: Path):
    files = [root / d / "campaign.toml" for d in DATES]
    assert (
        outputs.to_dict(follow_condition(files))["numbers"] == outputs.to_dict(follow_condition(files[::-1]))["numbers"]
    )


@pytest.mark.long
def test_a_folder_that_is_given_allows_its_campaigns_to_name_files_in_it(root: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv(VARIABLE)
    assert not follow_condition([root]).gathered.refused
    with pytest.raises(StillhookError, match=r"leads out of the folder of this file.*STILLHOOK_FILES="):
        follow_condition([root / DATES[0] / "campaign.toml"])


def test_nothing_is_written_without_a_folder(root: Path, capsys: pytest.CaptureFixture[str]):
    before = sorted(root.rglob("*"))
    assert command(["condition", str(root)]) == 1
    capsys.readouterr()
    assert sorted(root.rglob("*")) == before


@pytest.mark.long
def test_two_campaigns_of_one_date_count_both(root: Path):
    campaign(root / "again", DATES[-1], 0.39, mark="other")
    result = follow_condition([root], root / "out")
    assert len(result.numbers[0].dates) == len(DATES) + 1
    assert len(result.cranes) == len(DATES)


def refused(root: Path, *files: Path) -> str:
    with pytest.raises(StillhookError) as caught:
        follow_condition([root / DATES[0] / "campaign.toml", *files], root / "out")
    line = str(caught.value)
    assert "\n" not in line
    return line


def test_a_campaign_without_a_date_is_refused(root: Path):
    file = campaign(root / "new", "2028-01-01", 0.1)
    file.write_text(file.read_text().replace("date = 2028-01-01\n", ""))
    assert "date" in refused(root, file)


def test_logs_that_were_counted_already_are_refused(root: Path):
    shutil.copytree(root / DATES[0], root / "copy")
    file = root / "copy" / "campaign.toml"
    file.write_text(file.read_text().replace(DATES[0], "2027-01-01"))
    assert "its logs are those of" in refused(root, file)


@pytest.mark.parametrize("other", ["nov-150t", "nov-100t-electric"])
def test_another_crane_or_winch_is_refused_by_name(root: Path, other: str):
    line = refused(root, campaign(root / "other", "2028-01-01", 0.1, crane=other))
    assert f'crane "{other}"' in line
    assert line.endswith("Follow each crane by itself.")


@pytest.mark.long
def test_a_broken_campaign_in_a_folder_is_named_and_the_others_count(root: Path, capsys: pytest.CaptureFixture[str]):
    broken = campaign(root / "torn", "2028-01-01", 0.1)
    broken.write_text("date = [")
    campaign(root / "foreign", "2028-02-01", 0.1, crane="nov-150t")
    settle(broken.parent)
    said = json.loads(told(root, str(root), "--json", code=1, capsys=capsys))
    assert said["campaigns"] == list(DATES)
    assert [("torn" in line, "foreign" in line) for line in said["refused"]] == [(True, False), (False, True)]


@pytest.mark.long
def test_a_campaign_that_is_still_being_written_is_waited_for(root: Path):
    late = campaign(root / "late", "2028-01-01", 0.4, old=False)
    assert "was written less than 30 s ago" in follow_condition([root]).gathered.waiting[0]
    settle(late.parent)
    (late.parent / "b.csv").unlink()
    assert follow_condition([root]).gathered.waiting == (f"{late}: b.csv is not there yet",)
    (late.parent / "b.csv").touch()
    settle(late.parent)
    assert follow_condition([root]).gathered.waiting == (f"{late}: b.csv is empty",)
    (late.parent / "b.csv").write_text("Time [s],Tip [m]\n0,9\n")
    settle(late.parent)
    assert len(follow_condition([root]).measured) == len(DATES) + 1


@pytest.mark.long
@pytest.mark.parametrize("how", ["value", "digest", "half", "list"])
def test_evidence_that_was_changed_is_measured_again_with_a_note(root: Path, fits, how: str, caplog):
    checked._NOTED.discard(checked.Kept.CAMPAIGN)
    follow_condition([root], root / "out")
    file = sorted((root / "out" / "campaigns").glob("*.json"))[0]
    text = file.read_text()
    changed = {
        "value": text.replace('"value": 0.0', '"value": 0.2'),
        "digest": text.replace('"digest": "', '"digest": "0'),
        "half": text[:200],
        "list": "[1]",
    }[how]
    assert changed != text
    file.write_text(changed)
    follow_condition([root], root / "out")
    assert fits.fitted == len(DATES) + 1
    assert file.read_text() == text
    (note,) = caplog.records
    assert note.getMessage().endswith(f"{file.name}: damaged ({checked.OTHER}). The campaign is measured again.")


@pytest.mark.long
def test_a_log_that_changes_later_is_measured_again(root: Path, fits):
    follow_condition([root], root / "out")
    log = root / DATES[2] / "a.csv"
    log.write_text(log.read_text() + "0.2,1\n")
    settle(log.parent)
    follow_condition([root], root / "out")
    assert fits.fitted == len(DATES) + 1


@pytest.mark.long
def test_a_stated_repair_begins_a_new_trend_and_a_stated_sensor_is_no_drift(root: Path):
    text = '[[event]]\ndate = 2027-05-01\nwhat = "repair"\nnumbers = ["friction"]\nnote = "bearings"\n'
    (root / "events.toml").write_text(text)
    (number,) = follow_condition([root]).numbers
    assert len(number.course.stated) == 1
    (root / "events.toml").write_text(text.replace("repair", "sensor"))
    (number,) = follow_condition([root]).numbers
    assert {p.period for p in number.course.points} == {0, 1}


@pytest.mark.long
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[[event]]\ndate = 2027-05-01\nwhat = "paint"\nnumbers = ["friction"]', "what"),
        ('[[event]]\ndate = 2027-05-01\nwhat = "repair"\nnumbers = ["colour"]', "no number that is followed"),
        ('[[event]]\ndate = "soon"\nwhat = "repair"\nnumbers = ["friction"]', "date"),
        ('[[event]]\nwhat = "repair"\nnumbers = ["friction"]', "date"),
    ],
    ids=["what", "numbers", "date", "no date"],
)
def test_events_that_say_nothing_are_refused(root: Path, text: str, said: str):
    (root / "events.toml").write_text(text)
    with pytest.raises(StillhookError) as caught:
        follow_condition([root])
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_folder_that_is_not_there_is_refused(root: Path):
    with pytest.raises(LiveError, match="no such campaign file or folder"):
        follow_condition([root / "nowhere"])
    (root / "empty").mkdir()
    with pytest.raises(LiveError, match="no campaign to read"):
        follow_condition([root / "empty"])


@pytest.mark.long
def test_watching_takes_new_campaigns_and_waits_for_a_folder_that_is_away(
    root: Path, fits, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    (root / "watched").mkdir()
    for date in DATES[:2]:
        (root / date).rename(root / "watched" / date)
    for file in (root / "watched").rglob("campaign.toml"):
        file.write_text(file.read_text().replace("../certified", "../../certified"))
        settle(file.parent)
    away = root / "away"
    steps = iter(
        [
            lambda: None,
            lambda: (root / "watched").rename(away),
            lambda: away.rename(root / "watched"),
            lambda: shutil.copytree(root / DATES[2], root / "watched" / DATES[2], copy_function=shutil.copy),
            lambda: settle(root / "watched" / DATES[2]),
        ]
    )

    def sleep(_):
        step = next(steps, None)
        if step is None:
            raise KeyboardInterrupt
        step()
        for file in (root / "watched").rglob(f"{DATES[2]}/campaign.toml"):
            if "../../" not in (text := file.read_text()):
                file.write_text(text.replace("../certified", "../../certified"))

    from stillhook.cli.live import condition as module

    monkeypatch.setattr(module.time, "sleep", sleep)
    assert (
        command(["condition", str(root / "watched"), "--out", str(root / "out"), "--watch", "10 min", "--verbose"])
        == 130
    )
    said = " ".join(capsys.readouterr().out.split())
    assert "not there now" in said
    assert fits.fitted == 3
    assert sources.SETTLED == 30.0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--watch", "10 min"], "it keeps its state in a folder. Give --out FOLDER."),
        (["--watch", "10 min", "--json", "--out", "x"], "--json: prints one answer"),
        (["--watch", "0 s", "--out", "x"], "look at most once a second"),
        (["--watch", "soon", "--out", "x"], "--watch"),
    ],
    ids=["no folder", "json", "too often", "no time"],
)
def test_watching_is_refused_where_it_has_no_meaning(
    root: Path, capsys: pytest.CaptureFixture[str], words: list[str], said: str
):
    assert command(["condition", str(root), *words]) == 2
    assert said in capsys.readouterr().err


def test_a_crane_of_the_library_has_no_state(tmp_path: Path, fits):
    for date, x in zip(DATES, WEAR, strict=True):
        campaign(tmp_path / date, date, x, crane="nov-250t")
    result = follow_condition([tmp_path])
    assert result.standing.state is None
    assert "it has no certificate to withdraw" in result.standing.reason
    assert all(n.drift is None for n in result.numbers)


@pytest.mark.long
def test_campaigns_of_a_later_crane_file_are_measured_against_the_first(root: Path, fits):
    certified(root / "second", "2027-12-01", logs="second")
    campaign(root / "2028", "2028-01-01", 0.4, crane="../second/crane.toml")
    result = follow_condition([root], root / "out")
    assert result.measured[-1].campaign.crane.friction == result.reference.friction
    assert result.standing.file == root / "2028" / "../second/crane.condition.json"
    assert not result.standing.withdrawn


@pytest.mark.long
def test_there_is_a_picture_of_the_courses_and_one_of_the_held_out_tests(root: Path):
    images = outputs.pictures(follow_condition([root / d / "campaign.toml" for d in DATES[:3]]))
    assert set(images) == {outputs.PICTURE, outputs.PICTURE_HELD}
    assert all(data.startswith(b"\x89PNG") for data in images.values())


@pytest.mark.thorough
def test_the_fit_of_real_logs_gives_numbers_a_crane_file_and_held_out_criteria(tmp_path: Path):
    """The example's logs, without anything in place of the fit."""
    from stillhook.library.examples import SEA_TRIALS, example_campaign

    result = follow_condition([example_campaign(SEA_TRIALS, tmp_path / "tests")], tmp_path / "out")
    names = {n.of.name for n in result.numbers}
    assert names == {"friction", "leakage", "capacitance", "inertia"}
    assert "log V_acc" in result.absent["gas"]
    (crane,) = result.cranes
    assert crane.before["2b"] < 0.05
    assert crane.after["2b"] < 0.05
    assert "leakage" in crane.left
