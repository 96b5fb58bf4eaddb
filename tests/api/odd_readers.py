"""Stand-ins for libraries that misbehave, for the process that reads binary files."""

import os
import time
from pathlib import Path


def sleeps(path: Path) -> None:
    time.sleep(600.0)


def dies(path: Path) -> None:
    os._exit(1)


def fails(path: Path) -> None:
    raise BaseException(f"panicked\nat {path.name}.")


def takes(path: Path, size: int) -> int:
    return len(bytearray(size))


def prints(path: Path) -> str:
    os.write(1, b"noise of a library")
    print("more noise")
    return path.name
