"""The commands for keys and signing, from a new key to a certificate that is valid, and back by a revocation."""

import json
from pathlib import Path

import pytest
from tests.commands import answer, refusal
from tests.signers import KEY
from tests.validate.staged_certificate import staged, write

from stillhook.cli import run
from stillhook.report.document import Table
from stillhook.report.formatting import groups
from stillhook.report.pdf import pages
from stillhook.trust.home import VARIABLE
from stillhook.trust.keys import PASSPHRASE
from stillhook.validate import certificate_of, load_certificate
from stillhook.validate.certificate.document import document

pytestmark = pytest.mark.slow
NAME = "Sea trials"


@pytest.fixture
def home(tmp_path: Path, monkeypatch) -> Path:
    """A user without key and trust list."""
    monkeypatch.setenv(VARIABLE, str(tmp_path / "home"))
    monkeypatch.delenv(PASSPHRASE, raising=False)
    return tmp_path / "home"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A certificate that nobody signed, beside its campaign."""
    path = tmp_path / "certificate.json"
    path.write_text(certificate_of(staged(write(tmp_path, synthetic=False))).text(), encoding="utf-8")
    return path


def standing(capsys, file: Path, code: int) -> str:
    return answer(capsys, "certificate", str(file), "--check", "--quick", code=code)["signature"]["standing"]


def test_from_a_new_key_to_a_valid_certificate_and_its_revocation(home, file, capsys):
    public = str(home / "public.pem")
    assert standing(capsys, file, 1) == "unsigned"
    made = answer(capsys, "certificate", "key", "new", "--name", NAME)
    assert not made["encrypted"]
    assert answer(capsys, "certificate", "key", "show")["key"] == made["key"]
    answer(capsys, "certificate", "sign", str(file))
    assert standing(capsys, file, 1) == "unknown key"
    answer(capsys, "certificate", "key", "trust", public, "--from", "9998-01-01")
    assert standing(capsys, file, 1) == "not yet valid"
    answer(capsys, "certificate", "key", "trust", public, "--until", "2020-01-01")
    assert standing(capsys, file, 1) == "expired"
    answer(capsys, "certificate", "key", "trust", public)
    assert standing(capsys, file, 0) == "signed and trusted"
    (row,) = answer(capsys, "certificate", "key", "show")["trusted"]
    assert (row["name"], row["key"]) == (NAME, made["key"])
    answer(capsys, "certificate", "key", "trust", public, "--revoke", "laptop stolen")
    assert standing(capsys, file, 1) == "revoked"
    assert "was revoked on" in refusal(capsys, "certificate", "key", "trust", public)


def test_signing_twice_gives_the_same_bytes_and_the_document_names_signer_and_key(home, file, capsys):
    run(["certificate", "key", "new", "--name", NAME])
    number = load_certificate(file).digest
    for _ in range(2):
        assert run(["certificate", "sign", str(file)]) == 0
        text = file.read_bytes()
    assert run(["certificate", "sign", str(file)]) == 0
    assert file.read_bytes() == text
    made = load_certificate(file)
    assert made.digest == number
    rows = [row for part in document(made.data).parts if isinstance(part, Table) for row in part.rows]
    assert [text for name, text in (row[:2] for row in rows if len(row) > 1) if name == "signed by"] == [
        f"{NAME}, key id {groups(made.data['signature']['key'])}"
    ] * 2
    assert len(pages(document(made.data), 20.0)) <= 12


def test_an_encrypted_key_signs_with_its_passphrase_alone(home, file, capsys, monkeypatch):
    monkeypatch.setenv(PASSPHRASE, "a secret")
    assert answer(capsys, "certificate", "key", "new", "--name", NAME)["encrypted"]
    assert "ENCRYPTED" in (home / "key.pem").read_text(encoding="utf-8")
    answer(capsys, "certificate", "sign", str(file))
    signed = file.read_bytes()
    for word in ("wrong", ""):
        monkeypatch.setenv(PASSPHRASE, word)
        assert "wrong passphrase" in refusal(capsys, "certificate", "sign", str(file))
    assert file.read_bytes() == signed


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("sign FILE", "key.pem"),
        ("sign FILE --key nothing.pem", "no such file"),
        ("key trust nothing.pem", "no such file"),
        ("key trust FILE", "holds more than 0.016384 MB"),
        ("key trust PUBLIC --until tomorrow", 'until "tomorrow": give a day'),
        ("key trust PUBLIC --from 2027-01-02 --until 2027-01-01", "which is before 2027-01-02"),
        ("key trust PUBLIC --revoke x --until 2027-01-01", "has no meaning for a revoked key"),
        ("key new --name ''", "one printable line"),
        ("key show LOG", "not a public key in PEM"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line_and_writes_nothing(home, file, capsys, words, line):
    public = file.parent / "public.pem"
    public.write_text(KEY.public.pem(), encoding="utf-8")
    before = file.read_bytes()
    places = {"LOG": str(file.parent / "logs" / "1.csv"), "FILE": str(file), "PUBLIC": str(public), "''": ""}
    assert line in refusal(capsys, "certificate", *(places.get(word, word) for word in words.split()))
    assert file.read_bytes() == before
    assert not home.exists()


def test_a_trust_list_that_is_damaged_stops_what_would_ask_it(home, file, capsys):
    home.mkdir()
    (home / "trust.toml").write_text("[[key]]\nname = 5\n", encoding="utf-8")
    assert "trust.toml: key 1" in refusal(capsys, "certificate", file, "--check", "--quick")
    assert "trust.toml: key 1" in refusal(capsys, "certificate", file)


def test_a_key_is_never_written_over(home, capsys):
    run(["certificate", "key", "new", "--name", NAME])
    before = (home / "key.pem").read_bytes()
    capsys.readouterr()
    assert "exists, and would be lost" in refusal(capsys, "certificate", "key", "new", "--name", "Other")
    assert (home / "key.pem").read_bytes() == before


def test_the_answer_is_json_of_the_certificate_with_its_standing(home, file, capsys):
    assert run(["certificate", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["standing"]["standing"] == "unsigned"
