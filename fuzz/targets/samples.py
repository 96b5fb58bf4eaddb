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


OMEGA, HEADINGS = np.linspace(0.15, 1.5, 4), np.arange(0.0, 181.0, 45.0)
"""Of a vessel's table: frequencies [rad/s], headings [deg]."""


def vessels() -> Iterator[bytes]:
    """A plank that floats, as other programs write it: WAMIT, AQWA, VERES, and CSV with its conventions."""
    from tests.sea.other_programs import aqwa_text, wamit_text
    from tests.sea.plank import plank, plank_motions
    from tests.sea.test_rao_re1 import lines

    from stillhook.formats.vessel.csv import write_rao_csv

    H = plank_motions(OMEGA, np.radians(HEADINGS))
    yield wamit_text(OMEGA, HEADINGS, H).encode()
    yield aqwa_text(OMEGA, HEADINGS, H).encode()
    yield "\n".join(lines(headings=HEADINGS, omega=OMEGA)).encode()
    around = np.radians(np.arange(0.0, 360.0, 45.0))
    yield from by_writer(lambda path: write_rao_csv(plank(OMEGA, around), path, source="made up"))()


def hydrostar() -> list[bytes]:
    """The same in the six files of HydroStar."""
    from tests.sea.other_programs import hydrostar_texts
    from tests.sea.plank import plank_motions

    H = plank_motions(OMEGA, np.radians(HEADINGS))
    return [each.encode() for each in hydrostar_texts(OMEGA, HEADINGS, H)]


def orcaflex() -> Iterator[bytes]:
    import yaml
    from tests.sea.test_rao_orcaflex import model

    yield yaml.safe_dump(model(np.arange(0.0, 360.0, 45.0)), default_flow_style=None, width=9999).encode()


def capytaine() -> Iterator[bytes]:
    from tests.sea.test_rao_capytaine import data_set

    yield bytes(data_set().to_netcdf(engine="h5netcdf"))


def directional() -> Iterator[bytes]:
    """A spectrum over frequency and direction, by the names of the CF conventions."""
    import xarray

    f, degrees = np.linspace(0.05, 0.3, 6), np.arange(0.0, 360.0, 45.0)
    density = np.exp(-(((f[:, None] - 0.1) / 0.03) ** 2)) * (1.0 + np.cos(np.radians(degrees)))[None, :]
    attrs = {"units": "m2 s degree-1", "standard_name": "sea_surface_wave_directional_variance_spectral_density"}
    coords = {
        "freq": ("freq", f, {"units": "Hz"}),
        "dir": ("dir", degrees, {"units": "degree", "standard_name": "sea_surface_wave_from_direction"}),
        "time": np.array(["2026-11-28", "2026-11-29"], dtype="datetime64[ns]"),
    }
    data = xarray.Dataset({"efth": (("time", "freq", "dir"), np.stack([density, density]), attrs)}, coords=coords)
    yield bytes(data.to_netcdf(engine="h5netcdf"))


def hindcast() -> Iterator[bytes]:
    """Heights and periods at one place, as ERA5 has them."""
    import xarray

    time = np.arange("2026-01-01", "2026-01-03", dtype="datetime64[h]").astype("datetime64[ns]")
    columns = {"swh": (2.0, "m"), "pp1d": (9.0, "s"), "mwd": (30.0, "degrees")}
    values = {n: ("time", x + np.sin(np.arange(len(time))), {"units": unit}) for n, (x, unit) in columns.items()}
    yield bytes(xarray.Dataset(values, coords={"time": time}).to_netcdf(engine="h5netcdf"))
