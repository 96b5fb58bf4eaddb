"""Run every validation case and write its tables and pictures.

    python docs/validation/make.py           write tables and pictures; with names of scripts (paper_c_90t), of those
                                             pages only
    python docs/validation/make.py --check   write nothing; compute all and fail when a table is out of date
    python docs/validation/make.py --renew   of slow pages whose code has changed, all but the rankings of causes:
                                             where all tables are those of the page, the new code is kept for it

Each page is computed in a process of its own, as many side by side as there are cores. A page is a script with a
`compute()` that gives its blocks (`blocks.py`) and what its pictures are drawn from, and `draw` where it has some;
SLOW_PAGE where it takes more than ten seconds of a core and rests on nothing but the package: the tests compute it
when its code has changed.
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
sys.path[:0] = [folder for folder in map(str, (HERE, HERE.parents[1])) if folder not in sys.path]
import blocks  # noqa: E402
import computed  # noqa: E402

PARTS = ("batch", "blocks", "causes", "computed", "make", "overview", "quay", "reduced", "routh")
"""Scripts that are no page."""
MEASURED = ("bench_staircase",)
"""Pages that need data that are not in the repository: left as they are where those are not at hand."""
ARCHIVED = {
    "adaptation": "trials.adaptation.page",
    "components": "trials.components.page",
    "condition": "trials.condition.page",
    "controllers_compared": "benchmarks.control.page",
    "controllers_in_a_plan": "benchmarks.control.days.page",
    "displacement_tradeoff": "benchmarks.displacement.page",
    "friction_coverage": "trials.friction.page",
    "hull_convergence": "trials.hulls.page",
    "independent_crane": "trials.independent_crane.page",
    "limit_crossings": "trials.limits.crossings_page",
    "limit_curves": "trials.limits.curves_page",
    "residual": "trials.residual.page",
    "truth_defects": "trials.defects.page",
    "watch": "trials.adaptation.watch.page",
}
"""Pages of archived trials: made from the outcomes that stand beside them."""
CASES = tuple(sorted({p.stem for p in HERE.glob("*.py")}.difference(PARTS, MEASURED) | set(ARCHIVED)))


class Page(NamedTuple):
    """A page's file name, its text as computed now, and what draws its pictures."""

    name: str
    text: str
    draw: Callable[[], None]


def module_of(script: str) -> ModuleType:
    """The script of a page."""
    return import_module(ARCHIVED.get(script, script))


def scripts() -> tuple[str, ...]:
    """The scripts of all pages whose data are at hand."""
    return CASES + tuple(name for name in MEASURED if import_module(name).at_hand())


def page(script: str) -> Page:
    """One page, computed now."""
    case = module_of(script)
    found, shown = case.compute()
    return Page(
        blocks.page_of(script), blocks.filled(case, found), lambda: case.draw(shown) if hasattr(case, "draw") else None
    )


def front(written: Mapping[str, str]) -> Page:
    """The front page, from the claims that stand on the other pages; text by file name where it is not yet in the
    file."""
    overview = import_module("overview")
    names = [blocks.page_of(name) for name in CASES]
    texts = {name: written.get(name) or (HERE / name).read_text(encoding="utf-8") for name in names}
    return Page(overview.PAGE, blocks.filled(overview, overview.compute(texts)), lambda: None)


def slow(script: str) -> ModuleType | None:
    """The module of a slow page."""
    case = module_of(script)
    return case if getattr(case, "SLOW_PAGE", False) else None


def outdated(script: str | None, *, anew: bool = False) -> str:
    """What to say of a page (None: the front page) whose tables differ from what the package computes now; empty where
    they do not.

    A slow page whose code and tables are those of its last computation is computed only where ``anew`` asks for it.
    """
    if script is not None and not anew and slow(script) and computed.stands(HERE / blocks.page_of(script)):
        return ""
    name, text, _ = front({}) if script is None else page(script)
    if (HERE / name).read_text(encoding="utf-8") == text:
        return ""
    return (
        f"docs/validation/{name}: out of date; run: python docs/validation/make.py, and read the text around its tables"
        " again"
    )


def renew(script: str) -> tuple[str, str, dict[str, object] | None]:
    """Compute a slow page but for its rankings of causes: its file name, what differs, and what to keep where nothing
    does."""
    computed.watch()
    import_module("causes").LEFT.append(True)
    name, text, _ = page(script)
    there = (HERE / name).read_text(encoding="utf-8")
    if text != there:
        return name, "its tables change: run python docs/validation/make.py " + script, None
    kept = computed.record(text, computed.ranked_by(name) if "<!-- causes" in text else "")
    return name, "stands" if kept else "a file was changed meanwhile", kept


def write(script: str) -> tuple[str, str, dict[str, object] | None]:
    """Compute and write one page and its pictures: its file name, its text and, of a slow one, what to keep of its
    computation."""
    computed.watch()
    done = page(script)
    kept = computed.record(done.text) if slow(script) else None
    done.draw()
    (HERE / done.name).write_text(done.text, encoding="utf-8", newline="\n")
    return done.name, done.text, kept


def main(wanted: Sequence[str]) -> None:
    """Write tables and pictures of these scripts, all unless named, and the front page."""
    if unknown := [name for name in wanted if name not in scripts()]:
        sys.exit(f"no script {unknown[0]}.py. There are: {', '.join(scripts())}")
    texts = {}
    alone = ProcessPoolExecutor(os.cpu_count(), multiprocessing.get_context("spawn"), max_tasks_per_child=1)
    with alone as pool:
        for future in as_completed([pool.submit(write, script) for script in wanted or scripts()]):
            name, texts[name], kept = future.result()
            if kept:
                computed.keep({name: kept})
            print(f"docs/validation/{name}", flush=True)
    index = front(texts)
    (HERE / index.name).write_text(index.text, encoding="utf-8", newline="\n")


def renew_all(wanted: Sequence[str]) -> None:
    """Renew these slow pages, all whose code has changed unless named, two at a time."""
    changed = [s for s in wanted or CASES if slow(s) and (wanted or not computed.stands(HERE / blocks.page_of(s)))]
    alone = ProcessPoolExecutor(2, multiprocessing.get_context("spawn"), max_tasks_per_child=1)
    with alone as pool:
        for future in as_completed([pool.submit(renew, script) for script in changed]):
            name, found, kept = future.result()
            if kept:
                computed.keep({name: kept})
            print(f"docs/validation/{name}: {found}", flush=True)


if __name__ == "__main__":
    if "--renew" in sys.argv[1:]:
        renew_all([name for name in sys.argv[1:] if not name.startswith("--")])
        sys.exit()
    if "--check" in sys.argv[1:]:
        problems = [found for script in (*scripts(), None) if (found := outdated(script, anew=True))]
        print(*problems, sep="\n", file=sys.stderr)
        sys.exit(1 if problems else 0)
    main(sys.argv[1:])
