"""A plan's result on disk: plan.nc (labelled arrays, blocks as groups) and plan.json (facts and summary). Written whole
or not at all, each with a hash, so that what is read is what was written."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stillhook.base.atomic import atomic_folder
from stillhook.errors import PlanError, UnreadableError
from stillhook.formats.binary import read_datasets
from stillhook.formats.results import save_json, to_json
from stillhook.plan.result import BLOCKS, PlanResult
from stillhook.units import quote

if TYPE_CHECKING:
    import xarray


NUMBERS, FACTS = "plan.nc", "plan.json"
PLAN_FILES = (NUMBERS, FACTS)
OF_NUMBERS, OF_FACTS = "numbers_sha256", "facts_sha256"
"""Keys in the file of facts of the hash of the numbers that belong to it, and of that of its other facts."""


def save_plan(result: PlanResult, folder: str | Path) -> Path:
    """Write a result into a folder; both files appear together when they are complete.

    Parameters
    ----------
    result : PlanResult
        What `plan` gave.
    folder : str or Path
        Folder to write.

    Returns
    -------
    Path
        The folder.
    """
    target = Path(folder)
    with atomic_folder(target) as part:
        write_plan(result, part)
    return target


def write_plan(result: PlanResult, part: Path) -> None:
    """The files of a result in a folder that is moved into place later."""
    result.data.to_netcdf(part / NUMBERS, engine="h5netcdf", encoding=_packed(result.data))
    for name in BLOCKS:
        if name in result:
            block = result[name]
            block.to_netcdf(part / NUMBERS, engine="h5netcdf", mode="a", group=name, encoding=_packed(block))
    facts = json.loads(to_json({**result.facts, OF_NUMBERS: _hash((part / NUMBERS).read_bytes())}))
    save_json(facts | {OF_FACTS: _hash_of_facts(facts)}, part / FACTS)


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _hash_of_facts(facts: dict[str, Any]) -> str:
    return _hash(json.dumps(facts, sort_keys=True).encode())


def _packed(data: xarray.Dataset) -> dict[Any, dict[str, Any]]:
    return {name: {"zlib": True} for name in data.data_vars if data[name].ndim and data[name].dtype.kind in "fi"}


def load_plan_result(folder: str | Path) -> PlanResult:
    """The result that `save_plan` wrote.

    Parameters
    ----------
    folder : str or Path
        Its folder.

    Returns
    -------
    PlanResult
        The result.

    Raises
    ------
    PlanError
        One line, for a folder without one, and for files that are damaged, changed or of two plans.
    """
    where = Path(folder)
    if where.name in PLAN_FILES:
        where = where.parent
    for name in PLAN_FILES:
        if not (where / name).is_file():
            raise PlanError(f"{quote(str(folder))}: no {name} there. Give the folder that stillhook plan --out wrote.")
    facts = _facts(where / FACTS)
    _check_numbers(facts.pop(OF_NUMBERS, None), where)
    try:
        data, blocks = read_datasets(where / NUMBERS, BLOCKS)
    except UnreadableError as problem:
        raise PlanError(f"{where / NUMBERS}: not the numbers of a plan ({problem}). Run the plan again.") from None
    if data.attrs.get("name") != facts["name"] or data.attrs.get("digest", "") != facts.get("digest", ""):
        raise PlanError(f"{where}: {NUMBERS} and {FACTS} are of two plans. Run the plan again.")
    return PlanResult(data, facts, blocks)


def _in_a_line(e: Exception) -> str:
    return " ".join(str(e).split())[:120] or type(e).__name__


def _check_numbers(recorded: object, where: Path) -> None:
    """Refuse numbers other than those that the facts were written with; facts of older versions have no hash."""
    try:
        same = recorded is None or recorded == _hash((where / NUMBERS).read_bytes())
    except OSError as e:
        raise PlanError(f"{where / NUMBERS}: cannot be read ({_in_a_line(e)}).") from None
    if not same:
        raise PlanError(
            f"{where / NUMBERS}: not as it was written with {FACTS}: damaged, or of another plan. Run the plan again."
        )


def _facts(path: Path) -> dict[str, Any]:
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as e:
        raise PlanError(f"{path}: not JSON ({_in_a_line(e)}). Run the plan again.") from None
    if not isinstance(facts, dict) or not isinstance(facts.get("name"), str):
        raise PlanError(f"{path}: not the facts of a plan. Run the plan again.")
    recorded = facts.pop(OF_FACTS, None)
    if recorded is not None and recorded != _hash_of_facts(facts):
        raise PlanError(f"{path}: not as it was written: damaged, or changed. Run the plan again.")
    if isinstance(rows := facts.get("phases"), list):
        facts["phases"] = [_in_depths(row) for row in rows]
    return facts


def _in_depths(row: Any) -> Any:
    """A phase with depths; one of version 0.10 has heights."""
    if not isinstance(row, dict) or "start" not in row:
        return row
    heights = {"start_depth": row["start"], "depth": row.get("end")}
    others = {key: value for key, value in row.items() if key not in ("start", "end")}
    return others | {key: 0.0 - z if isinstance(z, int | float) else z for key, z in heights.items()}
