"""Every way in which a signature can stand, on the day of a clock, and lists that cannot be used."""

import os
from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest
from tests.signers import KEY

from stillhook.errors import TrustError
from stillhook.trust.home import VARIABLE
from stillhook.trust.keys import new_key
from stillhook.trust.signature import Signed, sign, signature_of
from stillhook.trust.standing import Standing, judge
from stillhook.trust.trust_list import TrustedKey, TrustList, plans_trust, read_trust, users_trust

DIGEST, OTHER = "a" * 64, "b" * 64
FIRST, LAST = date(2026, 1, 1), date(2027, 12, 31)
SIGNATURE = sign(Signed.CERTIFICATE, DIGEST, KEY)


def trust(*keys: TrustedKey, today: date = date(2026, 11, 29)) -> TrustList:
    return TrustList(Path("trust.toml"), keys, lambda: today)


ENTRY = TrustedKey("Sea trials", KEY.public, FIRST, LAST)


@pytest.mark.parametrize(
    ("today", "standing"),
    [
        (date(2025, 12, 31), Standing.NOT_YET),
        (FIRST, Standing.TRUSTED),
        (LAST, Standing.TRUSTED),
        (date(2028, 1, 1), Standing.EXPIRED),
    ],
)
def test_a_key_is_trusted_from_its_first_to_its_last_day(today, standing):
    found = judge(SIGNATURE, Signed.CERTIFICATE, DIGEST, trust(ENTRY, today=today))
    assert found.standing is standing
    assert found.trusted is (standing is Standing.TRUSTED)
    assert "Sea trials" in found.sentence


@pytest.mark.parametrize("today", [date(1970, 1, 1), date(2026, 11, 29), date(9999, 12, 31)])
def test_a_revoked_key_is_trusted_on_no_day_whatever_the_clock_says(today):
    revoked = ENTRY.revoking(date(2026, 11, 1), "laptop stolen")
    found = judge(SIGNATURE, Signed.CERTIFICATE, DIGEST, trust(revoked, today=today))
    assert found.standing is Standing.REVOKED
    assert found.sentence.endswith("which was revoked on 2026-11-01 (laptop stolen)")


def test_without_signature_or_with_an_unknown_key_nothing_is_trusted():
    assert judge(None, Signed.CERTIFICATE, DIGEST, trust(ENTRY)).standing is Standing.UNSIGNED
    stranger = sign(Signed.CERTIFICATE, DIGEST, new_key("Sea trials"))  # calls himself as the trusted one
    assert judge(stranger, Signed.CERTIFICATE, DIGEST, trust(ENTRY)).standing is Standing.UNKNOWN


def test_a_signature_fits_nothing_but_what_was_signed():
    """Other contents, another kind of thing, another name, key or value."""
    stranger = new_key("Stranger")
    other = sign(Signed.CERTIFICATE, OTHER, KEY)
    wrong = [
        (SIGNATURE, Signed.CERTIFICATE, OTHER),
        (SIGNATURE, Signed.MANIFEST, DIGEST),
        (replace(SIGNATURE, name="Director"), Signed.CERTIFICATE, DIGEST),
        (replace(SIGNATURE, public=stranger.public.raw), Signed.CERTIFICATE, DIGEST),
        (replace(SIGNATURE, value=other.value), Signed.CERTIFICATE, DIGEST),
        (replace(SIGNATURE, value="0" * 128), Signed.CERTIFICATE, DIGEST),
    ]
    for signature, kind, digest in wrong:
        assert judge(signature, kind, digest, trust(ENTRY)).standing is Standing.ALTERED
    assert judge(SIGNATURE, Signed.CERTIFICATE, DIGEST, trust(ENTRY)).trusted


def test_signing_twice_gives_the_same():
    assert sign(Signed.CERTIFICATE, DIGEST, KEY) == SIGNATURE
    assert signature_of(SIGNATURE.to_dict()) == SIGNATURE


@pytest.mark.parametrize(
    "change",
    [
        {"ed25519": "00"},
        {"ed25519": "g" * 128},
        {"public": "A" * 64},
        {"signer": ""},
        {"signer": 5},
        {"key": "0" * 32},
        {"more": "x"},
    ],
)
def test_a_damaged_signature_is_no_signature(change):
    with pytest.raises(ValueError, match="signature: "):
        signature_of({**SIGNATURE.to_dict(), **change})
    with pytest.raises(ValueError, match="signature: "):
        signature_of("signed")


