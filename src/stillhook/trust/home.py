"""The user's own folder of keys and trust list, and the rights of its files."""

from __future__ import annotations

import os
import stat
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


def replaceable(file: Path) -> str:
    """Why another user could put a file of his own in place of this one, "" where none can: it or its folder belongs to
    somebody else, or others may write to the folder; links are followed. Nothing on Windows, as of `open_to_others`."""
    if os.name != "posix":
        return ""
    owners = (os.geteuid(), 0)
    for path in (file, file.parent, file.resolve().parent):
        status = path.stat()
        if status.st_uid not in owners:
            return f"{path} belongs to another user"
        if path != file and status.st_mode & 0o022 and not status.st_mode & stat.S_ISVTX:
            return f"others may write to {path} (chmod go-w {path})"
    return ""
