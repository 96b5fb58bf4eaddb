"""What a controller knows of its crane is what the engine runs with, and is on the PLC."""

from __future__ import annotations

import math

import pytest
from tests.export.plc.cases import CLOSED, block_of

from stillhook import Scenario, load_crane
from stillhook.control.plant import Hydraulics, PlantParameters
from stillhook.engine.pack.winch import motor_speed_max, pack
from stillhook.errors import SpecError
from stillhook.export.plc.text import structured_text
from stillhook.library import cranes
from stillhook.physics.scalar import G
from stillhook.winches.checks import check_result
from stillhook.winches.load_path.load import shaft_inertia_without_wire


def known(name: str):
    crane = load_crane(name)
    case = Scenario(load=f"{0.3 * crane.SWL} kg", s_w="50 m", mode=crane.plant.type.default_mode)
    params = pack(crane, case).params
    return crane, params, params.plc.plant


@pytest.mark.parametrize("name", cranes())
def test_drum_load_and_inertia_are_those_of_the_run(name):
    _, params, plant = known(name)
    drum = params.hoist.drum
    assert (plant.r_drum, plant.d_max, plant.d_wire) == (0.5 * drum.d, drum.d_max, drum.d_wire)
    assert (plant.layers, plant.turns, plant.m_wire) == (drum.layers, drum.turns, drum.m_wire)
    assert plant.i_hD * params.hoist.i_i == pytest.approx(1.0)
    assert pytest.approx(shaft_inertia_without_wire(params.hoist)) == plant.J
    assert plant.SWL + plant.m_hook * G == pytest.approx(1.0 / params.plc.motors.i_F_swl)
    assert all(math.isfinite(x) and x >= 0.0 for x in plant)


@pytest.mark.parametrize("name", cranes())
def test_hydraulics_are_those_of_the_winch_and_nothing_where_it_has_none(name):
    crane, params, plant = known(name)
    kind = crane.plant.type.name
    if kind == "electric":
        assert plant[: len(Hydraulics._fields)] == (0.0,) * len(Hydraulics._fields)
    elif kind == "cylinder":
        assert (plant.D_m, plant.Q_p, plant.i_C_h) == (0.0, params.cylinder.Q_p, 0.0)
    elif kind in ("secondary", "digital"):
        settings = params.rail.settings
        assert (plant.D_m, plant.Q_p, plant.Q_pp, plant.i_C_h) == (settings.D_m_max, 0.0, settings.Q_p_max, 0.0)
    else:
        assert plant.Q_p / plant.D_m == pytest.approx(motor_speed_max(crane))
        circuit = params.A if kind == "open-circuit" else params.active
        assert circuit.i_C_h == plant.i_C_h
    if kind == "active-passive":
        assert (plant.D_pm, plant.Q_pp) == (params.passive.settings.D_m_max, params.passive.settings.Q_p_max)


def test_a_plc_has_them_as_constants_with_their_meaning():
    text = structured_text(block_of(CLOSED, "ssc"))
    text = text[text.index("PlantParameters") :].partition("END_STRUCT")[0]
    plant = known(CLOSED)[2]
    for field in PlantParameters._fields:
        line = next(line for line in text.splitlines() if line.strip().lower().startswith(f"{field} : lreal".lower()))
        assert float(line.split(":=")[1].split(";")[0]) == getattr(plant, field), field
        assert "(*" in line


@pytest.mark.parametrize("given", [(1.0, 2.0), Hydraulics(D_m=-1e-4), Hydraulics(Q_p=math.nan)])
def test_a_winch_that_says_what_cannot_be_of_its_hydraulics_is_refused_in_one_line(given):
    module = load_crane("nov-100t-electric").plant.type.module
    with pytest.raises(
        SpecError, match=r"hydraulics gave .*It must give a stillhook.control.plant.Hydraulics"
    ) as fault:
        check_result(module, "hydraulics", lambda crane: given, None)
    assert "\n" not in str(fault.value)
