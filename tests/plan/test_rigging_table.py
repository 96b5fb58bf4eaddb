"""Rated loads of rigging in a table: as working loads, or as breaking loads with a factor."""

import pytest

from stillhook.errors import PlanError
from stillhook.formats.lift.rigging_table import read_items
from stillhook.physics.scalar import G

ROUNDING = 1e-9


def items(tmp_path, text):
    file = tmp_path / "rigging.csv"
    file.write_text(text, encoding="utf-8")
    return read_items(file)


def test_breaking_loads_alone_are_enough_with_their_factor(tmp_path):
    (shackle,) = items(tmp_path, "item,kind,MBL [t],factor [1]\nshackle 1,shackle,425,5\n")
    assert (shackle.MBL, shackle.factor) == (pytest.approx(425e3 * G, rel=ROUNDING), 5.0)
    assert shackle.WLL is None


def test_working_loads_alone_are_enough(tmp_path):
    (shackle,) = items(tmp_path, "item,kind,WLL [t]\nshackle 1,shackle,85\n")
    assert shackle.WLL == pytest.approx(85e3 * G, rel=ROUNDING)


def test_a_table_without_either_says_what_to_add(tmp_path):
    with pytest.raises(PlanError, match=r"Add WLL, or MBL and factor\.$"):
        items(tmp_path, "item,kind,factor [1]\nshackle 1,shackle,5\n")
