"""The state beside a crane file: read by whoever reads the crane, noticed where it was changed, given back by a certificate."""

import json
from contextlib import closing
from pathlib import Path
from shutil import copytree, ignore_patterns

import pytest
from tests.commands import run as command
from tests.live.conditions import DATES, campaign, certified, fits, fits_in, worn
from tests.signers import KEY, trusted, with_key

from stillhook import load_crane, load_run, save_run, simulate
from stillhook.base.gateway.named_files import VARIABLE
from stillhook.base.kept.sealed import digest_of, sealed
from stillhook.engine.certificate import objections, twin_line
from stillhook.errors import LiveError, SpecError
from stillhook.library.condition import read_state, state_file
from stillhook.live.condition import follow_condition, save_condition
from stillhook.live.condition.outputs import to_dict
from stillhook.live.history.journal import lock
from stillhook.plan.definition.lift_plan import Alternative
from stillhook.plan.table import _against
from stillhook.trust.comparison import compare
from stillhook.trust.home import VARIABLE as SETTINGS
from stillhook.trust.keys import new_key
from stillhook.trust.signature import Signed, sign
from stillhook.trust.standing import Standing as Signature
from stillhook.trust.trust_list import users_trust

__all__ = ["fits"]


@pytest.fixture(scope="module")
def followed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a crane whose friction has drifted since its certificate, and of its campaigns."""
    root = tmp_path_factory.mktemp("followed")
    with pytest.MonkeyPatch.context() as patch:
        fits_in(patch)
        patch.setenv(VARIABLE, str(root))
        files = worn(root)
        for until in (2, len(files)):
            save_condition(follow_condition(files[:until], root / "out"), root / "out")
    return root


@pytest.fixture(autouse=True)
def allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Campaigns name a crane in a folder next to theirs."""
    monkeypatch.setenv(VARIABLE, str(tmp_path))


@pytest.fixture
def crane(tmp_path: Path, followed: Path, fits) -> Path:
    """A copy of its crane file, with everything beside it."""
    copytree(followed, tmp_path, dirs_exist_ok=True)
    return tmp_path / "certified" / "crane.toml"


@pytest.mark.long
def test_a_withdrawn_validity_is_an_objection_to_the_certificate(crane: Path):
    of = load_crane(crane)
    (reason,) = objections(of)
    assert reason.startswith("validity for planning withdrawn by the campaign of 2027-0")
    assert "friction of the winch +" in reason
    assert reason in twin_line(of)
    assert of.certified.condition is not None
    assert not of.certified.condition.valid


@pytest.mark.long
def test_a_plan_credits_a_withdrawn_crane_as_one_whose_certificate_does_not_hold(crane: Path):
    from types import SimpleNamespace

    plan = SimpleNamespace(crane=load_crane(crane), credits_synthetic=False, sensors=None)
    (line,) = _against(plan, Alternative("ssc"))
    assert line.startswith("certificate does not hold: validity for planning withdrawn by the campaign of 2027-")


def test_the_plans_facts_have_the_state_and_its_reason(crane: Path, tmp_path: Path):
    from stillhook.plan.answer.metadata import _crane

    condition = _crane(load_crane(crane), False)["certificate"]["condition"]
    assert condition["valid"] is False
    assert condition["text"] in _crane(load_crane(crane), False)["twin"]
    good = certified(tmp_path / "other")
    assert _crane(load_crane(good), False)["certificate"]["condition"] is None


def test_a_valid_state_changes_nothing_but_says_until_when(tmp_path: Path, fits):
    files = worn(tmp_path, (0.0, 0.01, -0.01))
    save_condition(follow_condition(files, tmp_path / "out"), tmp_path / "out")
    of = load_crane(tmp_path / "certified" / "crane.toml")
    assert objections(of) == ()
    assert of.certified.condition.statement == f"valid for planning by the campaigns until {DATES[2]}"


@pytest.mark.long
def test_a_stored_run_keeps_the_state_that_it_was_made_under(crane: Path, tmp_path: Path):
    of = load_crane(crane)
    from stillhook import Scenario

    run = simulate(of, Scenario(load="100 t", s_w="100 m", duration="2 s", warm_up="0.5 s"))
    save_run(run, tmp_path / "run.nc")
    assert "withdrawn" in str(load_run(tmp_path / "run.nc").attrs)


def of_manifest(data: dict) -> dict[str, str]:
    """A signature over the same digest, as of a manifest."""
    return sign(Signed.MANIFEST, digest_of(data), KEY).to_dict()


