"""The user's own folder of keys and trust list, and the rights of its files."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs

VARIABLE = "STILLHOOK_CONFIG"
"""Environment variable that names another folder."""
KEY, PUBLIC, TRUST = "key.pem", "public.pem", "trust.toml"
"""Names in it: private key, public key to hand out, keys that are trusted."""


def home() -> Path:
    """STILLHOOK_CONFIG, else the user's folder of settings. It need not exist."""
    return Path(os.environ.get(VARIABLE) or platformdirs.user_config_dir("stillhook", appauthor=False))


def open_to_others(path: Path, rights: int) -> str:
    """Rights that group and others have of those in a mask, such as "644", "" where none; Windows keeps the profile
    closed and tells no rights."""
    mode = path.stat().st_mode & 0o777
    return f"{mode:03o}" if os.name == "posix" and mode & rights else ""
