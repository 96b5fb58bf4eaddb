"""Writes src/stillhook/validate/criteria/detection_limits.toml from outcomes.json: from what size on each defect is
detected."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from stillhook.validate.criteria.criteria import LIMITS_FILE, DetectionLimit, DetectionLimits
from trials.campaigns import Defect
from trials.campaigns.defects import DEFECTS, defect_text
from trials.defects.run import DEFECT_SEEDS, SEEDS, Trial, kept

NAMED_ONLY = {Defect.GAP: "no samples"}
"""Defects that are no fault of a twin, and count as detected where a statement with these words names them."""


def detected(defect: Defect, one: Mapping[str, Any]) -> bool:
    """Whether a campaign was refused, a line of it stands in the way, or the defect is one that a statement names."""
    words = NAMED_ONLY.get(defect)
    named = words is not None and any(words in text for text in one.get("statements", ()))
    return "refused" in one or bool(one["no"]) or named


def trial_of(defect: Defect, size: float, seed: int) -> Trial:
    return Trial(seed, defect.value, size=None if size == DEFECTS[defect].size else size)


def limits(outcomes: Mapping[str, Any]) -> Iterator[DetectionLimit]:
    """One limit for each defect and sign of which every size of the ladder has been tried with all seeds."""
    for defect in Defect:
        for sign in (1.0, -1.0):
            sizes = [x for x in DEFECTS[defect].ladder if x * sign > 0.0]
            tried = [[outcomes.get(trial_of(defect, x, seed).key) for seed in DEFECT_SEEDS] for x in sizes]
            if not sizes or any(one is None for row in tried for one in row):
                continue
            smallest = None
            for x, row in zip(reversed(sizes), reversed(tried), strict=True):
                if not all(detected(defect, one) for one in row if one is not None):
                    break
                smallest = x
            text = defect_text(defect, sizes[-1] if smallest is None else smallest)
            yield DetectionLimit(
                defect.value, smallest, sizes[-1], text, defect_text(defect, sizes[-1]), len(DEFECT_SEEDS)
            )


def table_of(outcomes: Mapping[str, Any]) -> DetectionLimits:
    """The whole table; campaigns of several states of the code are named so."""
    found = list(limits(outcomes))
    sound = [outcomes[t.key] for t in map(Trial, SEEDS) if t.key in outcomes]
    codes = sorted({one["code"] for one in outcomes.values()})
    code = codes[0] if len(codes) == 1 else f"{len(codes)} states"
    date = max((one.get("date", "") for one in outcomes.values()), default="")
    return DetectionLimits(
        code, date, len(sound), sum("refused" in one or bool(one["no"]) for one in sound), tuple(found)
    )


def text_of(table: DetectionLimits) -> str:
    """The table as TOML."""
    lines = [
        "# Written by trials/defects/detection_limits.py: do not edit.",
        f"code = {json.dumps(table.code)}",
        f'date = "{table.date}"',
    ]
    lines += [f"healthy = {table.healthy}", f"refused = {table.refused}"]
    for row in table.limits:
        lines += ["", "[[limit]]", f'defect = "{row.defect}"']
        lines += [] if row.smallest is None else [f"smallest = {float(row.smallest)!r}"]
        lines += [f"largest = {float(row.largest)!r}", f"smallest_text = {json.dumps(row.smallest_text)}"]
        lines += [f"largest_text = {json.dumps(row.largest_text)}", f"campaigns = {row.campaigns}"]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    LIMITS_FILE.write_text(text_of(table_of(kept())), encoding="utf-8", newline="\n")
