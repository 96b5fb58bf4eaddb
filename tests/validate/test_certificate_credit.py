"""What a plan asks before it credits a certificate: everything of it, and what a forger could try."""

import json
from pathlib import Path

import pytest
from tests.signers import KEY
from tests.validate.staged_certificate import drawn, staged, write

from stillhook import load_crane
from stillhook.base.kept.sealed import canonical, digest_of
from stillhook.engine.certificate import objections, twin_line
from stillhook.errors import ValidateError
from stillhook.kernels.cache import VARIABLE as CACHE
from stillhook.library import crane_from_toml, crane_toml
from stillhook.validate import Certificate, certificate_of, load_certificate
from stillhook.validate.certificate import content as certificate_content
from stillhook.validate.certificate import recheck
from stillhook.validate.certificate.credit import ALONE, checked
from stillhook.validate.criteria.results import StepNumber
from stillhook.validate.report import figures as pictures_of

MADE: dict[str, Certificate] = {}
pytestmark = pytest.mark.slow


@pytest.fixture
def found(monkeypatch, tmp_path) -> dict[str, float]:
    """Measures that the recomputation finds otherwise; "runs": how often it was made."""
    values: dict[str, float] = {}
    runs: list[int] = []

    def validate(campaign, progress=None):
        runs.append(1)
        return staged(campaign, **{name: x for name, x in values.items() if name != "runs"})

    monkeypatch.setattr(pictures_of, "FIGURES", {StepNumber.AHC: (drawn,)})
    monkeypatch.setattr(recheck, "validate", validate)
    monkeypatch.setenv(CACHE, str(tmp_path / "cache"))
    values["runs"] = runs  # type: ignore[assignment]
    return values


@pytest.fixture
def file(found, tmp_path: Path) -> Path:
    """A crane file with its signed certificate of logs that are not synthetic, in a folder beside them."""
    campaign, out = write(tmp_path, synthetic=False), tmp_path / "out"
    if not MADE:
        MADE["real"] = certificate_of(staged(campaign)).signed(KEY)
    return stored(MADE["real"], out)


def stored(made: Certificate, out: Path) -> Path:
    out.mkdir(exist_ok=True)
    (out / "certificate.json").write_text(made.text(), encoding="utf-8")
    (out / "crane.toml").write_text(made.crane_toml(), encoding="utf-8")
    return out / "crane.toml"


def against(file: Path, *, recompute: bool = True) -> tuple[str, ...]:
    return objections(checked(load_crane(file), recompute=recompute))


def test_what_is_signed_there_and_the_same_is_credited_and_recomputed_once(file, found):
    assert against(file, recompute=False) == ()
    assert found["runs"] == []
    assert against(file) == against(file) == ()
    assert len(found["runs"]) == 1


def test_a_recomputation_that_comes_out_otherwise_is_not_credited_and_kept_as_well(file, found):
    found["e_c_pp_deviation"] = 0.31
    for _ in range(2):
        (line,) = against(file)
        assert line.startswith("recomputed from its logs it is another one: 2b: shown -> refuted")
    assert len(found["runs"]) == 1


def test_an_answer_that_is_damaged_or_of_other_code_is_made_again(file, found, tmp_path, monkeypatch):
    assert against(file) == ()
    (kept,) = (tmp_path / "cache" / "certificates").iterdir()
    found["e_c_pp_deviation"] = 0.31
    kept.write_text(kept.read_text(encoding="utf-8")[:-20], encoding="utf-8")
    assert against(file) != ()
    assert len(found["runs"]) == 2
    monkeypatch.setattr(certificate_content, "version", lambda library: "0")  # of a library under it
    against(file)
    assert len(found["runs"]) == 3


@pytest.mark.parametrize(
    ("name", "reason"),
    [("logs/1.csv", "no such file in the folder of campaign.toml"), ("campaign.toml", "no such file")],
)
def test_without_its_logs_or_its_campaign_it_is_not_credited(file, tmp_path, found, name, reason):
    (tmp_path / name).unlink()
    lines = against(file, recompute=False)
    assert lines
    assert all(line.startswith("it cannot be verified: ") for line in lines)
    assert reason in lines[0]
    assert "does not hold: it cannot be verified" in twin_line(checked(load_crane(file), recompute=False))


def test_another_log_or_another_method_is_not_credited(file, tmp_path, found, monkeypatch):
    log = tmp_path / "logs/1.csv"
    log.write_text(log.read_text().replace("0.1,0.1", "0.1,0.9"))
    assert against(file) == ('it cannot be verified: log logs/1.csv of test "1": changed since.',)
    assert found["runs"] == []
    monkeypatch.setattr(certificate_content, "method_hash", lambda: "0123456789abcdef")
    assert "code of the method" in against(file)[-1]


def test_a_record_without_its_certificate_is_trusted_in_runs_and_not_credited_in_a_plan(file):
    crane = crane_from_toml(crane_toml(load_crane(file)), "stored")
    assert objections(crane) == ()
    assert objections(checked(crane, recompute=False)) == (ALONE,)


