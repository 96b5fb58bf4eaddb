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
