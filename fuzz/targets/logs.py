"""Logs in every form, their mapping, and tables as workbooks."""

from __future__ import annotations

from pathlib import Path

from fuzz.targets import samples
from fuzz.targets.registry import Form, Target
from stillhook.errors import LogError
from stillhook.formats.table.corrections import read_corrections
from stillhook.formats.table.read import open_table
from stillhook.logs.formats.open import open_log
from stillhook.logs.formats.source import Want
from stillhook.logs.log import read_log
from stillhook.logs.mapping import read_mapping
from stillhook.logs.understood import understood_log

_ROWS = [";".join(f"{x:.3f}" for x in row) for row in zip(*samples.COLUMNS.values(), strict=True)]
CSV = "\n".join([";".join(samples.COLUMNS), *_ROWS]).encode()


def _log(path: Path) -> object:
    """Headings, a sample and all numbers of each column."""
    source = open_log(path)
    wants = [Want((place,)) for place in range(len(source.headings)) if source.sample(place)]
    return [chunk.broken for chunk in source.chunks(wants, 1000)]


def _table(path: Path) -> object:
    """Read a table."""
    return open_table(path, LogError)


TARGETS = (
    Target(
        "log-csv", Form.TABLE, read_log, "log.csv", seeds=lambda: iter((CSV, CSV.replace(b";", b",")[:600])), share=3
    ),
    Target(
        "log-understood", Form.TABLE, lambda p: understood_log(str(p)), "log.csv", seeds=lambda: iter((CSV,)), share=2
    ),
    Target("log-parquet", Form.BINARY, _log, "log.parquet", seeds=samples.by_writer(samples.parquet), share=0.5),
    Target("log-mat", Form.BINARY, _log, "log.mat", seeds=samples.by_writer(samples.mat), share=0.5),
    Target("log-hdf", Form.BINARY, _log, "log.h5", seeds=samples.by_writer(samples.hdf), share=0.5),
    Target("log-mdf", Form.BINARY, _log, "log.mf4", seeds=samples.by_writer(samples.mdf), share=0.5),
    Target("log-tdms", Form.BINARY, _log, "log.tdms", seeds=samples.by_writer(samples.tdms), share=0.5),
    Target("mapping", Form.TOML, read_mapping, "mapping.toml", share=2),
    Target("corrections", Form.TOML, read_corrections, "mapping.toml"),
    Target("table-csv", Form.TABLE, _table, "table.csv", seeds=lambda: iter((CSV,)), share=2),
    Target(
        "table-xlsx",
        Form.ZIP,
        _table,
        "table.xlsx",
        seeds=samples.by_writer(samples.workbook),
        share=0.5,
    ),
    Target(
        "table-parquet",
        Form.BINARY,
        _table,
        "table.parquet",
        seeds=samples.by_writer(samples.parquet),
        share=0.5,
    ),
)
