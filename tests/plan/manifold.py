"""A small plan that tests of plan files write: a manifold of 60 t in 300 m of water."""

from pathlib import Path

from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.file import load_plan


def manifold(*alternatives: str, start_depth: str = "-5 m") -> str:
    """What its file begins with: crane, vessel, payload, start, alternatives, crane tip and water."""
    return f"""\
crane = "nov-250t"
vessel = "construction-vessel-130m"
payload = "manifold-60t"
start_depth = "{start_depth}"
alternatives = [{", ".join(f'"{name}"' for name in alternatives)}]

[tip]
at = "x=-15 m, y=-24 m, z=36 m"

[water]
depth = "300 m"

"""


def loaded(folder: Path, text: str) -> LiftPlan:
    """The plan of a file of this text."""
    path = folder / "plan.toml"
    path.write_text(text, encoding="utf-8")
    return load_plan(path)
