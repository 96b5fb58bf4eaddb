"""Keys as files: what is written is read back, is its owner's alone, and anything else is refused in one line."""

import os
import stat

import pytest
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, PublicFormat

from stillhook.base.gateway.budget import KEY
from stillhook.errors import TrustError
from stillhook.trust.keys import PublicKey, new_key, read_key, read_public, write_key
from stillhook.trust.trust_list import TrustedKey, TrustList, read_trust

POSIX = pytest.mark.skipif(os.name != "posix", reason="Windows has no rights of group and others")


@pytest.fixture
def files(tmp_path):
    return tmp_path / "key.pem", tmp_path / "public.pem"


def nobody() -> str:
    raise AssertionError("a passphrase was asked for")


@pytest.mark.parametrize("word", ["", "a secret"])
def test_a_key_reads_back_with_its_name_and_signs_the_same(files, word):
    made = new_key("Sea trials, Ålesund")
    write_key(made, *files, word)
    read = read_key(files[0], (lambda: word) if word else nobody)
    assert read.public == made.public
    assert read.name == "Sea trials, Ålesund" == read_public(files[1]).name
    assert read.sign(b"x") == made.sign(b"x")
    assert read_public(files[1]).id == made.public.id


@POSIX
def test_a_private_key_is_its_owners_alone(files):
    write_key(new_key("A"), *files)
    assert stat.S_IMODE(files[0].stat().st_mode) == 0o600
    files[0].chmod(0o640)
    with pytest.raises(TrustError, match=r"others may read or change it \(rights 640\).*chmod 600"):
        read_key(files[0], nobody)


def test_a_key_that_exists_is_never_written_over(files):
    write_key(new_key("A"), *files)
    before = files[0].read_bytes()
    with pytest.raises(TrustError, match="exists"):
        write_key(new_key("B"), *files)
    assert files[0].read_bytes() == before


def test_a_wrong_passphrase_is_refused(files):
    write_key(new_key("A"), *files, "right")
    with pytest.raises(TrustError, match="wrong passphrase"):
        read_key(files[0], lambda: "wrong")
    with pytest.raises(TrustError, match="wrong passphrase"):
        read_key(files[0], lambda: "")


@pytest.mark.parametrize("name", ["", "  ", "two\nlines", "x" * 81, "bell\a"])
def test_a_name_is_one_printable_line(name):
    with pytest.raises(TrustError, match="one printable line of at most 80"):
        new_key(name)


def test_a_key_of_another_algorithm_is_refused_in_one_line(files):
    other = ec.generate_private_key(ec.SECP256R1())
    files[0].write_bytes(other.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))
    files[0].chmod(0o600)
    files[1].write_bytes(other.public_key().public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo))
    for read in (lambda: read_key(files[0], nobody), lambda: read_public(files[1])):
        with pytest.raises(TrustError, match="another algorithm than Ed25519") as problem:
            read()
        assert "\n" not in str(problem.value)


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (b"", "not a public key in PEM"),
        (b"\xff\xfe", "not UTF-8 text"),
        (b"-----BEGIN PUBLIC KEY-----\nAAAA\n-----END PUBLIC KEY-----\n", "not a public key in PEM"),
        (b"-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n", "not a public key in PEM"),
        (b"A" * (KEY.size + 1), "holds more than"),
        (b"-----BEGIN PRIVATE KEY-----\n", "a private key"),
    ],
)
def test_what_is_no_public_key_is_refused_in_one_line(files, content, text):
    files[1].write_bytes(content)
    with pytest.raises(TrustError, match=text) as problem:
        read_public(files[1])
    assert "\n" not in str(problem.value)
    assert "public.pem" in str(problem.value)


SMALL = (
    "0000000000000000000000000000000000000000000000000000000000000000",
    "0100000000000000000000000000000000000000000000000000000000000000",
    "26e8958fc2b227b045c3f489f2ef98f0d5dfac05d3c63339b13802886d53fc05",
    "c7176a703d4dd84fba3c0b760d10670f2a2053fa2c39ccc64ec7fd7792ac037a",
    "ecffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f",
    "edffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f",
    "eeffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f",
)
"""Encodings of points of small order, less the sign of x: libsodium, ge25519_has_small_order."""


@pytest.mark.parametrize("sign", [0x00, 0x80])
@pytest.mark.parametrize("digits", SMALL)
def test_a_key_that_fits_what_nobody_signed_is_refused(files, digits, sign):
    raw = bytearray.fromhex(digits)
    raw[-1] |= sign
    files[1].write_text(PublicKey(raw.hex(), "Anybody").pem(), encoding="utf-8")
    with pytest.raises(TrustError, match="a key of small order") as problem:
        read_public(files[1])
    assert "\n" not in str(problem.value)
    TrustList(files[1]).trusting(TrustedKey("Anybody", PublicKey(raw.hex()))).write()
    with pytest.raises(TrustError, match="key 1: public: a key of small order"):
        read_trust(files[1])


@pytest.mark.parametrize(
    "digits",
    [
        "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a",
        "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c",
        "5866666666666666666666666666666666666666666666666666666666666666",
    ],
)
def test_keys_of_other_order_are_read(files, digits):
    """Keys of RFC 8032, section 7.1, and the base point of the curve."""
    files[1].write_text(PublicKey(digits).pem(), encoding="utf-8")
    assert read_public(files[1]).raw == digits


def test_a_file_that_is_not_there_or_is_a_folder_is_refused(tmp_path):
    for path in (tmp_path, tmp_path / "gone.pem"):
        with pytest.raises(TrustError):
            read_public(path)
