"""Run every validation case and write its tables and pictures.

    python docs/validation/make.py           write tables and pictures; with names of scripts (paper_c_90t), of those
    pages only python docs/validation/make.py --check   write nothing; compute all and fail when a table is out of date

Each page is computed in a process of its own, as many side by side as there are cores.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
CASES = (
    "cavitation",
    "controllers_at_their_best",
    "cylinder",
    "drives",
    "electric",
    "error_correlation",
    "feedforward_gains",
    "frequency_domain_method",
    "friction_coverage",
    "hull_convergence",
    "independent_crane_results",
    "limit_crossings",
    "limit_curves",
    "offshore_100t",
    "offshore_200t",
    "open_circuit",
    "oscillation",
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
    "passive_heave_compensator",
    "payload_in_water",
    "power_unit_loss",
    "secondary",
    "splash_mode",
    "threshold_study",
    "truth_defects",
    "uncertainty",
    "wave_spectra",
)
MEASURED = (
    "bench_staircase",
)  # need data that are not in the repository: left as they are where those are not at hand

SLOW = (
    "controllers_at_their_best",
    "cylinder",
    "drives",
    "error_correlation",
    "feedforward_gains",
    "frequency_domain_method",
    "offshore_100t",
    "offshore_200t",
    "oscillation",
    "paper_c_90t",
    "paper_c_envelope",
    "paper_d_friction",
    "paper_e_maps",
    "paper_e_motor_servo",
    "paper_e_scenario_1",
    "paper_e_scenario_2",
    "paper_e_scenario_3",
    "paper_e_stability",
    "passive_heave_compensator",
    "power_unit_loss",
    "secondary",
    "splash_mode",
    "threshold_study",
)
"""Pages that take more than ten seconds of a core and rest on nothing but the package: the tests compute them when its
code has changed."""


class Page(NamedTuple):
    """A page's file name, its text as computed now, and what draws its pictures."""

    name: str
    text: str
    draw: Callable[[], None]


def _module(name: str) -> ModuleType:
    sys.path[:0] = [path for path in (str(HERE), str(ROOT)) if path not in sys.path]
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
    """The front page, from the claims that stand on the other pages; text by file name where it is not yet in the
    file."""
    overview = _module("overview")
    names = [_module(name).PAGE for name in CASES]
    texts = {name: written.get(name) or (HERE / name).read_text(encoding="utf-8") for name in names}
    return Page(overview.PAGE, _module("blocks").filled(overview.PAGE, overview.compute(texts)), lambda: None)


def outdated(script: str | None, *, anew: bool = False) -> str:
    """What to say of a page (None: the front page) whose tables differ from what the package computes now; empty where
    they do not.

    A slow page whose code and tables are those of its last computation is computed only where ``anew`` asks for it.
    """
    if script in SLOW and not anew and _module("computed").stands(HERE / _module(script).PAGE):
        return ""
    name, text, _ = front({}) if script is None else page(script)
    if (HERE / name).read_text(encoding="utf-8") == text:
        return ""
    return (
        f"docs/validation/{name}: out of date; run: python docs/validation/make.py, and read the text around its tables"
        " again"
    )


def write(script: str) -> tuple[str, str, dict[str, object]]:
    """Compute and write one page and its pictures: its file name, its text and what to keep of its computation."""
    done = page(script)
    kept = _module("computed").record(done.text)
    done.draw()
    (HERE / done.name).write_text(done.text, encoding="utf-8", newline="\n")
    return done.name, done.text, kept


def main(wanted: Sequence[str]) -> None:
    """Write tables and pictures of these scripts, all unless named, and the front page."""
    if unknown := [name for name in wanted if name not in scripts()]:
        sys.exit(f"no script {unknown[0]}.py. There are: {', '.join(scripts())}")
    computed, texts = _module("computed"), {}
    alone = ProcessPoolExecutor(os.cpu_count(), multiprocessing.get_context("spawn"), max_tasks_per_child=1)
    with alone as pool:
        running = {pool.submit(write, script): script for script in wanted or scripts()}
        for future in as_completed(running):
            name, texts[name], kept = future.result()
            if running[future] in SLOW:
                computed.keep({name: kept})
            print(f"docs/validation/{name}", flush=True)
    index = front(texts)
    (HERE / index.name).write_text(index.text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        problems = [found for script in (*scripts(), None) if (found := outdated(script, anew=True))]
        print(*problems, sep="\n", file=sys.stderr)
        sys.exit(1 if problems else 0)
    main(sys.argv[1:])
