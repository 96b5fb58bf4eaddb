"""A tuning keeps a quarter of its budget for the simplex, whatever the budget."""

from __future__ import annotations

import numpy as np
import pytest

from stillhook.analysis.tuning.parameters import Setting
from stillhook.analysis.tuning.search import LEAST_MEMBERS, Search


class Bowl(Search):
    """A search whose rank is the distance from a point of the unit cube: no winch runs."""

    def __init__(self, budget: int, settings: int) -> None:
        self.budget, self.evaluations = budget, 1
        self.settings = tuple(Setting(f"s{i}", 0.0, 1.0) for i in range(settings))
        self.x_0, self.progress = np.full(settings, 0.5), None
        self.points: list[np.ndarray] = []
        self.generations: list[int] = []

    def _strong(self) -> np.ndarray:
        return np.full(len(self.settings), 0.7)

    def _run(self, points: np.ndarray) -> np.ndarray:
        self.points += [*points]
        self.generations.append(len(points))
        return np.sum((points - 0.3) ** 2, axis=1)


@pytest.mark.parametrize(("budget", "settings"), [(60, 2), (121, 3), (200, 4), (400, 8)])
def test_a_quarter_of_the_budget_is_left_for_the_simplex(budget: int, settings: int) -> None:
    """No less, and no more than a further generation would need."""
    search = Bowl(budget, settings)
    search.evolve(seed=1)
    generation = max(LEAST_MEMBERS, 2 * settings)
    assert budget / 4 <= budget - (search.evaluations - 1) < budget / 4 + generation


def test_a_third_of_the_first_population_lies_around_the_start_and_a_third_around_the_strong_guess() -> None:
    """Both of them are tried themselves."""
    search = Bowl(60, 2)
    search.evolve(seed=1)
    first = np.array(search.points[:LEAST_MEMBERS])
    for centre in (search.x_0, search._strong()):
        from_it = np.max(np.abs(first - centre), axis=1)
        assert np.sum(from_it == 0.0) == 1
        assert np.sum(from_it < 0.1) >= LEAST_MEMBERS // 3


@pytest.mark.parametrize("budget", [20, 30, 44])
def test_a_small_budget_is_not_exceeded_before_the_simplex(budget: int) -> None:
    """Its population is a quarter of it, so that a generation follows the first."""
    search = Bowl(budget, 2)
    search.evolve(seed=1)
    assert search.evaluations - 1 <= 0.75 * budget
    assert search.generations[0] == budget // 4
    assert len(search.generations) >= 2
