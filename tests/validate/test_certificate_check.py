"""Whether a certificate still holds: every input that it rests on, changed alone, is named."""

import hashlib
import json
from pathlib import Path

import pytest
from tests.signers import KEY, NAME
from tests.validate.staged_certificate import drawn, staged, write

from stillhook import load_crane
from stillhook.base.kept.sealed import canonical, digest_of
from stillhook.cli import run as command
from stillhook.errors import ValidateError
from stillhook.library import crane_toml
from stillhook.report.document import Text
from stillhook.trust.standing import MEANING, Standing
from stillhook.validate import certificate_files, load_certificate
from stillhook.validate.certificate import content as certificate_content
from stillhook.validate.certificate import recheck as certificate_check
from stillhook.validate.certificate.document import document
from stillhook.validate.certificate.recheck import check
from stillhook.validate.criteria.results import StepNumber
from stillhook.validate.report import figures as pictures_of

FILES: dict[str, bytes] = {}


@pytest.fixture
def found(monkeypatch) -> dict[str, float]:
    """Measures that a later validation finds otherwise."""
    values: dict[str, float] = {}
    monkeypatch.setattr(pictures_of, "FIGURES", {StepNumber.AHC: (drawn,)})
    monkeypatch.setattr(certificate_check, "validate", lambda campaign, progress=None: staged(campaign, **values))
    return values


@pytest.fixture
def file(found, tmp_path: Path) -> Path:
    """A certificate, signed by a trusted key, beside its campaign, of a crane that has a file of its own."""
    (tmp_path / "ours.toml").write_text(crane_toml(load_crane("nov-250t")), encoding="utf-8")
    campaign = write(tmp_path, crane="ours.toml")
    out = tmp_path / "out"
    out.mkdir()
    if not FILES:  # the same bytes in every folder
        FILES.update(certificate_files(staged(campaign), key=KEY))
    for name, content in FILES.items():
        (out / name).write_bytes(content)
    return out / "certificate.json"


DELAY = 'delay = "40 ms"'
K_P = 'K_p = {{ value = "{} 1/m"'


def checked(file: Path, **how):
    return check(file, load_certificate(file), **how)


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


@pytest.mark.thorough
def test_it_holds_while_nothing_has_changed_and_comes_out_the_same_to_the_byte(file):
    found = checked(file)
    assert found.holds
    assert found.same_bytes
    assert found.same_pdf is True
    assert checked(file, quick=True).holds


@pytest.mark.long
def test_it_holds_wherever_the_whole_folder_is_moved(file, tmp_path):
    moved = tmp_path.parent / f"{tmp_path.name}-moved"
    tmp_path.rename(moved)
    found = checked(moved / "out" / "certificate.json")
    assert found.holds
    assert found.same_bytes


@pytest.mark.slow
def test_it_holds_alone_where_the_campaign_is_named(file, tmp_path):
    alone = tmp_path / "far" / "away"
    alone.mkdir(parents=True)
    copy = alone / "certificate.json"
    copy.write_bytes(file.read_bytes())
    assert checked(copy).missing[0].endswith("State it with --campaign.")
    found = checked(copy, campaign=tmp_path / "campaign.toml")
    assert found.holds
    assert found.same_bytes
    assert found.same_pdf is None


@pytest.mark.slow
def test_it_finds_its_campaign_by_its_hash_in_a_folder_beside_its_own(file, tmp_path):
    trial, other = tmp_path.parent / f"{tmp_path.name}-trial", tmp_path / "certified"
    other.mkdir()
    (tmp_path / "another").mkdir()
    (tmp_path / "another" / "campaign.toml").write_text("title = 'another'", encoding="utf-8")
    (other / "certificate.json").write_bytes(file.read_bytes())
    trial.mkdir()
    for name in ("campaign.toml", "logs", "ours.toml"):
        (tmp_path / name).rename(trial / name)
    trial.rename(tmp_path / "trial")
    found = checked(other / "certificate.json")
    assert found.holds
    assert found.same_bytes