def test_a_certificate_that_is_exchanged_after_the_crane_was_read_is_noticed(file):
    crane = load_crane(file)
    other = json.loads((file.parent / "certificate.json").read_text(encoding="utf-8"))
    rewrite(file, {**other, "title": "Other"})
    assert "changed since the crane was read" in objections(checked(crane, recompute=False))[0]


def test_what_no_trusted_key_signed_is_not_even_looked_at(file, found):
    stored(MADE["real"].with_signature(None), file.parent)
    (line,) = against(file)
    assert line == "it is unsigned, so that its origin is unknown"
    assert found["runs"] == []


# What a forger could try


def rewrite(file: Path, data: dict) -> None:
    """Contents with a digest that fits."""
    data = {**data, "digest": digest_of(data)}
    (file.parent / "certificate.json").write_text(canonical(data), encoding="utf-8")


@pytest.mark.parametrize(
    "edit",
    [
        lambda d: {**d, "envelope": {**d["envelope"], "load": [1e3, 250e3]}},
        lambda d: {**d, "date": "2026-11-22"},
        lambda d: {**d, "title": "Another trial"},
        lambda d: {**d, "twin": {**d["twin"], "level": 3}},
        lambda d: {**d, "crane": {**d["crane"], "content": {**d["crane"]["content"], "SWL": "0"}}},
    ],
)
def test_an_edit_with_a_digest_that_fits_breaks_the_signature(file, edit):
    """Also of what a crane's record does not hold, as it has the digest of all."""
    data = dict(load_certificate(file.parent / "certificate.json").data)
    rewrite(file, edit(data))
    assert any("the signature does not fit" in line for line in against(file))
    assert twin_line(load_crane(file)).startswith("twin: UNTRUSTED certificate")


def test_a_mark_of_simulated_logs_that_is_erased_does_not_make_them_real(file, tmp_path):
    made = certificate_of(staged(write(tmp_path / "simulated"))).signed(KEY)
    stored(made, file.parent)
    assert "SYNTHETIC" in twin_line(load_crane(file))
    rewrite(file, {**made.data, "synthetic": False})
    assert load_crane(file).certified.mark == "UNTRUSTED"
    rewrite(file, {name: x for name, x in {**made.data, "synthetic": False}.items() if name != "signature"})
    crane = load_crane(file)
    assert crane.certified.mark == "UNTRUSTED"
    assert not crane.certified.real


def test_the_signature_of_another_certificate_fits_none(file, tmp_path):
    other = certificate_of(staged(write(tmp_path / "other", synthetic=False), e_c_max_difference=0.02)).signed(KEY)
    stored(MADE["real"].with_signature(other.data["signature"]), file.parent)
    assert "the signature does not fit" in against(file)[0]


def test_a_crane_file_that_names_the_certificate_of_another_crane_is_not_credited(file, tmp_path):
    other = tmp_path / "out" / "other.toml"
    other.write_text('base = "nov-150t"\nname = "other"\ncertificate = "certificate.json"\n', encoding="utf-8")
    assert any("the crane was changed since in" in line for line in against(other))


@pytest.mark.parametrize(
    "change",
    [
        lambda t: t.replace('"passed": true,', '"passed": false,\n "passed": true,'),  # the last of both is read
        lambda t: t.replace("164000.0", "164000.00000001"),  # below the digits that the digest has
        lambda t: t.replace("164000.0", "1.64e5"),
        lambda t: t.replace("null", "NaN", 1),
        lambda t: t.replace("\n", ""),
        lambda t: t + " ",
    ],
)
def test_the_same_contents_in_another_text_count_as_changed(file, change):
    path = file.parent / "certificate.json"
    text = path.read_text(encoding="utf-8")
    assert change(text) != text
    path.write_text(change(text), encoding="utf-8")
    with pytest.raises(
        ValidateError, match=r"was changed after it was written|is given twice|NaN is not a number"
    ) as problem:
        load_certificate(path)
    assert "\n" not in str(problem.value)


def test_line_ends_of_another_system_are_no_change(file):
    path = file.parent / "certificate.json"
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert against(file) == ()


@pytest.mark.parametrize("signature", [5, {}, {"signer": "x"}, "signed"])
def test_a_damaged_signature_is_refused_in_one_line(file, signature):
    path = file.parent / "certificate.json"
    rewrite(file, {**load_certificate(path).data, "signature": signature})
    with pytest.raises(ValidateError, match=r"not a complete certificate \(.*signature") as problem:
        load_certificate(path).short  # noqa: B018
    assert "\n" not in str(problem.value)


def test_logs_that_say_that_they_are_synthetic_make_a_synthetic_certificate_whatever_the_campaign_says(found, tmp_path):
    campaign = write(tmp_path, synthetic=False)
    campaign.write_text(campaign.read_text().replace("crane =", "synthetic = false\ncrane ="))
    log = tmp_path / "logs" / "2.csv"
    log.write_text(f"# SYNTHETIC: simulated\n{log.read_text()}")
    crane = load_crane(stored(certificate_of(staged(campaign)).signed(KEY), tmp_path / "out"))
    assert crane.certified is not None
    assert crane.certified.synthetic
    assert "SYNTHETIC" in twin_line(crane)
