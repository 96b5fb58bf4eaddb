"""A crane test as a log: a staircase of hoisting and lowering at rising pump commands, with noise, for the tests of the importer."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

HOLD, PAUSE, RAMP = 20.0, 4.0, 1.5  # s: of a plateau, between two, of its ramp


@dataclass(frozen=True)
class Staircase:
    """Columns of a crane test in the units of a logger: time [s], p_a and p_b [bar], speed [rev/min], command [%], wire [m]."""

    columns: dict[str, np.ndarray] = field(default_factory=dict)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.columns[name]

    def __len__(self) -> int:
        return len(self["time"])

    def with_columns(self, **columns: np.ndarray) -> Staircase:
        return replace(self, columns={**self.columns, **columns})

    def rows(self, keep: np.ndarray) -> Staircase:
        return replace(self, columns={name: values[keep] for name, values in self.columns.items()})

    def cells(self, digits: int = 4) -> dict[str, list[str]]:
        return {name: [f"{value:.{digits}f}" for value in values] for name, values in self.columns.items()}

    def write(
        self, path: Path, *, separator: str = ",", cells: dict[str, list[str]] | None = None, header: str | None = None
    ) -> Path:
        """A CSV with headings that Stillhook knows, or a header of your own."""
        cells = cells or self.cells()
        heading = header if header is not None else separator.join(HEADINGS.get(name, name) for name in cells)
        lines = [separator.join(row) for row in zip(*cells.values(), strict=True)]
        path.write_text("\n".join([heading, *lines]) + "\n")
        return path


HEADINGS = {
    "time": "time [s]",
    "p_a": "p_a [bar]",
    "p_b": "p_b [bar]",
    "omega_m": "omega_m [rev/min]",
    "u_p": "u_p [%]",
    "s_w": "s_w [m]",
}


def make(
    seconds: float = 200.0,
    rate: float = 100.0,
    *,
    noise: float = 0.5,
    seed: int = 1,
    load: float = 120.0,
    regular: bool = False,
) -> Staircase:
    """Hoists and lowers in turn with a hanging load; friction of 15 bar and a little with speed on either side of it."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate)) / rate
    target = np.zeros_like(t)
    begin, step = 3.0, 0
    while begin < seconds:
        hold, pause = (
            (HOLD, PAUSE) if regular else (HOLD * rng.uniform(0.8, 1.1), PAUSE * rng.uniform(0.7, 1.5))
        )  # manually
        size = 0.15 + 0.05 * (step // 2)
        target[(t >= begin) & (t < begin + hold)] = size if step % 2 == 0 else -size
        begin, step = begin + hold + pause, step + 1
    width = max(1, round(RAMP * rate))
    u = np.convolve(np.pad(target, width), np.ones(width) / width, mode="same")[width:-width]
    speed = 2000.0 * u
    turning = np.tanh(speed / 20.0)
    dp = load + turning * (15.0 + 0.004 * np.abs(speed))
    columns = {
        "time": t,
        "p_a": 25.0 + dp + noise * rng.standard_normal(len(t)),
        "p_b": 25.0 + noise * rng.standard_normal(len(t)),
        "omega_m": speed + (0.004 * noise * 2000.0 * rng.standard_normal(len(t)) * (np.abs(speed) > 1.0)),
        "u_p": 100.0 * u,
        "s_w": 100.0 - np.cumsum(speed) / rate / 60.0 * 0.2,
    }
    return Staircase(columns)


@pytest.fixture(scope="session")
def staircase() -> Staircase:
    return make()


@pytest.fixture(scope="session")
def make_staircase():
    return make
