"""Every file that a user brings is opened and parsed in `stillhook.base.gateway`; whoever reads otherwise says why."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import stillhook
from stillhook.base.gateway.budget import BUDGETS

SOURCE = Path(stillhook.__file__).parent
GATEWAY = "base/gateway/"
METHODS = frozenset({"read_text", "read_bytes"})
FUNCTIONS = frozenset(
    {
        *("tomllib.load", "tomllib.loads", "json.load", "json.loads", "np.load", "np.loadtxt", "np.genfromtxt"),
        *("np.fromfile", "pickle.load", "pickle.loads", "yaml.load", "yaml.load_all", "yaml.safe_load", "yaml.parse"),
        *("gzip.open", "gzip.GzipFile", "lzma.open", "bz2.open", "zipfile.ZipFile", "tarfile.open", "io.open"),
        *("pd.read_csv", "pd.read_excel", "pd.read_parquet", "pl.read_csv", "pl.scan_parquet", "pl.read_parquet"),
        *("openpyxl.load_workbook", "h5py.File", "loadmat", "TdmsFile.open", "MDF", "xarray.open_dataset"),
        *("xr.open_dataset", "fromstring", "ElementTree.parse", "ET.parse", "ET.fromstring", "sqlite3.connect"),
    }
)
WRITES = frozenset("wax")
OF_PACKAGE = ("__file__", "files(", "FOLDER", "DATA", "HERE", "LIBRARY", "LIMITS_FILE", "_TEXT")
"""What a call mentions that reads a file of Stillhook itself."""
SAID = {
    "base/atomic.py": "handles that are waited for until a file is on the disk",
    "trust/archive.py": "members of an archive that the gateway opened, up to a size unpacked",
    "trust/manifest.py": "parts of a folder, for their hash",
    "base/extensions.py": "modules of the user, which are run as code anyway",
    "cli/parser.py": "the package's own modules",
    "cli/__init__.py": "the null device, in place of an output that nobody reads",
    "library/examples.py": "example logs of the package",
    "plan/file.py": "example plans of the package",
    "analysis/kept.py": "own cache",
    "engine/store.py": "own store of finished cases",
    "kernels/build.py": "sources that are compiled",
    "kernels/control_laws.py": "sources that are compiled",
    "kernels/c99/library.py": "own cache of compiled code",
    "kernels/c99/zig.py": "own cache of compiled code",
    "kernels/by_numba.py": "own cache of compiled code, whose checksum fits",
    "base/kept/arrays.py": "own files, whose checksum fits, after their headers",
    "base/kept/sources.py": "sources, for their hash",
    "base/kept/checked.py": "own files, no larger than a limit, whose checksum is looked at first",
    "validate/certificate/certificate.py": "JSON made a line before",
    "validate/certificate/recheck.py": "own PDF beside a certificate, compared byte by byte",
    "plan/result.py": "JSON and numbers made a line before",
    "export/twin/compile.py": "what was compiled a line before",
    "export/fmu/package.py": "what was compiled a line before, sources, and the archive that is written",
    "export/fmu/system.py": "what was written a line before",
    "formats/binary.py": "in the process that reads, under its limits",
    "formats/out.py": "a file that is written",
    "formats/waves/wavespectra.py": "in the process that reads, under its limits",
    "formats/table/read.py": "in the process that reads, under its limits",
    "logs/formats/columnar.py": "in the process that reads, under its limits",
    "logs/formats/csv.py": "a piece of bytes that the gateway gave",
    "live/runtime/board.py": "a message of the twin's own process, as large as its place in memory",
    "live/runtime/causes.py": "counters of the kernel of Linux",
    "live/runtime/doctor.py": "counters of the kernel of Linux",
    "live/observer/panel.py": "a message of the twin's own process",
    "live/history/budget.py": "own database",
    "live/history/columns.py": "own database",
    "live/history/events.py": "own database; a line of the twin's own process",
    "live/history/journal.py": "own database",
    "live/history/writer.py": "own database",
    "analysis/uncertainty/report.py": "attributes of a result in memory",
}


def name_of(node: ast.expr) -> str:
    """The last two parts of what is called."""
    if isinstance(node, ast.Attribute):
        return f"{node.value.id}.{node.attr}" if isinstance(node.value, ast.Name) else f".{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


def reads(call: ast.Call) -> bool:
    """Whether a call opens or parses a file, other than to write it."""
    name = name_of(call.func)
    method = name.rpartition(".")[2] if isinstance(call.func, ast.Attribute) else ""
    if method in METHODS or name in FUNCTIONS:
        return True
    if method == "open" or name == "open":
        modes = [*call.args, *(k.value for k in call.keywords if k.arg == "mode")]
        texts = [a.value for a in modes if isinstance(a, ast.Constant) and isinstance(a.value, str)]
        return not any(WRITES & set(text) for text in texts)
    return False


def reading_calls() -> Iterator[tuple[str, int, str]]:
    """File, line and text of every reading call outside of the gateway, besides those of the package's own data."""
    for path in sorted(SOURCE.rglob("*.py")):
        place = path.relative_to(SOURCE).as_posix()
        if place.startswith(GATEWAY):
            continue
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Call) and reads(node):
                written = ast.get_source_segment(text, node) or ""
                if not any(mark in written for mark in OF_PACKAGE):
                    yield place, node.lineno, written


@pytest.mark.long
def test_files_of_users_are_read_by_the_gateway_alone():
    strangers = [(f"{place}:{line}", text) for place, line, text in reading_calls() if place not in SAID]
    assert strangers == []


@pytest.mark.long
def test_every_reason_is_still_one():
    assert set(SAID) == {place for place, _, _ in reading_calls()}


def test_the_page_on_files_names_every_budget():
    """The table of docs/explanation/foreign-files.md has the numbers of the code."""
    page = (SOURCE.parents[1] / "docs" / "explanation" / "foreign-files.md").read_text(encoding="utf-8")
    for each in BUDGETS:
        row = next((line for line in page.splitlines() if line.startswith(f"| {each.kind} |")), "")
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        size = f"{each.size / 1e6:g} MB" if each.size else "-"
        counts = [f"{n:,}" if n else "-" for n in (each.depth, each.rows, each.cells)]
        assert cells[1:] == [size, *counts, each.why]
