"""Years of many cranes, resumable: python -m trials.condition.run [group] [--new] [number].

Groups: wear, still. Outcomes in `outcomes.json`; seeds below 1100 were looked at while this was written.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.live.condition.drift import MARGIN, drift_of
from stillhook.live.condition.followed import FOLLOWED
from stillhook.live.condition.walk import course
from stillhook.statistics.estimate import ENDS
from trials import store
from trials.condition.years import CERTIFIED, LIMITS, YEARS, dates, life

OUTCOMES = Path(__file__).with_name("outcomes.json")
FIRST, CRANES = 2000, {"wear": 100, "still": 100}
EVERY = 1.0 / 6.0
"""Years between campaigns."""
LOOKS = (1.0, 2.0, 3.0, YEARS)
"""Years after which intervals are judged."""


class Trial(NamedTuple):
    """A crane of a group."""

    group: str
    seed: int


def trials(first: int = FIRST) -> dict[str, Trial]:
    """Every crane by its key."""
    most = max(CRANES.values())
    return {f"{g}-{s}": Trial(g, s) for s in range(first, first + most) for g, n in CRANES.items() if s < first + n}


def outcome(trial: Trial) -> dict[str, Any]:
    """The years of one crane. looks: by number, after so many years, whether the 95 % intervals of today's value and of
    the trend hold the truth, their half widths and errors; drift: by number, when the level left the margin and the
    limit, and when drift was shown."""
    rng = np.random.default_rng([trial.seed, list(CRANES).index(trial.group)])
    t = dates(rng, EVERY)
    out: dict[str, Any] = {"years": float(t[-1] - t[CERTIFIED]), "looks": {}, "drift": {}}
    for name, limit in LIMITS.items():
        wears = trial.group == "wear"
        x = life(name, t, rng, wears=wears, repaired=wears and rng.random() < 0.4, changed=bool(rng.random() < 0.3))
        stated = [x.repair] if x.stated and np.isfinite(x.repair) else []
        shown = None
        for n in range(CERTIFIED + 2, len(t) + 1):
            look = next((y for y in LOOKS if t[n - 1] >= y > t[n - 2]), YEARS if n == len(t) else None)
            if shown is not None and look is None:
                continue
            c = course(FOLLOWED[name], x.points[:n], stated if stated and stated[0] <= t[n - 1] else [])
            if shown is None and drift_of(c, float(t[CERTIFIED]), limit, len(LIMITS)).shown:
                shown = float(t[n - 1])
            if look is not None:
                out["looks"][f"{name}-{look:g}"] = _look(c, x, n)
        away = np.abs(x.level - x.level[CERTIFIED])
        away[: CERTIFIED + 1] = 0.0
        out["drift"][name] = {
            "shown": shown,
            "margin": _first(t, away > MARGIN * limit),
            "limit": _first(t, away > limit),
            "last": float(t[-1]),
        }
    return out


def _look(c: Any, x: Any, n: int) -> dict[str, Any]:
    i, t = n - 1, float(x.t[n - 1])
    value, trend = c.value(t), c.trend(t)
    row: dict[str, Any] = {}
    for key, mixture, true in (("today", value, x.level[i] + x.season[i]), ("trend", trend, x.slope[i])):
        low, high = mixture.quantile(ENDS[0]), mixture.quantile(ENDS[1])
        row[key] = {
            "holds": bool(low <= true <= high),
            "half": _short(0.5 * (high - low)),
            "error": _short(0.5 * (low + high) - float(true)),
            "true": _short(float(true)),
            "shown": not low <= 0.0 <= high,
        }
    row["steps"] = len(c.found)
    return row


def _short(x: float) -> float:
    return float(f"{x:.4g}")


def _first(t: Any, yes: Any) -> float | None:
    return float(t[np.argmax(yes)]) if yes.any() else None


def code() -> str:
    """Hash of what computes and judges."""
    import stillhook.live.condition as room

    digest = hashlib.sha256()
    folder = Path(str(room.__file__)).parent
    for path in sorted(
        [folder / n for n in ("walk.py", "drift.py", "followed.toml")] + list(Path(__file__).parent.glob("*.py"))
    ):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


if __name__ == "__main__":
    store.run(OUTCOMES, trials(), outcome, code(), sys.argv[1:], lambda key: key.split("-")[0], workers=1)
