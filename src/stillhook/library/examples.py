"""Examples to try a command on: SYNTHETIC crane tests and a supplier's map, simulated by `trials.campaigns.examples`
and kept as data; files of a live twin, and of a twin with a soft PLC.

A campaign is a folder of `data/examples`: its TOML files as they are, `logs.json` with heading, step, unit and decimals
of each column and the samples of each test, and `logs.npy.xz` with every column in whole steps, all tests in turn, as
differences from sample to sample.
"""

from __future__ import annotations

import json
import lzma
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_file, atomic_folder, check_folder
from stillhook.errors import LiveError, SimulationError

DATA = Path(__file__).with_name("data") / "examples"
SEA_TRIALS, FRICTION_TESTS, MOTOR_MAP = DATA / "sea-trials", DATA / "friction-tests", DATA / "motor-map.csv"
LIVE, HIL = DATA / "live", DATA / "hil"
MARK = "SYNTHETIC: simulated by Stillhook, measured on no crane"
CAMPAIGN_FILE, REFERENCE_FILE, LOG_FOLDER = "campaign.toml", "reference.toml", "logs"


def example_campaign(example: Path, out: str | Path) -> Path:
    """Write the campaign file and logs of an example, `SEA_TRIALS` or `FRICTION_TESTS`, into a folder without them.

    Returns the campaign file. Errors: SimulationError.
    """
    folder, texts = Path(out), sorted(example.glob("*.toml"))
    check_folder(folder, tuple(text.name for text in texts))
    if (folder / LOG_FOLDER).exists():
        raise SimulationError(f"{folder / LOG_FOLDER}: there are logs already. Choose another folder.")
    with atomic_folder(folder) as part:
        (part / LOG_FOLDER).mkdir()
        for test, table in stored_logs(example):
            write_csv(part / LOG_FOLDER / f"{test}.csv", table)
        for text in texts:
            shutil.copyfile(text, part / text.name)
    return folder / CAMPAIGN_FILE


def example_files(example: Path, out: str | Path) -> list[Path]:
    """Copy the files of an example, `LIVE` or `HIL`, into a folder without them. Errors: LiveError, SimulationError."""
    folder, files = Path(out), sorted(example.iterdir())
    if present := [file.name for file in files if (folder / file.name).exists()]:
        raise LiveError(f"{folder / present[0]}: is there already. Choose another folder.")
    check_folder(folder, tuple(file.name for file in files))
    with atomic_folder(folder) as part:
        for file in files:
            shutil.copyfile(file, part / file.name)
    return [folder / file.name for file in files]


def example_map(out: str | Path) -> Path:
    """Write an example of a motor supplier's map, as CSV, to a file that is not there yet. Errors: SimulationError."""
    target = Path(out)
    if target.exists():
        raise SimulationError(f"{target}: is there already, and may be a real map. Choose another name.")
    with atomic_file(target) as part:
        shutil.copyfile(MOTOR_MAP, part)
    return target


def stored_logs(example: Path) -> Iterator[tuple[str, dict[str, FloatArray]]]:
    """Each test of an example by its name, and its log: values (n,) by heading, in the units of the log."""
    index: dict[str, Any] = json.loads((example / "logs.json").read_text(encoding="utf-8"))
    with lzma.open(example / "logs.npy.xz") as file:
        counts = np.cumsum(np.load(file), axis=1)
    end = 0
    for test, samples in index["samples"].items():
        rows = counts[:, end : end + samples]
        end += samples
        columns = zip(rows, index["columns"].items(), strict=True)
        yield test, {heading: np.round(row * step / unit, d) for row, (heading, (step, unit, d)) in columns}


def write_csv(path: Path, table: dict[str, FloatArray]) -> None:
    """A marked log as CSV."""
    import pandas  # heavy: only where logs are written

    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(f"# {MARK}\n")
        pandas.DataFrame(table).to_csv(file, index=False, lineterminator="\n", na_rep="NaN")
