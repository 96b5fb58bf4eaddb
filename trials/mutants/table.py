"""What became of mutants: a figure for every room, and the survivors."""

from __future__ import annotations

from collections.abc import Sequence

from trials.mutants.run import Outcome


def room(outcome: Outcome) -> str:
    """The room of the sources, or the file where it is in none."""
    return outcome.mutant.file.split("/")[2]


def table(outcomes: Sequence[Outcome]) -> str:
    """Markdown: mutants and killed ones of each room, those of numbers and comparisons, and all."""
    rows = ["| room | mutants | killed | of these by the limit of time |", "|---|---|---|---|"]
    groups = {name: [o for o in outcomes if room(o) == name] for name in sorted(map(room, outcomes))}
    groups["numbers"] = [o for o in outcomes if o.mutant.before[0].isdigit()]
    groups["comparisons"] = [o for o in outcomes if not o.mutant.before[0].isdigit()]
    groups["all"] = list(outcomes)
    for name, group in groups.items():
        stopped = sum(o.status == "stopped" for o in group)
        rows.append(f"| {name} | {len(group)} | {sum(o.dead for o in group)} | {stopped or ''} |")
    return "\n".join(rows) + "\n"


def survivors(outcomes: Sequence[Outcome]) -> str:
    """A line for each: file, line and change, what is written there, and the tests that saw nothing."""
    return "".join(
        f"{o.mutant.file}:{o.mutant.line}: {o.mutant.change}\n    {o.text}\n    {o.by or 'no test'}\n"
        for o in outcomes
        if not o.dead
    )
