"""Does validation find what is wrong, and leave alone what is right? Tables from campaigns of a known truth
(`trials/defects/run.py`)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from blocks import Blocks, table

from trials.campaigns import Defect
from trials.campaigns.defects import DEFECTS, defect_text, size_text
from trials.defects.detection_limits import limits
from trials.defects.run import APART, DEFECT_SEEDS, SEEDS, Trial, kept
from trials.store import states_of

SCRIPT = "truth_defects"

MOST_FALSE = 5
"""False alarms of a hundred that are tolerated."""
PAPER_MEAN, PAPER_S = 0.033, 0.015  # m, paper F
TUNED = {"C_h": ("capacitance", "capacitance"), "C_leak": ("leakage", "leakage"), "J_m_eff": ("inertia", "inertia")}
"""Name of a tuned number -> what it is, and its place in the truth (each as a multiple of the twin's)."""
LEAST_HELD, MOST_HELD = 0.90, 0.98
"""Between what shares of the 95 % intervals must hold the true value."""
FEWEST = 50
"""Intervals below which a share says little."""
CLOSE = 0.05
NAMES: Mapping[Defect, tuple[str, ...]] = {
    Defect.LEAKAGE: ("leak",),
    Defect.FRICTION: ("friction",),
    Defect.LAYER: ("layer",),
    Defect.GEAR: ("gear",),
    Defect.PRESSURE_LINES: ("p_a", "p_b"),
    Defect.MRU_DELAY: ("delay", "later"),
    Defect.MOTOR_OFFSET: ("offset", "above their command"),
    Defect.K_1: ("K_1",),
    Defect.CLOCK: ("clock", "time scale"),
    Defect.SATURATION: ("commands stop at", "holds the pump command"),
    Defect.GAP: ("gap", "no samples", "missing"),
    Defect.LOAD_CELL: ("the column is in",),
    Defect.PRECHARGE: ("precharge",),
    Defect.GAS_VOLUME: ("gas volume", "volume of gas", "m^3 of gas"),
    Defect.PASSIVE_MOTORS: ("passive motors", "dead"),
    Defect.MOTOR_COUNT: ("passive motors", "number of motors"),
    Defect.ACTIVE_COUNT: ("active motors", "displacement", "number of motors", "motor flow"),
    Defect.SENSOR_A: ("transmitter", "p_a", "pressures A and B"),
    Defect.LEAK_CONSTANT: ("leak",),
    Defect.LEAK_STROKE: ("leak",),
    Defect.LEAK_SPEED: ("leak",),
    Defect.DISPLACEMENT: ("displacement", "motor flow"),
    Defect.BOOST: ("boost",),
}
"""Words of which one must stand in a line or statement that names the defect."""
LONGEST = 200


def found_of(trials: Iterator[Trial], outcomes: Mapping[str, Any]) -> list[dict[str, Any]]:
    return [outcomes[t.key] for t in trials if t.key in outcomes]


def no_of(one: Mapping[str, Any]) -> list[str]:
    """Lines that stand in the way; "refused" where the campaign was not accepted at all."""
    return ["refused"] if "refused" in one else list(one["no"])


def naming(defect: Defect, one: Mapping[str, Any]) -> str:
    """What names the defect, empty where nothing does: a refusal, a failed line (what it is of, and its note), or a
    statement."""
    lines = list(one.get("no", {}).values())
    rest = [one["refused"]] if "refused" in one else one.get("statements", ())
    for text in lines:
        what, *notes = text.split("; ")
        hit = next((n for n in reversed(notes) if speaks_of(defect, n)), "")
        if hit or speaks_of(defect, what):
            return "; ".join(part for part in (what.split(" (95 %")[0], hit) if part)
    return next((t for t in rest if speaks_of(defect, t) and not t.startswith("Within limits")), "")


def speaks_of(defect: Defect, text: str) -> bool:
    return any(word.lower() in text.lower() for word in NAMES[defect])


def short(text: str) -> str:
    text = text.replace("|", "/")
    return text if len(text) <= LONGEST else text[: LONGEST - 3].rsplit(" ", 1)[0] + " ..."


def defect_rows(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    for defect in Defect:
        found = found_of((Trial(s, defect.value) for s in DEFECT_SEEDS), outcomes)
        no = Counter(key for one in found for key in no_of(one))
        lines = ", ".join(f"`{key}`" + (f" ({n})" if n < len(found) else "") for key, n in no.most_common()) or "none"
        if not found:
            yield defect_text(defect), "not run yet", "", ""
            continue
        named = [text for one in found if (text := naming(defect, one))]
        turned = sum(bool(no_of(one)) for one in found)
        yield defect_text(defect), f"{turned} of {len(found)}", lines, short(named[0]) if named else "**no**"


def caught(outcomes: Mapping[str, Any]) -> tuple[int, int]:
    """Defects that every campaign turns down or names, and defects with campaigns."""
    good = all_ = 0
    for defect in Defect:
        found = found_of((Trial(s, defect.value) for s in DEFECT_SEEDS), outcomes)
        all_ += bool(found)
        good += bool(found) and all(no_of(one) or naming(defect, one) for one in found)
    return good, all_


def false_rows(found: list[dict[str, Any]]) -> Iterator[tuple[str, ...]]:
    counted = Counter(key for one in found for key in no_of(one))
    if not counted:
        yield "none", "0"
    for key, n in counted.most_common():
        yield f"`{key}`", str(n)


def numbers(found: list[dict[str, Any]], key: str) -> np.ndarray:
    """Values of a line over campaigns."""
    return np.array([one["figures"][key][0] for one in found if key in one.get("figures", {})], dtype=float)


def range_of(x: np.ndarray, theirs: float) -> tuple[str, str]:
    """Range over campaigns in cm, and how it compares."""
    if not len(x):
        return "", "not run yet"
    verdict = "below, on simulated logs" if x.max() <= theirs else f"below in {int((x <= theirs).sum())} of {len(x)}"
    return f"{100.0 * x.min():.1f} to {100.0 * x.max():.1f} cm", verdict


def tuned_rows(groups: Mapping[str, list[dict[str, Any]]]) -> Iterator[tuple[str, ...]]:
    for label, found in groups.items():
        for name, (what, truth) in TUNED.items():
            rows = [
                (*one["tuned"][name], one["truth"][truth])
                for one in found
                if one.get("tuned", {}).get(name, [None])[0] is not None
            ]
            if not rows:
                continue
            factor, low, high, true = np.array(rows, dtype=float).T
            error = factor / true - 1.0
            inside = int(((low <= true) & (true <= high)).sum())
            close = int((np.abs(error) <= CLOSE).sum())
            middle, least, most = 100.0 * np.median(error), 100.0 * error.min(), 100.0 * error.max()
            spread = f"{middle:+.1f} % ({least:+.1f} to {most:+.1f} %)".replace("-", "−")
            yield label, what, spread, f"{close} of {len(rows)}", f"{inside} of {len(rows)}"


def covered(found: list[dict[str, Any]]) -> dict[str, list[tuple[bool, float]]]:
    """For each interval that is printed and whose true value is known: whether it holds it, and half of its width
    [SI]."""
    out: dict[str, list[tuple[bool, float]]] = {}
    for one in found:
        for name, _, true, _, low, high in one.get("measured", ()):
            out.setdefault(name, []).append((low <= true <= high, 0.5 * (high - low)))
        for name, (_, where) in TUNED.items():
            factor, low, high = one.get("tuned", {}).get(name, (None, None, None))
            if None not in (factor, low, high):
                out.setdefault(f"tuned {name}", []).append((low <= one["truth"][where] <= high, 0.5 * (high - low)))
    return out


def coverage_rows(found: list[dict[str, Any]]) -> Iterator[tuple[str, ...]]:
    for name, held in sorted(covered(found).items()):
        share, n = sum(inside for inside, _ in held) / len(held), len(held)
        width = float(np.median([half for _, half in held]))
        narrow = "too narrow" if share < LEAST_HELD else "wide"
        judged = "few" if n < FEWEST else "yes" if LEAST_HELD <= share <= MOST_HELD else narrow
        yield f"`{name}`", f"{100.0 * share:.0f} % of {n}", f"{width:.2g}", judged


def limit_rows(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    for limit in limits(outcomes):
        seen = limit.smallest_text if limit.smallest is not None else f"not detectable up to: {limit.largest_text}"
        change = DEFECTS[defect := Defect(limit.defect)]
        sizes = [size_text(defect, x) if change.kind else f"{x:.3g}" for x in change.ladder]
        yield f"`{limit.defect}`", seen, ", ".join(sizes).replace("-", "−"), str(limit.campaigns)


def compute() -> tuple[Blocks, None]:
    outcomes = kept()
    right, apart = (
        found_of(iter(t), outcomes) for t in ([Trial(s) for s in SEEDS], [Trial(s, apart=True) for s in APART])
    )
    false = sum(bool(no_of(one)) for one in right)
    good, all_ = caught(outcomes)
    held = held_of(right)
    mean_range, s_range = range_of(numbers(right, "2b"), PAPER_MEAN), range_of(numbers(right, "2b-s"), PAPER_S)
    whole = "not all" if good < all_ else "reproduced" if good == len(Defect) else f"{len(Defect) - all_} not run yet"
    few = "not run yet" if not right else "reproduced" if false * 100 <= MOST_FALSE * len(right) else "too many"
    tuned = list(tuned_rows({"well matched": right, "10 to 30 % apart": apart}))

    return {
        "claims": locals(),
        "code": {"outcomes": outcomes, "states": states_of(outcomes)},
        "defects": defect_rows(outcomes),
        "limits": limit_rows(outcomes),
        "coverage": coverage_rows(right),
        "false-alarms": {"false": false, "right": right, "lines": table(("line", "campaigns"), false_rows(right))},
        "tuned": tuned,
    }, None


def held_of(found: list[dict[str, Any]]) -> tuple[str, str]:
    """Smallest and largest share of intervals that hold the true value, over all figures with enough of them; and the
    verdict."""
    shares = [sum(inside for inside, _ in held) / len(held) for held in covered(found).values() if len(held) >= FEWEST]
    if not shares:
        return "", "not run yet"
    span = f"{100.0 * min(shares):.0f} to {100.0 * max(shares):.0f} %"
    narrow, wide = sum(x < LEAST_HELD for x in shares), sum(x > MOST_HELD for x in shares)
    said = [f"{narrow} of {len(shares)} too narrow"] * bool(narrow) + [
        f"{wide} of {len(shares)} wider than needed"
    ] * bool(wide)
    return span, ", ".join(said) or "reproduced"
