"""A binary file that is damaged, or made to do harm, ends in one line of our own within the time limit, and never in a traceback."""

import os
import random
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from tests.api import odd_readers
from tests.parquet import write_parquet

from stillhook import load_run
from stillhook.base.gateway import template
from stillhook.base.gateway.budget import RECORDS
from stillhook.cli import run as command
from stillhook.errors import StillhookError, UnreadableError
from stillhook.formats import binary as binary_reader
from stillhook.formats import binary as reader_process
from stillhook.formats.binary import read_binary, refuse_bomb
from stillhook.formats.table.columns import ColumnSpec
from stillhook.formats.table.read import read_columns
from stillhook.formats.vessel.open import read_vessel
from stillhook.formats.waves.wavespectra import read_wavespectra
from stillhook.formats.weather.file import read_weather
from stillhook.logs.log import mapping_from, read_log

ROOT = Path(__file__).resolve().parents[2]
N = 200
T = np.arange(N) * 0.1
COLUMNS = {"time [s]": T, "p_a [bar]": 100.0 + 5.0 * np.sin(T), "omega_m [rpm]": 500.0 * np.cos(T)}
PLAIN = mapping_from({"time": {"column": "time", "unit": "s"}, "p_a": {"column": "p", "unit": "bar"}}, "mapping.toml")
SPECS = [ColumnSpec("p_a", "pressure", (), "p_a [bar]"), ColumnSpec("time", "time", (), "time [s]")]
BLOCKED = 5.0
"""Limit of time [s] for a file that blocks: long enough for the process to start, so that it is the file that is cut off."""
BUSY = 30.0
"""What a busy machine may add to a limit [s]."""


def parquet(path: Path) -> None:
    write_parquet(COLUMNS, path)


def mat(path: Path) -> None:
    from scipy.io import savemat

    savemat(path, {"time": T, "p": COLUMNS["p_a [bar]"]})


def hdf(path: Path) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_dataset("time", data=T, compression="gzip")
        file["p"] = COLUMNS["p_a [bar]"]
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file")


def mdf(path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF() as file:
        file.append([asammdf.Signal(COLUMNS["p_a [bar]"], T, name="p_a", unit="bar")])
        file.save(path)


def tdms(path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    timing = {"wf_increment": 0.1, "wf_start_offset": 0.0, "unit_string": "bar"}
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject("crane", "p_a", COLUMNS["p_a [bar]"], timing)])


def xlsx(path: Path) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(list(COLUMNS))
    for row in zip(*COLUMNS.values(), strict=True):
        book.active.append([float(x) for x in row])
    book.save(path)


def netcdf(path: Path, engine: str = "h5netcdf") -> None:
    import xarray

    when = np.datetime64("2020-01-01T00", "ns") + np.arange(60) * np.timedelta64(1, "h")
    waves = {
        "Hs": ("time", np.linspace(1.0, 2.0, 60), {"units": "m"}),
        "Tp": ("time", np.full(60, 8.0), {"units": "s"}),
    }
    of = {"crane": "x" * 300, "scenarios": "[]" * 40, "step": "0.005"}
    xarray.Dataset(waves, {"time": when}, of).to_netcdf(path, engine=engine)


class Format(NamedTuple):
    suffix: str
    write: Callable[[Path], None]
    read: Callable[[Path], object]


FORMATS = {
    "Parquet log": Format(".parquet", parquet, read_log),
    "MAT log": Format(".mat", mat, lambda path: read_log(path, PLAIN)),
    "HDF5 log": Format(".mat", hdf, lambda path: read_log(path, PLAIN)),
    "MDF log": Format(".mf4", mdf, read_log),
    "TDMS log": Format(".tdms", tdms, read_log),
    "Parquet map": Format(".parquet", parquet, lambda path: read_columns(path, SPECS)),
    "Excel map": Format(".xlsx", xlsx, lambda path: read_columns(path, SPECS)),
    "run": Format(".nc", netcdf, load_run),
    "weather": Format(".nc", netcdf, read_weather),
    "NetCDF-3 weather": Format(".nc", lambda path: netcdf(path, "scipy"), read_weather),
    "vessel": Format(".nc", netcdf, read_vessel),
}


