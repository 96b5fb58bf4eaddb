"""Run every validation case and write its tables and pictures.

    python docs/validation/make.py           write tables and pictures; with names of scripts (paper_c_90t), of those pages only
    python docs/validation/make.py --check   write nothing; fail when a table is out of date
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

HERE = Path(__file__).resolve().parent
CASES = (
    "controllers_at_their_best",
    "feedforward_gains",
    "frequency_road",
    "friction_coverage",
    "hull_convergence",
    "independent_crane_results",
    "offshore_100t",
    "offshore_200t",
    "paper_a_motor_models",
    "paper_c_90t",
    "paper_c_envelope",
    "paper_c_offshore_contrast",
    "paper_c_oscillation",
    "paper_d_friction",
    "paper_e_maps",
    "paper_e_motor_servo",
    "paper_e_scenario_1",
    "paper_e_scenario_2",
    "paper_e_stability",
    "paper_e_scenario_3",
    "payload_in_water",
    "power_unit_loss",
    "splash_mode",
    "threshold_study",
    "truth_defects",
    "uncertainty",
    "wave_spectra",
)
MEASURED = ("bench_staircase",)  # need data that are not in the repository: left as they are where those are not at hand


class Page(NamedTuple):
    """A page's file name, its text as computed now, and what draws its pictures."""

    name: str
    text: str
    draw: Callable[[], None]


def _module(name: str) -> ModuleType:
    if str(HERE) not in sys.path:
        sys.path.insert(0, str(HERE))
    return import_module(name)


def scripts() -> tuple[str, ...]:
    """The scripts of all pages whose data are at hand."""
    return CASES + tuple(name for name in MEASURED if _module(name).at_hand())


def page(script: str) -> Page:
    """One page, computed now."""
    case = _module(script)
    found, *_, shown = case.compute()
    return Page(case.PAGE, _module("blocks").filled(case.PAGE, found), lambda: case.draw(shown))


def front(written: Mapping[str, str]) -> Page:
    """The front page, from the claims that stand on the other pages; text by file name where it is not yet in the file."""
    overview = _module("overview")
    names = [_module(name).PAGE for name in CASES]
    texts = {name: written.get(name) or (HERE / name).read_text(encoding="utf-8") for name in names}
    return Page(overview.PAGE, _module("blocks").filled(overview.PAGE, overview.compute(texts)), lambda: None)


def outdated(script: str | None) -> str:
    """What to say of a page (None: the front page) whose tables differ from what the package computes now; empty where they do not."""
    name, text, _ = front({}) if script is None else page(script)
    if (HERE / name).read_text(encoding="utf-8") == text:
        return ""
    return f"docs/validation/{name}: out of date; run: python docs/validation/make.py, and read the text around its tables again"


def main(wanted: Sequence[str]) -> None:
    """Write tables and pictures of these scripts, all unless named, and the front page."""
    if unknown := [name for name in wanted if name not in scripts()]:
        sys.exit(f"no script {unknown[0]}.py. There are: {', '.join(scripts())}")
    texts: dict[str, str] = {}
    for script in wanted or scripts():
        done = page(script)
        texts[done.name] = done.text
        done.draw()
        (HERE / done.name).write_text(done.text, encoding="utf-8", newline="\n")
        print(f"docs/validation/{done.name}")
    index = front(texts)
    (HERE / index.name).write_text(index.text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        problems = [found for script in (*scripts(), None) if (found := outdated(script))]
        print(*problems, sep="\n", file=sys.stderr)
        sys.exit(1 if problems else 0)
    main(sys.argv[1:])
