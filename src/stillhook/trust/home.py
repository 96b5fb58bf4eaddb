"""The user's own folder of keys and trust list, and files of it read within a limit of size."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs

from stillhook.base.gateway.access import read_bytes
from stillhook.base.gateway.budget import TOML
from stillhook.errors import TrustError
from stillhook.units import quote

VARIABLE = "STILLHOOK_CONFIG"
"""Environment variable that names another folder."""
KEY, PUBLIC, TRUST = "key.pem", "public.pem", "trust.toml"
"""Names in it: private key, public key to hand out, keys that are trusted."""
LARGEST = 200_000
"""Bytes of a trust list: some 500 keys; a PEM file has some hundred."""


def home() -> Path:
    """STILLHOOK_CONFIG, else the user's folder of settings. It need not exist."""
    return Path(os.environ.get(VARIABLE) or platformdirs.user_config_dir("stillhook", appauthor=False))


def text_of(path: Path, noun: str, advice: str, largest: int = LARGEST) -> str:
    """Text of a file. Parameters: noun, with an article; advice: what to do without it, a sentence; largest [bytes].

    Errors: TrustError, one line.
    """
    if not os.path.lexists(path):
        raise TrustError(f"{quote(str(path))}: no such file. {advice}")
    data = read_bytes(path, noun.partition(" ")[2], TrustError, TOML._replace(size=largest))
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        raise TrustError(f"{path.name}: not {noun} (not text). {advice}") from None


def open_to_others(path: Path, rights: int) -> str:
    """Rights that group and others have of those in a mask, such as "644", "" where none; Windows keeps the profile
    closed and tells no rights."""
    mode = path.stat().st_mode & 0o777
    return f"{mode:03o}" if os.name == "posix" and mode & rights else ""