def refusal(form: Format, path: Path) -> str:
    """What a reader says of a file, in one line; "" where it reads it. Anything but an error of ours fails the test."""
    said = ""
    try:
        form.read(path)
    except StillhookError as problem:
        said = str(problem)
    assert "\n" not in said
    return said


def halved(data: bytes, rng: random.Random) -> bytes:
    return data[: len(data) // 2]


def zeroed(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data) // 4, len(data) // 2)
    return data[:at] + bytes(64) + data[at + 64 :]


def flipped(data: bytes, rng: random.Random) -> bytes:
    out = bytearray(data)
    for _ in range(8):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


@pytest.mark.thorough
@pytest.mark.parametrize("name", FORMATS)
def test_damage_of_every_kind_is_read_or_refused_in_one_line(tmp_path, monkeypatch, name):
    good = tmp_path / f"good{FORMATS[name].suffix}"
    FORMATS[name].write(good)
    assert (refusal(FORMATS[name], good) == "") == (name != "vessel")  # weather is not a vessel
    rng = random.Random(name)
    monkeypatch.setenv("STILLHOOK_READ_TIME", "10 s")  # some damage blocks HDF5
    for damage in (halved, zeroed, flipped):
        bad = tmp_path / f"bad{FORMATS[name].suffix}"
        bad.write_bytes(damage(good.read_bytes(), rng))
        said = refusal(FORMATS[name], bad)
        assert bad.name in said or not said, damage.__name__


@pytest.mark.thorough
@pytest.mark.parametrize("name", FORMATS)
def test_what_is_no_file_of_the_format_is_refused_in_one_line(tmp_path, name):
    odd = tmp_path / f"odd{FORMATS[name].suffix}"
    for content in (b"", b"no such format", os.urandom(3000)):
        odd.write_bytes(content)
        assert odd.name in refusal(FORMATS[name], odd)
    odd.unlink()
    assert odd.name in refusal(FORMATS[name], odd)
    odd.mkdir()
    assert odd.name in refusal(FORMATS[name], odd)


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMATS)
def test_a_file_without_the_right_to_read_it_is_refused_in_one_line(tmp_path, name):
    path = tmp_path / f"mine{FORMATS[name].suffix}"
    FORMATS[name].write(path)
    path.chmod(0)
    if os.access(path, os.R_OK):
        pytest.skip("this user may read everything")
    assert path.name in refusal(FORMATS[name], path)


# A file that blocks, and readers that misbehave


def endless(path: Path) -> None:
    """A NetCDF file that HDF5 2.0 reads for ever: the free space that ends a global heap is said to be of 0 bytes, and the loop over the
    heap's objects goes on by that size."""
    netcdf(path)
    data = bytearray(path.read_bytes())
    at = data.index(b"GCOL") + 16
    while struct.unpack_from("<H", data, at)[0] != 0:
        at += 16 + (struct.unpack_from("<Q", data, at + 8)[0] + 7) // 8 * 8
    struct.pack_into("<Q", data, at + 8, 0)
    path.write_bytes(data)


def spectra(path: Path) -> object:
    pytest.importorskip("wavespectra")
    return read_wavespectra(path, "era5")


@pytest.mark.thorough
@pytest.mark.parametrize("read", [load_run, read_weather, read_vessel, spectra])
def test_a_file_that_hdf5_reads_for_ever_is_given_up(tmp_path, monkeypatch, read):
    monkeypatch.setenv("STILLHOOK_READ_TIME", f"{BLOCKED} s")
    path = tmp_path / "endless.nc"
    endless(path)
    start = time.monotonic()
    with pytest.raises(
        StillhookError, match=r"endless\.nc: .*not read within 5 s; for a slow drive set STILLHOOK_READ_TIME"
    ) as caught:
        read(path)
    assert "\n" not in str(caught.value)
    assert time.monotonic() - start < BLOCKED + BUSY


