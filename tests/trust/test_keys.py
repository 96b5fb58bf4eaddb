"""Keys as files: what is written is read back, is its owner's alone, and anything else is refused in one line."""

import os
import stat

import pytest
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, PublicFormat

from stillhook.errors import TrustError
from stillhook.trust.keys import LARGEST_PEM, new_key, read_key, read_public, write_key

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
        (b"\xff\xfe", "not text"),
        (b"-----BEGIN PUBLIC KEY-----\nAAAA\n-----END PUBLIC KEY-----\n", "not a public key in PEM"),
        (b"-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n", "not a public key in PEM"),
        (b"A" * (LARGEST_PEM + 1), "holds more than 0.016384 MB"),
        (b"-----BEGIN PRIVATE KEY-----\n", "a private key"),
    ],
)
def test_what_is_no_public_key_is_refused_in_one_line(files, content, text):
    files[1].write_bytes(content)
    with pytest.raises(TrustError, match=text) as problem:
        read_public(files[1])
    assert "\n" not in str(problem.value)
    assert "public.pem" in str(problem.value)


def test_a_file_that_is_not_there_or_is_a_folder_is_refused(tmp_path):
    for path in (tmp_path, tmp_path / "gone.pem"):
        with pytest.raises(TrustError):
            read_public(path)
