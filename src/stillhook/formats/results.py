"""Results on disk: NetCDF with everything that repeats the run, and a summary as JSON. Written completely or not at
all."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.atomic import atomic_file
from stillhook.base.gateway.guard import guarded, reader
from stillhook.base.gateway.parse import from_json
from stillhook.engine.simulate import End, simulate
from stillhook.errors import StillhookError, UnreadableError
from stillhook.formats.binary import read_dataset
from stillhook.formats.table.netcdf import write_netcdf
from stillhook.library import crane_from_toml
from stillhook.spec.lift.lowering import InSea, Lowering
from stillhook.spec.lift.stored import LARGEST, stored_lowerings
from stillhook.spec.scenario import Scenario
from stillhook.trust.results import Cranes, note_misfit, result_folder

if TYPE_CHECKING:
    import xarray

    from stillhook.spec.crane import Crane


RESOLUTION = 120
"""Of pictures [dots per inch]."""


def save_run(run: xarray.Dataset, path: str | Path) -> Path:
    """Write runs, of scenarios or lowerings, to NetCDF (h5netcdf).

    The file appears under its name only when it is complete.

    Parameters
    ----------
    run : Dataset
        What `simulate` gave.
    path : str or Path
        File to write.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    StillhookError
        Where the disk is full or the folder cannot be written.

    Examples
    --------
    >>> import stillhook, tempfile
    >>> crane = stillhook.load_crane("nov-250t")
    >>> case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", duration="40 s", warm_up="20 s")
    >>> run = stillhook.simulate(crane, case)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = stillhook.save_run(run, f"{folder}/run.nc")
    ...     bool(stillhook.load_run(file).e_c_pp == run.e_c_pp)
    True
    """
    target = Path(path)
    with atomic_file(target) as part:
        write_netcdf(part, {"": run})
    return target


@reader(StillhookError)
def load_run(path: str | Path) -> xarray.Dataset:
    """The run that `save_run` wrote.

    Parameters
    ----------
    path : str or Path
        NetCDF file.

    Returns
    -------
    Dataset
        The run as `simulate` gave it.

    Raises
    ------
    StillhookError
        Where the file is not one.

    Examples
    --------
    >>> import stillhook
    >>> stillhook.load_run("gone.nc")
    Traceback (most recent call last):
    stillhook.errors.StillhookError: gone.nc: no such file. Give a file that save_run or --out wrote.
    """
    if not os.path.isfile(path):
        reason = "is a folder" if os.path.isdir(path) else "no such file"
        raise StillhookError(f"{path}: {reason}. Give a file that save_run or --out wrote.")
    note_misfit(Path(path))
    try:
        run = read_dataset(Path(path))
    except UnreadableError as problem:
        raise StillhookError(f"{path}: not a NetCDF file of a run ({problem}). Simulate again.") from None
    missing = {"crane", "step"} - set(run.attrs)
    if missing:
        raise StillhookError(
            f"{path}: not a run of Stillhook, {', '.join(sorted(missing))} missing. Write runs with save_run."
        )
    stages = [name for name in run.variables if name == "stage" or str(name).startswith("stage_")]  # of 0.11 and before
    return run.rename({name: str(name).replace("stage", "phase", 1) for name in stages})


def origin(run: xarray.Dataset) -> tuple[list[Crane], list[Scenario]]:
    """Crane and scenario of every case of a run, in pairs. Errors: StillhookError, also for lowerings."""
    if "scenarios" not in run.attrs:
        raise StillhookError("the file holds lowerings, not scenarios. Run them again with rerun, or stillhook lower.")
    cases = [Scenario.from_dict(s) for s in _stored_list(run, "scenarios")]
    cranes = cranes_of(run)
    n = max(len(cases), len(cranes))
    if not {len(cases), len(cranes)} <= {1, n}:
        raise StillhookError(f"stored run: {len(cranes)} cranes and {len(cases)} scenarios. Simulate again.")
    return (cranes * n if len(cranes) == 1 else cranes), (cases * n if len(cases) == 1 else cases)


def lowerings_of(run: xarray.Dataset) -> tuple[list[Crane], list[Lowering | InSea]]:
    """Crane and lowering of every case of a run, in pairs. Errors: StillhookError, also where there are none."""
    if "lowerings" not in run.attrs:
        raise StillhookError(
            "the file holds lowerings without what repeats them: it is of Stillhook 0.10 or older, or their water is"
            f" more than {LARGEST / 1e6:.0f} MB. Run the lift file again: stillhook lower."
        )
    cases, cranes = stored_lowerings(str(run.attrs["lowerings"])), cranes_of(run)
    try:
        places = np.ravel(run.attrs.get("crane_of_case", [0] * len(cases))).astype(int).tolist()
        of_case = [cranes[i] for i in places]
    except (ValueError, IndexError, TypeError, OverflowError):
        of_case = []
    if len(of_case) != len(cases):
        raise StillhookError(f"stored run: {len(of_case)} cranes and {len(cases)} lowerings. Simulate again.")
    return of_case, cases


def _several(run: xarray.Dataset) -> bool:
    """Whether a run is of a list of cranes, whose files are stored as a JSON list of texts."""
    return str(run.attrs["crane"]).startswith("[")


def cranes_of(run: xarray.Dataset) -> list[Crane]:
    """The cranes of a run: one, or one for each case. Errors: StillhookError."""
    texts = _stored_list(run, "crane") if _several(run) else [str(run.attrs["crane"])]
    if not all(isinstance(text, str) for text in texts):
        raise StillhookError("stored crane: not a list of crane files. Simulate again.")
    return [crane_from_toml(text, "stored crane") for text in texts]


def _stored_list(run: xarray.Dataset, name: str) -> list[Any]:
    try:
        stored = from_json(str(run.attrs[name]))
    except UnreadableError:
        stored = None
    if not isinstance(stored, list) or not stored:
        raise StillhookError(f"stored {name}: not a list in JSON. Simulate again.")
    return stored


def stored_steps(run: xarray.Dataset) -> tuple[str, str | None]:
    """Integration step and spacing of the series as texts; no spacing where no series was stored."""
    try:
        step, every = (float(np.asarray(run.attrs.get(name, 0.0)).item()) for name in ("step", "every"))
    except (ValueError, TypeError):
        raise StillhookError("stored run: step or every is not a number. Simulate again.") from None
    return f"{step * 1e3:.9g} ms", f"{every:.9g} s" if every else None


def stored_sampling(run: xarray.Dataset, crane: Crane) -> tuple[str | None, End]:
    """Sampling of the statistics of lowerings as text (None: every PLC cycle), and where they end."""
    try:
        sampled = int(np.asarray(run.attrs.get("sampled", 1)).item())
        short = bool(np.asarray(run.attrs.get("short", 0)).item())
    except (ValueError, TypeError, OverflowError):
        raise StillhookError("stored run: sampled or short is not a whole number. Simulate again.") from None
    sampling = None if sampled == 1 else f"{sampled * crane.control.t_cycle:.9g} s"
    return sampling, End.PROGRAMME if short else End.DURATION


def rerun(run: xarray.Dataset) -> xarray.Dataset:
    """The same run again from its own record, of scenarios or lowerings; the same version on the same machine gives the
    same bits."""
    with guarded("stored run", StillhookError, "Simulate again."):
        return _rerun(run)


def _rerun(run: xarray.Dataset) -> xarray.Dataset:
    step, every = stored_steps(run)
    more: dict[str, Any] = {"step": step, "every": every, "series": every is not None, "on_failure": "mark"}
    one_for_all = run.attrs.get("single", 1)
    cases: list[Any]
    if "scenarios" in run.attrs:
        cranes, cases = origin(run)
        one_for_all = one_for_all or (_several(run) and all(c is cases[0] for c in cases))
    else:
        cranes, cases = lowerings_of(run)
        more["sampling"], more["end"] = stored_sampling(run, cranes[0])
    return simulate(cranes if _several(run) else cranes[0], cases[0] if one_for_all else cases, **more)


def save_json(data: Any, path: str | Path) -> Path:
    """Write data as JSON, NaN as null; the file appears only when it is complete."""
    target = Path(path)
    with atomic_file(target) as part:
        part.write_text(to_json(data) + "\n", encoding="utf-8")
    return target


def save_files(folder: Path, files: Mapping[str, Any], what: str, cranes: Cranes = ()) -> None:
    """Write files by name with their manifest (what they are, of which cranes), all of them or none: figures as PNG,
    Datasets as NetCDF, texts and bytes as they are, anything else as JSON. Errors: SimulationError where the folder
    cannot be written."""
    with result_folder(folder, what, cranes) as part:
        for name, content in files.items():
            path = part / name
            if isinstance(content, str):
                path.write_text(content, encoding="utf-8")
            elif isinstance(content, bytes):
                path.write_bytes(content)
            elif path.suffix == ".png":
                content.savefig(path, dpi=RESOLUTION)
            elif path.suffix == ".nc":
                save_run(content, path)
            else:
                save_json(content, path)


def to_json(data: Any) -> str:
    """Strict JSON: numbers that are not finite become null."""
    return json.dumps(_finite(data), indent=2, allow_nan=False)


def _finite(x: Any) -> Any:
    if isinstance(x, dict):
        return {k: _finite(v) for k, v in x.items()}
    if isinstance(x, list | tuple):
        return [_finite(v) for v in x]
    return None if isinstance(x, float) and not math.isfinite(x) else x