@pytest.mark.thorough
def test_the_command_line_gives_such_a_file_up_with_exit_code_2(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("STILLHOOK_READ_TIME", f"{BLOCKED} s")
    endless(tmp_path / "endless.nc")
    assert command(["vessel", str(tmp_path / "endless.nc")]) == 2
    out, error = capsys.readouterr()
    assert out == ""
    assert error.startswith("error: endless.nc: not a complete NetCDF file (not read within 5 s")
    assert error.count("\n") == 1


@pytest.mark.long
def test_a_reader_that_never_answers_is_stopped_and_the_next_file_is_read(tmp_path, monkeypatch):
    monkeypatch.setenv("STILLHOOK_READ_TIME", "1 s")
    with pytest.raises(UnreadableError, match=r"^not read within 1 s; for a slow drive"):
        read_binary(odd_readers.sleeps, tmp_path / "x")
    monkeypatch.delenv("STILLHOOK_READ_TIME")
    assert read_binary(odd_readers.prints, tmp_path / "x") == "x"


@pytest.mark.thorough
@pytest.mark.skipif(os.name == "nt", reason="the system ends no process there")
def test_a_blocked_reader_ends_even_where_the_process_that_waits_for_it_was_killed(tmp_path):
    endless(tmp_path / "endless.nc")
    script = "import sys, pathlib, stillhook.formats.binary as r, stillhook.formats.binary as n\n"
    script += "r.answer((2.0, n._datasets, (pathlib.Path(sys.argv[1]), 'h5netcdf', ())))"
    done = subprocess.run(
        [sys.executable, "-c", script, tmp_path / "endless.nc"],
        timeout=2.0 + reader_process.GRACE + 2 * BUSY,
        check=False,
    )
    assert done.returncode == -signal.SIGALRM


@pytest.mark.parametrize(
    ("reader", "arguments", "said"),
    [
        (odd_readers.dies, (), "^its reader broke down"),
        (odd_readers.fails, (), "^panicked at x$"),
        (odd_readers.takes, (10**15,), "^needs more memory than is allowed$"),
    ],
)
def test_a_library_that_panics_dies_or_eats_memory_takes_nobody_with_it(tmp_path, reader, arguments, said):
    with pytest.raises(UnreadableError, match=said):
        read_binary(reader, tmp_path / "x", *arguments)


needs_linux = pytest.mark.skipif(sys.platform != "linux", reason="processes begin as copies on Linux alone")


def after_a_refusal(reader: Callable[..., object], path: Path, *arguments: object) -> object:
    """What a reader gives in the process after one that was refused."""
    with pytest.raises(UnreadableError):
        read_binary(odd_readers.fails, path)
    return read_binary(reader, path, *arguments)


@needs_linux
def test_after_a_refusal_the_next_file_is_read_in_a_new_copy_of_a_process_that_saw_no_file(tmp_path):
    _, first, template = after_a_refusal(odd_readers.damaged, tmp_path / "x")
    with pytest.raises(UnreadableError, match=r"^damaged$"):
        read_binary(odd_readers.damages, tmp_path / "x")
    damaged, second, same = read_binary(odd_readers.damaged, tmp_path / "x")
    assert damaged == []
    assert second != first
    assert same == template != os.getpid()


@needs_linux
def test_what_one_reader_imported_the_next_has(tmp_path):
    binary_reader.end_readers()
    assert not after_a_refusal(odd_readers.imports, tmp_path / "x", "sunau")
    assert after_a_refusal(odd_readers.imports, tmp_path / "x", "sunau")


@needs_linux
@pytest.mark.slow
def test_a_library_that_begins_a_thread_has_every_file_read_by_a_process_that_starts_by_itself(tmp_path):
    binary_reader.end_readers()
    learned = dict(template._LEARNED)
    try:
        assert read_binary(odd_readers.damaged, tmp_path / "x")[2] != os.getpid()
        template.learn(["tests.api.threaded_library"])
        assert after_a_refusal(odd_readers.damaged, tmp_path / "x")[2] == os.getpid()
    finally:
        binary_reader.end_readers()
        template._LEARNED.clear()
        template._LEARNED.update(learned)


@needs_linux
@pytest.mark.slow
def test_what_reads_ends_with_the_process_that_waits_for_it(tmp_path):
    script = "import pathlib\nfrom stillhook.formats.binary import read_binary\nfrom tests.api import odd_readers\n"
    script += "print(*read_binary(odd_readers.damaged, pathlib.Path('x'))[1:], flush=True)\n"
    script += "read_binary(odd_readers.sleeps, pathlib.Path('x'))\n"
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, cwd=ROOT) as waits:
        processes = [Path(f"/proc/{number}") for number in waits.stdout.readline().split()]
        waits.kill()
    end = time.monotonic() + BUSY
    while any(process.exists() for process in processes) and time.monotonic() < end:
        time.sleep(0.02)
    assert [process for process in processes if process.exists()] == []


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits the memory of a process")
def test_memory_is_limited_as_the_environment_says(tmp_path, monkeypatch):
    binary_reader.end_readers()
    monkeypatch.setenv("STILLHOOK_READ_MEMORY", "500 MB")
    with pytest.raises(UnreadableError, match="needs more memory"):
        read_binary(odd_readers.takes, tmp_path / "x", 10**9)
    monkeypatch.setenv("STILLHOOK_READ_MEMORY", "4 GB")
    assert read_binary(odd_readers.takes, tmp_path / "x", 10**9) == 10**9


