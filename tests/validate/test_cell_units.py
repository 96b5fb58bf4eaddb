"""A load cell whose error is a factor: the unit that its column is in, whatever unit it was read as."""

import math
from itertools import permutations
from types import SimpleNamespace

import pytest

from stillhook.statistics.estimate import Estimate
from stillhook.validate.parameters.hoisting import Cell, cell_causes

G = 9.80665
NEWTON = {"N": 1.0, "kN": 1e3, "MN": 1e6, "t": 1e3 * G}
WEIGHT = 1.0e6
"""Of hook and payload [N]."""


def causes(read, gain, *, m_wire=0.0):
    """Of one test whose cell shows so many times the weight, its column read as a unit (None: not mapped)."""
    row = None if read is None else SimpleNamespace(unit=read, scale=1.0)
    part = SimpleNamespace(
        test="lift",
        record=SimpleNamespace(
            log=SimpleNamespace(mapping={"F_w": row} if row else {"p_a": SimpleNamespace(unit="bar")})
        ),
        segment=SimpleNamespace(s_w=100.0),
        params=SimpleNamespace(hoist=SimpleNamespace(drum=SimpleNamespace(m_wire=m_wire))),
        crane=SimpleNamespace(SWL=250e3, hook_mass=3e3),
    )
    value = Estimate(gain * WEIGHT, gain * WEIGHT, gain * WEIGHT)
    cell = Cell("lift", value, WEIGHT, Estimate(gain - 1.0, gain - 1.0, gain - 1.0), False)
    return cell_causes([cell], [part])


@pytest.mark.parametrize(("read", "true"), [pair for pair in permutations(NEWTON, 2) if pair[0] != "t"])
def test_a_column_that_was_read_as_another_unit_is_named_with_both(read, true):
    (note,) = causes(read, NEWTON[read] / NEWTON[true])
    assert (note.code, note.values["unit"], note.values["read"]) == ("cell-unit", true, read)


def test_a_signal_without_a_row_of_its_own_was_read_in_kilonewtons():
    (note,) = causes(None, NEWTON["kN"] / NEWTON["t"])
    assert (note.values["unit"], note.values["read"]) == ("t", "kN")


def test_a_factor_that_is_no_unit_is_a_gain():
    (note,) = causes("kN", 1.5)
    assert note.code == "cell-gain"
    assert math.isclose(note.values["gain"], 1.5)


def test_a_cell_that_counts_the_other_way_is_negative():
    (note,) = causes("kN", -1.0)
    assert note.code == "cell-negative"


def test_an_excess_of_the_wires_weight_is_the_wire():
    m_wire = 50.0  # [kg/m], 5 % of the weight
    (note,) = causes("kN", 1.0 + m_wire * 100.0 * G / WEIGHT, m_wire=m_wire)
    assert note.code == "cell-wire"
    assert math.isclose(note.values["wire"], m_wire * 100.0)


def test_a_lack_of_the_hooks_weight_is_a_tared_cell():
    (note,) = causes("kN", 1.0 - 3e3 * G / WEIGHT)
    assert note.code == "cell-tared"
