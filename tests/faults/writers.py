"""What writes the files of Stillhook, called as a command line would: one line and exit code 2 where it cannot."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from stillhook.base.atomic import atomic_file, atomic_files, atomic_folder, durable_file
from stillhook.errors import StillhookError

NEW = "new " * 50


def one_file(out: Path) -> None:
    """A text in one file, below a folder that may be new."""
    with atomic_file(out / "a.txt") as part:
        part.write_text(NEW)


def one_durable_file(out: Path) -> None:
    """The same, on the disk."""
    with durable_file(out / "a.txt") as part:
        part.write_text(NEW)


def files_together(out: Path) -> None:
    """Three files that belong together."""
    with atomic_files(*(out / f"{name}.txt" for name in "abc")) as parts:
        for name, part in zip("abc", parts, strict=True):
            part.write_text(name + NEW)


def folder(out: Path) -> None:
    """Files and a folder of files."""
    with atomic_folder(out) as part:
        for name in "abc":
            (part / f"{name}.txt").write_text(name + NEW)


def run_file(out: Path) -> None:
    """A run as NetCDF."""
    import numpy as np
    import xarray

    from stillhook.formats.results import save_run

    save_run(xarray.Dataset({"e_c": ("time", np.arange(300.0))}), out / "runs.nc")


def stored(out: Path) -> None:
    """Summaries of runs in a store."""
    from stillhook.engine.store import Store, Summary

    Store(out / "store").put([b"k" * 32], [Summary(("e_c_pp",), "ok", [0.1], ["a note"])])


def keys(out: Path) -> None:
    """A private and a public key."""
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    from stillhook.trust.keys import SigningKey, write_key

    key = SigningKey("A signer", Ed25519PrivateKey.from_private_bytes(b"k" * 32))
    write_key(key, out / "key.pem", out / "key.pub.pem")


def history(out: Path) -> None:
    """Some rows of a live twin."""
    import numpy as np

    from stillhook.live.history import History

    with History(out, ("p_a", "F_w")) as of:
        of.append(1.8e9 + np.arange(50.0), np.arange(100.0).reshape(50, 2))


def certified(out: Path) -> None:
    """A certificate with its PDF and manifest, which nobody signed."""
    from tests.validate.staged_certificate import staged, write

    from stillhook.trust.results import result_folder
    from stillhook.validate import certificate_of

    made = certificate_of(staged(write(out.with_name("campaign"), synthetic=False)))
    with result_folder(out, "validation") as part:
        (part / "certificate.json").write_text(made.text(), encoding="utf-8")
        (part / "certificate.pdf").write_bytes(made.pdf())


WRITERS: dict[str, Callable[[Path], None]] = {
    each.__name__: each for each in (one_file, one_durable_file, files_together, folder, run_file, stored, keys)
}
"""Those that are swept."""
PREPARING = {"history": history, "certified": certified}
"""What else is read by command lines."""


def write(name: str, out: str) -> None:
    """Call a writer."""
    try:
        (WRITERS | PREPARING)[name](Path(out))
    except StillhookError as problem:
        print(f"error: {problem}", file=sys.stderr)
        sys.exit(2)
