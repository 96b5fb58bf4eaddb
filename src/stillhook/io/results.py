"""Results on disk: NetCDF with everything that repeats the run, and a summary as JSON. Written whole or not at all."""

from __future__ import annotations

import json
import math
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stillhook.engine.simulate import simulate
from stillhook.errors import SimulationError, StillhookError
from stillhook.library import crane_from_toml
from stillhook.scenario import Scenario

if TYPE_CHECKING:
    import xarray

    from stillhook.crane import Crane


def save_run(run: xarray.Dataset, path: str | Path) -> Path:
    """Write a run to NetCDF (h5netcdf). The file appears under its name only when it is complete."""
    target = Path(path)
    with whole_file(target) as part:
        packed = {v: {"zlib": True} for v in run.data_vars if run[v].ndim and run[v].dtype.kind == "f"}
        run.to_netcdf(part, engine="h5netcdf", encoding=packed)
    return target


def load_run(path: str | Path) -> xarray.Dataset:
    """The run that `save_run` wrote. Errors: StillhookError where the file is none."""
    import xarray

    if not Path(path).is_file():
        raise StillhookError(f"{path}: no such file. Give a file that save_run or --out wrote.")
    try:
        with xarray.open_dataset(path, engine="h5netcdf") as data:
            run = data.load()
    except (OSError, ValueError) as e:
        raise StillhookError(f"{path}: not a NetCDF file of a run ({' '.join(str(e).split())}).") from None
    missing = {"crane", "scenarios", "step"} - set(run.attrs)
    if missing:
        raise StillhookError(f"{path}: not a run of Stillhook, {', '.join(sorted(missing))} missing. Write runs with save_run.")
    return run


def origin(run: xarray.Dataset) -> tuple[Crane, list[Scenario]]:
    """Crane and scenarios from which a run was made."""
    crane = crane_from_toml(run.attrs["crane"], "stored crane")
    return crane, [Scenario.from_dict(s) for s in json.loads(run.attrs["scenarios"])]


def rerun(run: xarray.Dataset) -> xarray.Dataset:
    """The same run again from its own record; the same version on the same machine gives the same bits."""
    crane, cases = origin(run)
    every = float(run.attrs["every"])
    step = f"{float(run.attrs['step']) * 1e3:.9g} ms"
    case = cases[0] if run.attrs["single"] else cases
    return simulate(crane, case, step=step, every=f"{every or 0.1:.9g} s", series=every > 0.0, on_failure="mark")


def save_json(data: Any, path: str | Path) -> Path:
    """Write data as JSON, NaN as null; the file appears only when it is complete."""
    target = Path(path)
    with whole_file(target) as part:
        part.write_text(to_json(data) + "\n", encoding="utf-8")
    return target


def to_json(data: Any) -> str:
    """Strict JSON: numbers that are not finite become null."""
    return json.dumps(_finite(data), indent=2, allow_nan=False)


def _finite(x: Any) -> Any:
    if isinstance(x, dict):
        return {k: _finite(v) for k, v in x.items()}
    if isinstance(x, list | tuple):
        return [_finite(v) for v in x]
    return None if isinstance(x, float) and not math.isfinite(x) else x


class whole_file:
    """A temporary name beside the target, renamed when the block ends well and removed when it does not."""

    def __init__(self, target: Path) -> None:
        self.target = target

    def __enter__(self) -> Path:
        try:
            self.target.parent.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=self.target.parent, prefix=f".{self.target.stem}-", suffix=self.target.suffix)
        except OSError as e:
            raise SimulationError(f"{self.target}: cannot be written ({e.strerror}). Choose another folder.") from None
        os.close(handle)
        self.part = Path(name)
        return self.part

    def __exit__(self, kind: object, *rest: object) -> None:
        if kind is None:
            os.chmod(self.part, 0o644)
            os.replace(self.part, self.target)
        else:
            self.part.unlink(missing_ok=True)
