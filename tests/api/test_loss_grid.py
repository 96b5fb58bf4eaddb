"""The grid of a motor's loss map: levels that rise from zero, and a loss for every combination."""

import pytest
from pydantic import ValidationError

from stillhook.winches.circuits.losses import LossModel

LEVELS = {
    "D_m": ("100 cm^3/rev", "200 cm^3/rev"),
    "omega_m": ("0 rev/min", "500 rev/min"),
    "dp_m": ("0 bar", "100 bar", "200 bar"),
}
LOSSES = tuple(f"{i} N m" for i in range(12))


def grid(**changed):
    return LossModel(**{"law": "map", "T_f": LOSSES, **LEVELS, **changed})


def test_a_level_may_be_zero():
    assert grid().omega_m[0] == 0.0


@pytest.mark.parametrize(
    "levels",
    [("1 bar", "1 bar", "2 bar"), ("2 bar", "1 bar", "3 bar")],
    ids=["twice", "falling"],
)
def test_levels_that_do_not_rise_are_refused(levels):
    with pytest.raises(ValidationError, match=r"dp_m: levels of a map rise, from 0 or above\. Sort them\."):
        grid(dp_m=levels)


@pytest.mark.parametrize("number", [11, 13])
def test_a_loss_belongs_to_every_combination(number):
    with pytest.raises(ValidationError, match=rf"T_f: {number} losses for 12 combinations of levels"):
        grid(T_f=(*LOSSES, "12 N m")[:number])