@pytest.mark.thorough
@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize(
    ("name", "old", "new", "told"),
    [
        ("logs/2.csv", "0.1,0.2", "0.1,0.3", 'log logs/2.csv of test "2": changed since.'),
        ("campaign.toml", "Sea trial", "Sea trial, day 2", "campaign campaign.toml: changed since."),
        ("campaign.toml", 'name = "2"', 'name = "two"', 'test "2": not in the campaign any more.'),
        ("campaign.toml", '"logs/1.csv"', '"logs/2.csv"', "campaign campaign.toml: changed since."),  # and refused
        (
            "campaign.toml",
            DELAY,
            f'{DELAY}\ncriteria = "own.toml"',
            "criteria: own version 2 now, and not what paper-f",
        ),
        ("ours.toml", K_P.format(0.16), K_P.format(0.2), "crane ours: changed since: control.K_p 0.16 1/m -> 0.2 1/m."),
    ],
)
def test_an_input_that_has_changed_is_named(file, tmp_path, name, old, new, told, quick):
    (tmp_path / "own.toml").write_text('base = "paper-f"\nversion = "2"\n[settings]\nwindow = "20 s"\n')
    edit(tmp_path / "ours.toml", 'name = "nov-250t"', 'name = "ours"')
    edit(tmp_path / name, old, new)
    found = checked(file, quick=quick)
    assert not found.holds
    assert any(told in line for line in found.changed), found.changed
    assert all("\n" not in line for line in found.changed)


@pytest.mark.slow
def test_names_titles_and_sources_of_the_crane_are_no_change_of_it(file, tmp_path):
    edit(tmp_path / "ours.toml", 'title = "250 t', 'title = "Our 250 t')
    edit(tmp_path / "ours.toml", 'source = "paper E abstract"', 'source = "our plate"')
    assert checked(file, quick=True).holds


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("what", "told"), [("results_hash", "code of the twin"), ("method_hash", "code of the method")]
)
def test_other_code_is_named(file, monkeypatch, what, told):
    monkeypatch.setattr(certificate_content, what, lambda: "0123456789abcdef")
    found = checked(file)
    assert not found.holds
    assert found.changed[0].startswith(f"{told}: ")
    assert "verdict lines are the same" in found.verdict


@pytest.mark.thorough
def test_a_verdict_line_that_comes_out_otherwise_is_named(file, found):
    found["e_c_pp_deviation"] = 0.31
    again = checked(file)
    assert not again.holds
    assert [line.split(":")[0] for line in again.lines] == ["2b"]
    assert "shown -> refuted" in again.lines[0]


def forged(file: Path, **envelope) -> dict:
    """The certificate with other ends of its envelope, and the digest of that."""
    data = json.loads(file.read_text(encoding="utf-8"))
    data.pop("digest")
    data["envelope"] |= envelope
    data["digest"] = digest_of(data)
    file.write_text(canonical(data), encoding="utf-8")
    return data


def unsigned(file: Path) -> dict:
    """The certificate without its signature."""
    made = load_certificate(file).with_signature(None)
    file.write_text(made.text(), encoding="utf-8")
    return made.data


@pytest.mark.long
@pytest.mark.parametrize(
    ("envelope", "told"),
    [
        ({"load": [82e3, 200e3]}, "envelope, load: 82000 to 200000 -> 82000 to 164000"),
        ({"modes": ["hs", "ns", "ssc"]}, "envelope, modes: hs, ns, ssc -> ns, ssc"),
    ],
)
def test_an_envelope_that_was_widened_is_named_even_where_the_digest_was_made_anew(file, envelope, told):
    forged(file, **envelope)
    again = checked(file)
    assert (again.holds, again.lines) == (False, (told,))


@pytest.mark.thorough
def test_numbers_that_differ_below_any_limit_leave_it_standing_and_are_told(file, found):
    found["e_c_pp_deviation"] = 0.021 * (1.0 + 1e-7)
    again = checked(file)
    assert again.holds
    assert not again.same_bytes
    assert again.largest == pytest.approx(1e-7, rel=0.2)


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["logs/1.csv", "ours.toml", "campaign.toml"])
def test_what_it_rests_on_and_is_not_there_is_named(file, tmp_path, name):
    (tmp_path / name).unlink()
    found = checked(file)
    assert not found.holds
    assert name.rpartition("/")[2] in found.missing[0]


@pytest.mark.long
def test_a_validation_that_was_not_passed_holds_nothing(found, tmp_path):
    campaign = write(tmp_path)
    files = certificate_files(staged(campaign, e_c_pp_deviation=0.31))
    (tmp_path / "not-passed.json").write_bytes(files["not-passed.json"])
    found["e_c_pp_deviation"] = 0.31
    assert checked(tmp_path / "not-passed.json").verdict.startswith("NOT VALID: the validation was not passed")


