"""Stand-ins for libraries that misbehave, for the process that reads binary files."""

import importlib
import os
import sys
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


def imports(path: Path, name: str) -> bool:
    """Whether a module was there before it is imported."""
    there = name in sys.modules
    importlib.import_module(name)
    return there


def damages(path: Path) -> None:
    """As a library that holds on to what it could not read."""
    DAMAGED.append(path.name)
    raise ValueError("damaged")


DAMAGED: list[str] = []


def damaged(path: Path) -> tuple[list[str], int, int]:
    """What is damaged in this process, the process, and that it began from."""
    return DAMAGED, os.getpid(), os.getppid()
