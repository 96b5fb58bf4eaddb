"""Small files in the binary forms of logs and tables, made by the libraries that read them."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

TIME = np.arange(0.0, 4.0, 0.1)
COLUMNS: dict[str, Any] = {
    "time [s]": TIME,
    "p_a [bar]": 200.0 + np.sin(TIME),
    "v_w [m/s]": 0.5 * np.cos(TIME),
    "mode": np.round(TIME),
}


def by_writer(write: Callable[[Path], object]) -> Callable[[], Iterator[bytes]]:
    """Seeds: one file, as a function writes it."""

    def made() -> Iterator[bytes]:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "made"
            write(path)
            yield next(path.parent.glob("made*")).read_bytes()

    return made


def parquet(path: Path) -> None:
    from stillhook.formats.table.parquet import write_table

    write_table(COLUMNS, {}, path)


def workbook(path: Path) -> None:
    from openpyxl import Workbook

    book = Workbook()
    for row in (("radius [m]", "SWL [t]"), (10, 250), (20, 150), (30, 80.5)):
        book.active.append(row)
    stream = io.BytesIO()
    book.save(stream)
    path.write_bytes(stream.getvalue())


def mat(path: Path) -> None:
    from scipy.io import savemat

    savemat(path, {"t": TIME, "p_a": COLUMNS["p_a [bar]"], "of": {"v_w": COLUMNS["v_w [m/s]"]}}, appendmat=False)


def hdf(path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        group = file.create_group("log")
        for name, column in COLUMNS.items():
            group.create_dataset(name.replace("/", " per "), data=column)


def mdf(path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append([Signal(samples=x, timestamps=TIME, name=n.split()[0], unit="bar") for n, x in COLUMNS.items()])
        file.save(path.with_suffix(".mf4"), overwrite=True)


def tdms(path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("log", name, x) for name, x in COLUMNS.items()])