def test_what_just_fits_into_the_memory_is_read_and_a_byte_more_is_refused_unless_it_is_read_in_pieces(
    tmp_path, monkeypatch
):
    file = tmp_path / "x.nc"
    file.write_bytes(b"x" * 100_000)
    monkeypatch.setenv("STILLHOOK_READ_MEMORY", "150 MB")
    refuse_bomb(file, 150e6)
    with pytest.raises(UnreadableError, match=r"^holds 150 MB; up to 150 MB is read at once, more with STILLHOOK_READ"):
        refuse_bomb(file, 150e6 + 1)
    refuse_bomb(file, 150e6 + 1, at_once=False)


def test_a_file_may_hold_two_thousand_times_its_size_and_a_small_one_100_mb(tmp_path):
    """Deflate packs to a thousandth at best, so what claims more cannot be there."""
    small, larger = tmp_path / "small.nc", tmp_path / "larger.nc"
    small.write_bytes(b"x")
    larger.write_bytes(b"x" * 100_000)
    for file, most, shown in (
        (small, 100e6, "100 MB in a file of 1 bytes"),
        (larger, 200e6, "200 MB in a file of 100000 bytes"),
    ):
        refuse_bomb(file, most)
        with pytest.raises(UnreadableError, match=f"^claims to hold {shown}; up to {most / 1e6:.0f} MB is read$"):
            refuse_bomb(file, most + 1)
    refuse_bomb(small, 500.0, allowed=500.0)
    with pytest.raises(
        UnreadableError, match=r"^claims to hold 501 bytes in a file of 1 bytes; up to 500 bytes is read$"
    ):
        refuse_bomb(small, 501.0, allowed=500.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("STILLHOOK_READ_TIME", "60", "STILLHOOK_READ_TIME"),
        ("STILLHOOK_READ_TIME", "0 s", 'STILLHOOK_READ_TIME = "0 s": a time above 0, such as "10 min".'),
        ("STILLHOOK_READ_MEMORY", "lots", 'STILLHOOK_READ_MEMORY = "lots": is not a size. Give one in GB or MB, such'),
    ],
)
def test_limits_of_the_environment_are_texts_with_a_unit(tmp_path, monkeypatch, name, text, said):
    monkeypatch.setenv(name, text)
    netcdf(tmp_path / "run.nc")
    binary_reader.end_readers()
    with pytest.raises(StillhookError) as caught:
        load_run(tmp_path / "run.nc")
    assert said in str(caught.value)


