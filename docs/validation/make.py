"""Run every validation case and write its tables and pictures.

    python docs/validation/make.py           write tables and pictures
    python docs/validation/make.py --check   write nothing; fail when a table is out of date
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

HERE = Path(__file__).resolve().parent
CASES = (
    "feedforward_gains",
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
    "paper_e_scenario_3",
    "power_unit_loss",
    "threshold_study",
)
MEASURED = ("bench_staircase",)  # need data that are not in the repository: left as they are where those are not at hand


def pages() -> tuple[dict[str, str], list[Callable[[], None]]]:
    """Every page's text as computed now, and what draws the pictures."""
    if str(HERE) not in sys.path:
        sys.path.insert(0, str(HERE))
    blocks = import_module("blocks")
    texts, draws, claims = {}, [], {}
    for name in CASES:
        case = import_module(name)
        found, claims[case.PAGE], runs = case.compute()
        texts[case.PAGE] = blocks.filled(case.PAGE, found)
        draws.append(lambda case=case, runs=runs: case.draw(runs))
    for name in MEASURED:
        case = import_module(name)
        if case.at_hand():
            found, results = case.compute()
            texts[case.PAGE] = blocks.filled(case.PAGE, found)
            draws.append(lambda case=case, results=results: case.draw(results))
    front = import_module("overview")
    texts[front.PAGE] = blocks.filled(front.PAGE, front.compute(claims))
    return texts, draws


def outdated() -> Iterator[str]:
    """One line per page whose tables differ from what the package computes now."""
    for page, text in pages()[0].items():
        if (HERE / page).read_text(encoding="utf-8") != text:
            yield f"docs/validation/{page}: out of date; run: python docs/validation/make.py, and read the text around its tables again"


def main() -> None:
    """Write tables and pictures."""
    texts, draws = pages()
    for page, text in texts.items():
        (HERE / page).write_text(text, encoding="utf-8", newline="\n")
        print(f"docs/validation/{page}")
    for draw in draws:
        draw()


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        problems = list(outdated())
        print(*problems, sep="\n", file=sys.stderr)
        sys.exit(1 if problems else 0)
    main()
