"""Campaigns of simulated tests as files: folder, marked logs, and the lines of the campaign file that map their
columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import check_folder
from stillhook.errors import SimulationError
from stillhook.logs.synthetic.instruments import Column, Sensor, Sensors, in_log_unit, unit_factor

MARK = "SYNTHETIC: simulated by Stillhook, measured on no crane"
CAMPAIGN_FILE, REFERENCE_FILE, LOG_FOLDER = "campaign.toml", "reference.toml", "logs"
TIME = 'time = { column = "Time", unit = "s" }'
"""Line of a campaign file for the time of these logs."""


def check_campaign_folder(folder: Path) -> None:
    """Refuse a folder that a campaign cannot be written to, or that has logs already. Errors: SimulationError."""
    check_folder(folder, (CAMPAIGN_FILE, REFERENCE_FILE))
    if (folder / LOG_FOLDER).exists():
        raise SimulationError(f"{folder / LOG_FOLDER}: there are logs already. Choose another folder.")


def log_file(name: str, parquet: bool) -> str:
    """Path of a test's log, seen from the campaign file."""
    return f"{LOG_FOLDER}/{name}{'.parquet' if parquet else '.csv'}"


def write_log(
    path: Path, time: FloatArray, signals: Mapping[str, FloatArray], columns: Sequence[Column], sensors: Sensors
) -> None:
    """A marked log, CSV or Parquet by the path's ending; time (n,) [s], signals as logged (n,) [SI]."""
    import polars  # heavy: only where logs are written

    table = polars.DataFrame(
        {"Time": time} | {c.heading: in_log_unit(signals[c.name], c, sensors[c.name]) for c in columns}
    )
    if path.suffix == ".parquet":
        table.write_parquet(path, metadata={"comment": MARK})
        return
    with path.open("wb") as file:
        file.write(f"# {MARK}\n".encode())
        table.write_csv(file)


def mapping_lines(columns: Sequence[Column], sensors: Sensors) -> list[str]:
    """The lines below [signals] in a campaign file."""
    return [TIME, *(f"{c.name} = {{ {', '.join(_signal(c, sensors[c.name]))} }}" for c in columns)]


def _signal(column: Column, sensor: Sensor) -> list[str]:
    """Heading, unit and range of a column, as a mapping writes them."""
    out = [f'column = "{column.heading}"', f'unit = "{column.unit}"']
    if abs(sensor.lo) < float("inf") and column.kind:
        lo, hi = (f'"{x / unit_factor(column):.12g} {column.unit}"' for x in (sensor.lo, sensor.hi))
        out.append(f"range = [{lo}, {hi}]")
    return out