def test_a_large_file_has_more_time(tmp_path, monkeypatch):
    monkeypatch.setattr(binary_reader, "_size", lambda path: 500_000_000)
    assert binary_reader.time_limit(tmp_path / "x") == 60.0 + 500.0


@pytest.mark.thorough
def test_a_script_without_a_main_guard_can_read_a_run(tmp_path):
    netcdf(tmp_path / "run.nc")
    (tmp_path / "script.py").write_text(
        "import stillhook\nprint('once')\nprint(len(stillhook.load_run('run.nc').time))\n"
    )
    done = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("once\n60\n", "")


# Files that claim, or unpack to, more than they can hold


@pytest.mark.thorough
def test_a_header_that_claims_a_million_million_rows_is_refused(tmp_path):
    import h5py

    with h5py.File(tmp_path / "log.mat", "w") as file:
        for name in ("time", "p"):
            file.create_dataset(name, shape=(10**12,), chunks=(1000,), dtype="f8")
    assert "claims to hold 1.6e+04 GB in a file of" in refusal(FORMATS["HDF5 log"], tmp_path / "log.mat")
    with h5py.File(tmp_path / "run.nc", "w") as file:
        file.create_dataset("time", shape=(10**12,), chunks=(1000,), dtype="f8")
    assert "run.nc: not a NetCDF file of a run (claims to hold 8e+03 GB" in refusal(FORMATS["run"], tmp_path / "run.nc")


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("MAT log", struct.pack("<ii", 1, N), struct.pack("<ii", 1, 2**31 - 1)),
        ("MDF log", struct.pack("<Q", N), struct.pack("<Q", 10**12)),
    ],
)
def test_counts_that_the_file_cannot_hold_are_refused(tmp_path, name, old, new):
    path = tmp_path / f"log{FORMATS[name].suffix}"
    FORMATS[name].write(path)
    assert old in path.read_bytes()
    path.write_bytes(path.read_bytes().replace(old, new))
    assert "claims to hold" in refusal(FORMATS[name], path)


@pytest.mark.thorough
def test_a_spreadsheet_that_unpacks_to_gigabytes_is_refused_before_it_does(tmp_path):
    xlsx(tmp_path / "map.xlsx")
    data = bytearray((tmp_path / "map.xlsx").read_bytes())
    struct.pack_into("<I", data, data.index(b"PK\x01\x02") + 24, 4_000_000_000)
    (tmp_path / "map.xlsx").write_bytes(data)
    assert "map.xlsx: not a readable Excel file (claims to hold 4 GB in a file of" in refusal(
        FORMATS["Excel map"], tmp_path / "map.xlsx"
    )


@pytest.mark.thorough
def test_a_table_of_more_cells_than_any_map_has_is_refused(tmp_path):
    write_parquet({name: np.zeros(2_000_000) for name in COLUMNS}, tmp_path / "map.parquet")
    assert "claims 6000000 cells; up to 5000000 make a map" in refusal(FORMATS["Parquet map"], tmp_path / "map.parquet")


def test_a_packed_text_that_never_ends_is_read_up_to_the_limit(tmp_path, monkeypatch):
    import gzip

    monkeypatch.setattr("stillhook.formats.weather.file.RECORDS", RECORDS._replace(size=1_000_000))
    (tmp_path / "buoy.txt.gz").write_bytes(gzip.compress(b" 1" * 600_000))
    with pytest.raises(StillhookError, match=r"^buoy\.txt\.gz: holds more than 1 MB\."):
        read_weather(tmp_path / "buoy.txt.gz")
