"""A plan of the library as files to edit: the plan, and the payload that it names, beside it."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from stillhook.base.atomic import atomic_folder, check_folder
from stillhook.base.choice import nearest
from stillhook.errors import PlanError
from stillhook.plan.file import SHELF, plans
from stillhook.units import quote


def copy_plan(name: str, folder: Path) -> tuple[Path, ...]:
    """Write a plan of the library and its payload into a folder; the copy takes the payload that lies beside it.
    Returns the paths.

    Errors: PlanError for a name that there is not, or a file that is there already; SimulationError where nothing can
    be written.
    """
    if name not in plans():
        raise PlanError(f"No plan {quote(name)} to copy: the library has {', '.join(plans())}{nearest(name, plans())}")
    shelf = files("stillhook.library") / "data"
    text = (shelf / SHELF / f"{name}.toml").read_text(encoding="utf-8")
    payload = next(line.split('"')[1] for line in text.splitlines() if line.startswith("payload = "))
    edited = text.replace(f'payload = "{payload}"', f'payload = "{payload}.toml"  # beside this file')
    texts = {
        f"{name}.toml": edited.replace(f"stillhook plan {name} ", f"stillhook plan {name}.toml "),
        f"{payload}.toml": (shelf / "payloads" / f"{payload}.toml").read_text(encoding="utf-8"),
    }
    for file in texts:
        if (folder / file).exists():
            raise PlanError(f"{folder / file}: is there already, and may be yours. Give another folder.")
    check_folder(folder, tuple(texts))
    with atomic_folder(folder) as part:
        for file, content in texts.items():
            (part / file).write_text(content, encoding="utf-8")
    return tuple(folder / file for file in texts)