# The command line


@pytest.mark.thorough
def test_check_answers_by_its_exit_code(file, tmp_path, capsys):
    assert command(["certificate", "--check", str(file), "--verbose"]) == 0
    out = capsys.readouterr().out
    assert f"\nVALID: signed by {NAME}" in out
    assert "Recomputed from the logs: identical to the byte." in out
    assert "PDF in the same folder: the same to the byte" in out
    edit(tmp_path / "logs/1.csv", "0.1,0.1", "0.1,0.9")
    assert command(["certificate", "--check", str(file), "--quick", "--verbose"]) == 1
    assert 'changed: log logs/1.csv of test "1": changed since.' in capsys.readouterr().out
    assert command(["certificate", "--check", str(file), "--quick", "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["holds"] is False
    edit(file, '"passed": true', '"passed": false')
    assert command(["certificate", "--check", str(file)]) == 2
    assert "was changed after it was written" in capsys.readouterr().err
    assert command(["certificate", "--check", str(tmp_path / "logs/1.csv")]) == 2


@pytest.mark.slow
def test_show_says_the_verdict_and_the_envelope(file, tmp_path, capsys):
    assert command(["certificate", str(file), "--verbose"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("SYNTHETIC Sea trial\nPASSED: ")
    assert "82 t to 164 t" in out
    assert "Level 2, variant 2" in out
    assert command(["certificate", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["envelope"]["load"] == [82e3, 164e3]
    assert command(["certificate", str(tmp_path / "nothing.json")]) == 2
    assert "no such file" in capsys.readouterr().err


@pytest.mark.thorough
def test_an_envelope_that_was_widened_with_a_new_digest_is_valid_nowhere(file, capsys):
    """The digest fits, the signature does not; without a signature nobody vouches for it."""
    data = forged(file, load=[1e3, 250e3])
    for how in ("signature does not fit", "unsigned"):
        if how == "unsigned":
            data = unsigned(file)
        assert command(["certificate", str(file), "--verbose"]) == 0
        assert how in " ".join(capsys.readouterr().out.split())
        assert command(["certificate", "--check", str(file), "--quick", "--verbose"]) == 1
        out = " ".join(capsys.readouterr().out.split())
        assert "NOT VALID: " in out
        assert how in out
        assert command(["certificate", "--check", str(file), "--json"]) == 1
        told = json.loads(capsys.readouterr().out)
        assert told["signature"]["standing"] == how
        assert told["lines"] == ["envelope, load: 1000 to 250000 -> 82000 to 164000"]
        assert Text(MEANING) in document(data).section("How to check this document").parts


@pytest.mark.slow
def test_the_annex_is_covered_by_the_certificate(file):
    """The steps, numbers and crane file are in the annex: another one next to the certificate does not go unseen."""
    data = json.loads(file.read_text(encoding="utf-8"))
    annex = file.parent / data["annex"]["file"]
    assert annex.name == "certificate-annex.pdf"
    assert hashlib.sha256(annex.read_bytes()).hexdigest() == data["annex"]["sha256"]
    assert checked(file, quick=True).holds
    annex.write_bytes(annex.read_bytes() + b"%")
    for quick in (True, False):
        found = checked(file, quick=quick)
        assert not found.holds
        assert any("annex certificate-annex.pdf: changed since" in line for line in found.changed)
    annex.unlink()  # kept elsewhere
    assert checked(file, quick=True).holds


@pytest.mark.slow
@pytest.mark.parametrize("name", ["/etc/passwd", "../campaign.toml", "//host/share/campaign.toml"])
def test_a_certificate_names_its_campaign_by_a_name_alone(file, name):
    """Whoever wrote the file could have any other one opened."""
    data = json.loads(file.read_text(encoding="utf-8"))
    data["campaign"]["file"] = name
    data["digest"] = digest_of(data)
    file.write_text(canonical(data), encoding="utf-8")
    with pytest.raises(ValidateError, match="not the name of a file"):
        checked(file, quick=True)
    assert (
        checked(file, campaign=file.parent.parent / "campaign.toml", quick=True).judgement.standing is Standing.ALTERED
    )