def test_a_list_reads_back_as_it_was_written(tmp_path):
    stranger = TrustedKey('A "quoted" name \\ Å', new_key("x").public).revoking(FIRST, "left the company")
    file = tmp_path / "trust.toml"
    made = TrustList(file, (ENTRY, stranger))
    made.write()
    assert read_trust(file) == made
    assert made.trusting(replace(ENTRY, name="Other")).keys == (stranger, replace(ENTRY, name="Other"))


def test_what_the_user_revokes_is_revoked_in_a_list_that_a_plan_names(tmp_path, monkeypatch):
    """Also where that list has the key as a good one, or does not have it."""
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    named = TrustList(tmp_path / "plan.toml", (ENTRY,))
    named.write()
    assert plans_trust(named.file).entry(KEY.public) == ENTRY
    users_trust().trusting(ENTRY.revoking(FIRST, "stolen")).write()
    for keys in ((ENTRY,), ()):
        replace(named, keys=keys).write()
        found = judge(SIGNATURE, Signed.CERTIFICATE, DIGEST, plans_trust(named.file))
        assert found.standing is Standing.REVOKED


GOOD = TrustList(Path("x"), (ENTRY,)).text()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("not toml", "not TOML"),
        (GOOD + GOOD, "is there twice"),
        (GOOD.replace("public", "pubic"), 'key 1: "pubic": unknown field'),
        (GOOD.replace("valid_from = 2026-01-01", 'valid_from = "2026-01-01"'), "give a day without quotes"),
        (GOOD.replace("valid_from = 2026-01-01", "valid_from = 2026-01-01T10:00:00"), "give a day without quotes"),
        (GOOD.replace("2027-12-31", "2025-12-31"), "trusted until 2025-12-31, which is before 2026-01-01"),
        (GOOD.replace("MCow", "MCox"), "key 1: public: not a public key in PEM"),
        (GOOD.replace('name = "Sea trials"', "name = 5"), "key 1: name is missing, or no text"),
        (GOOD + "reason = 5\n", "reason = 5: give a text"),
        ("[[key]]\n", "key 1: name is missing"),
        ("key = 5\n", "has tables [[key]] and nothing else"),
        ("trusted = 5\n", "has tables [[key]] and nothing else"),
        ("[" * 100_000, "not TOML"),
        ("a." * 40_000 + "b = 1", "a key of 40001 parts"),
        ("#\n" * 500_001, "1 MB"),
    ],
)
def test_a_damaged_list_is_refused_in_one_line_and_never_taken_for_an_empty_one(tmp_path, text, said):
    file = tmp_path / "trust.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(TrustError) as problem:
        read_trust(file)
    assert said in str(problem.value)
    assert "\n" not in str(problem.value)
    assert "trust.toml" in str(problem.value)


def test_a_list_of_the_user_that_is_lost_is_not_taken_for_an_empty_one(tmp_path, monkeypatch):
    """Its revocations would be lost with it."""
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    assert not users_trust().keys
    (tmp_path / "trust.toml").symlink_to("moved.toml")
    with pytest.raises(TrustError, match="no such file"):
        users_trust()
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(VARIABLE, str(tmp_path / "file"))
    with pytest.raises(TrustError, match="Not a directory"):
        users_trust()


@pytest.mark.skipif(os.name != "posix", reason="Windows tells no rights")
def test_a_list_of_the_user_that_another_user_could_replace_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    replace(trust(ENTRY), file=tmp_path / "trust.toml").write()
    tmp_path.chmod(0o777)
    with pytest.raises(TrustError, match=r"others may write to .*chmod go-w"):
        users_trust()
    tmp_path.chmod(0o1777)  # as /tmp: nobody but the owner of a file can replace it
    assert users_trust().keys == (ENTRY,)


@pytest.mark.skipif(os.name != "posix", reason="Windows tells no rights")
def test_a_first_list_is_used_again_where_new_files_are_open_to_a_group(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "settings"))
    before = os.umask(0o002)  # as several systems have it
    try:
        replace(trust(ENTRY), file=tmp_path / "settings" / "trust.toml").write()
    finally:
        os.umask(before)
    assert users_trust().keys == (ENTRY,)


@pytest.mark.parametrize("right", [0o020, 0o002], ids=["group", "all"])
def test_a_list_that_others_may_change_is_refused(tmp_path, right):
    file = tmp_path / "trust.toml"
    file.write_text(GOOD, encoding="utf-8")
    file.chmod(0o600 | right)
    with pytest.raises(TrustError, match="others may change it"):
        read_trust(file)
