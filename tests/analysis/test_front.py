"""The front of a tuning: what no other setting beats in both error and pressure."""

import itertools
from types import SimpleNamespace

from stillhook.analysis.tuning.comparison import front

POINTS = ((1.0, 5.0), (2.0, 3.0), (2.5, 4.0), (3.0, 3.0), (4.0, 1.0))
"""Highest pressure and mean error of each."""


def trials(points, broken=()):
    return [
        SimpleNamespace(values=(p,), score=SimpleNamespace(p_max=p, e_c_pp_mean=e, broken=bool((p, e) in broken)))
        for p, e in points
    ]


def test_what_is_on_the_front_is_beaten_by_nothing_and_the_rest_by_something_on_it():
    for points in itertools.permutations(POINTS):
        found = [(point.p_max, point.e_c_pp_mean) for point in front(trials(points), ["K_p"])]
        assert found == [(1.0, 5.0), (2.0, 3.0), (4.0, 1.0)], points


def test_a_setting_that_breaks_a_limit_beats_nothing_and_values_stay_with_their_names():
    found = front(trials(POINTS, broken=[(2.0, 3.0)]), ["K_p"])
    assert [point.values["K_p"] for point in found] == [1.0, 2.5, 3.0, 4.0]
    assert front([], ["K_p"]) == []