def broken(text: str) -> dict[str, str]:
    """A state's text, changed in many ways."""
    data = json.loads(text)
    valid = {**data, "history": [{**data["history"][-1], "state": "valid"}]}
    alone = {**data, "history": data["history"][:1]}
    dropped = {**data, "history": data["history"][1:]}
    dates = {**data, "history": [{**data["history"][0], "date": "soon"}]}
    return {
        "said to be valid": json.dumps(valid),
        "last entry cut off": json.dumps(alone),
        "first entry cut off, with a new digest": sealed(dropped),
        "date that is none, with a new digest": sealed(dates),
        "no history": sealed({**data, "history": []}),
        "with half a signature": sealed({**data, "signature": {"signer": "Rig team"}}),
        "with the signature of another": sealed({**data, "signature": sign(Signed.CONDITION, "0" * 64, KEY).to_dict()}),
        "with one of another kind": sealed({**data, "signature": of_manifest(data)}),
        "half of it": text[: len(text) // 2],
        "empty": "",
        "a list": "[]",
        "another format": text.replace("condition 1", "condition 2"),
        "deep": "[" * 100_000,
        "no numbers": text.replace('"history"', '"histories"'),
        "not text": "\x00\x01",
    }


@pytest.mark.long
@pytest.mark.parametrize("how", list(broken('{"history": [{}]}')))
def test_a_state_that_was_changed_is_refused_in_one_line(crane: Path, how: str):
    file = state_file(crane)
    file.write_text(broken(file.read_text())[how])
    with pytest.raises(SpecError) as caught:
        load_crane(crane)
    line = str(caught.value)
    assert "\n" not in line
    assert line.startswith('crane.toml: certificate = "certificate.json": crane.condition.json: ')
    assert line.endswith("Restore the file that stillhook condition wrote, or validate again into another folder.")


@pytest.fixture
def own_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The user has a key, in settings of his own."""
    monkeypatch.setenv(SETTINGS, str(tmp_path / "settings"))
    trusted()
    with_key()


def test_a_state_is_signed_afterwards_and_an_edit_of_a_signed_one_is_refused(
    crane: Path, own_key: None, capsys: pytest.CaptureFixture[str]
):
    file = state_file(crane)
    assert load_crane(crane).certified.condition.judgement.standing is Signature.UNSIGNED
    assert command(["certificate", "sign", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["signature"]["standing"] == "signed and trusted"
    once = file.read_bytes()
    assert command(["certificate", "sign", str(file)]) == 0
    capsys.readouterr()
    assert file.read_bytes() == once
    assert load_crane(crane).certified.condition.judgement.trusted
    data = json.loads(once)
    data["checked"] = "2027-12-31"
    file.write_text(sealed(data))
    with pytest.raises(SpecError, match="history or signature does not fit"):
        load_crane(crane)


@pytest.mark.long
def test_state_and_folder_are_signed_as_they_are_written_and_by_nobody_for_another(
    tmp_path: Path, fits, own_key: None, caplog: pytest.LogCaptureFixture
):
    files, out = worn(tmp_path, (0.0, 0.01, -0.01)), tmp_path / "out"
    file = state_file(tmp_path / "certified" / "crane.toml")
    for until in (1, 2):
        save_condition(follow_condition(files[:until], out), out)
        assert read_state(file).judged(users_trust()).trusted
    result = compare(out, users_trust())
    evidence = {f"campaigns/{path.name}" for path in (out / "campaigns").iterdir()}
    assert result.holds
    assert not result.added
    assert len(evidence) == 2
    assert evidence | {"report.html", "condition.json"} < {*result.manifest.parts}
    next((out / "campaigns").iterdir()).write_text("{}")
    assert compare(out, users_trust()).changed

    with_key(new_key("Somebody"))
    save_condition(follow_condition(files, out), out)
    assert read_state(file).signature is None
    assert f"{file}: not signed, as what it was before is not signed by Somebody." in caplog.text


def test_a_changed_state_is_not_written_over(crane: Path, tmp_path: Path):
    file = state_file(crane)
    file.write_text(file.read_text().replace("withdrawn", "valid"))
    with pytest.raises(SpecError, match="was changed after it was written"):
        follow_condition([tmp_path / DATES[-1] / "campaign.toml"], tmp_path / "out")


@pytest.mark.long
@pytest.mark.parametrize("how", ["holds it", "has written it"])
def test_of_two_processes_that_write_one_state_the_second_is_refused_and_no_entry_is_lost(
    crane: Path, tmp_path: Path, how: str, capsys: pytest.CaptureFixture[str]
):
    file = state_file(crane)
    late = campaign(tmp_path / "2027-11-01", "2027-11-01", 0.45)
    first, second = (follow_condition([late], tmp_path / "out") for _ in range(2))
    if how == "holds it":
        with closing(lock(file.parent, "crane.condition.lock")):
            with pytest.raises(LiveError, match="another process writes it, or has since it was read") as problem:
                save_condition(second, tmp_path / "out")
            before = file.read_bytes()
            assert command(["condition", str(late), "--out", str(tmp_path / "out")]) == 2
            assert "Run stillhook condition again." in capsys.readouterr().err
    else:
        save_condition(first, tmp_path / "out")
        before = file.read_bytes()
        with pytest.raises(LiveError, match="another process writes it, or has since it was read") as problem:
            save_condition(second, tmp_path / "other")
    assert "\n" not in str(problem.value)
    assert file.read_bytes() == before
    save_condition(follow_condition([late], tmp_path / "out"), tmp_path / "out")
    assert read_state(file).checked == "2027-11-01"


@pytest.mark.long
def test_the_answer_says_which_line_the_crane_file_lacks_until_it_has_it(crane: Path, tmp_path: Path):
    line = 'condition = "crane.condition.json"'
    copy = tmp_path / "copy"
    copytree(crane.parent, copy, ignore=ignore_patterns("*.condition.*"))
    assert load_crane(copy / "crane.toml").certified.condition is None  # the withdrawal is forgotten

    def answer() -> str:
        return to_dict(follow_condition([tmp_path / DATES[-1] / "campaign.toml"], tmp_path / "out"))["statement"]

    assert f"Add {line} as the first line of crane.toml" in answer()
    crane.write_text(f"{line}\n{crane.read_text()}")
    assert "Add" not in answer()
    copy.joinpath("crane.toml").write_text(crane.read_text())
    with pytest.raises(SpecError, match="no such file, and the crane file names it"):
        load_crane(copy / "crane.toml")


def test_a_crane_that_names_its_state_is_refused_without_it(crane: Path):
    crane.write_text('condition = "crane.condition.json"\n' + crane.read_text())
    load_crane(crane)
    state_file(crane).unlink()
    with pytest.raises(SpecError, match="no such file, and the crane file names it"):
        load_crane(crane)


def test_a_state_without_a_certificate_is_refused(tmp_path: Path):
    file = tmp_path / "my.toml"
    file.write_text('base = "nov-250t"\ncondition = "my.condition.json"\n')
    with pytest.raises(SpecError, match="condition: it belongs to a certificate"):
        load_crane(file)


@pytest.mark.long
@pytest.mark.parametrize(
    ("date", "logs", "said"),
    [
        ("2026-11-21", "", "friction of the winch"),
        ("2027-03-01", "other", "is of 2027-03-01, not later than the campaign that showed the drift"),
        ("2028-01-01", "seen", "rests on logs from before"),
    ],
    ids=["same", "older", "same logs"],
)
def test_no_certificate_but_a_later_one_of_new_logs_gives_validity_back(
    crane: Path, tmp_path: Path, date: str, logs: str, said: str
):
    file = state_file(crane)
    certified(crane.parent, date, logs=logs)
    if logs == "seen":  # the withdrawal knows these logs
        data = json.loads(file.read_text())
        certificate = json.loads((crane.parent / "certificate.json").read_text())
        last = data["history"][-1]
        last["logs"] = [*last["logs"], *(log["sha256"] for log in certificate["campaign"]["logs"])]
        file.write_text(sealed(data))
    (reason,) = objections(load_crane(crane))
    assert "withdrawn" in reason
    assert said in reason


@pytest.mark.long
def test_a_later_certificate_of_new_logs_gives_validity_back_and_the_history_says_so(crane: Path, tmp_path: Path):
    certified(crane.parent, "2027-12-01", logs="new")
    assert objections(load_crane(crane)) == ()
    late = campaign(tmp_path / "2028-02-01", "2028-02-01", 0.2)
    result = follow_condition([*(tmp_path / d / "campaign.toml" for d in DATES), late], tmp_path / "out")
    save_condition(result, tmp_path / "out")
    states = [entry.state for entry in result.standing.state.history]
    assert states == ["valid", "withdrawn", "valid"]
    assert "given back by certificate" in result.standing.entry.reason
    assert objections(load_crane(crane)) == ()


def test_an_entry_says_who_when_and_by_which_hashes(crane: Path):
    first, entry = json.loads(state_file(crane).read_text())["history"]
    assert first["state"] == "valid"
    assert entry["previous"] is not None
    assert " on " in entry["who"]
    assert entry["when"].endswith("+00:00")
    assert entry["certificate"] == load_crane(crane).certified.digest
    assert len(entry["logs"]) == 3 * len(DATES)
