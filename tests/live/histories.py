"""Histories whose every number follows from the number of its row, so that each row says whether it is right."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from stillhook.live.history import Budget, History

START = 1_795_867_200.0
"""2026-11-28T12:00 UTC, a full hour [s since 1970]."""
HOUR = 3600.0
COLUMNS = ("p_a", "omega_m", "F_w")


def numbers(first: int, n: int) -> np.ndarray:
    """(n, 3) values of rows from `first` on."""
    row = np.arange(first, first + n, dtype=np.float64)
    return np.stack([np.sqrt(row), -row / 3.0, np.sin(row) * 1e5], axis=1)


def write_hours(folder: Path, *, hours: float, budget: Budget | None = None) -> np.ndarray:
    """A row a minute in batches of 25; returns (n, 4) times and values."""
    n = round(hours * 60)
    t, x = START + 60.0 * np.arange(n), numbers(1, n)
    with History(folder, COLUMNS, budget=budget) as history:
        for k in range(0, n, 25):
            history.append(t[k : k + 25], x[k : k + 25])
    return np.column_stack([t, x])
