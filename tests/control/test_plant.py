"""What a controller knows of its crane is what the engine runs with, and is on the PLC."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.export.plc.cases import CLOSED, block_of

from stillhook import Scenario, load_crane, simulate
from stillhook.analysis.uncertainty.draws import Drawing, Uncertainty, draws
from stillhook.control.plant import Hydraulics, PlantParameters
from stillhook.engine.pack.winch import motor_speed_max, pack, plant_parameters, set_up_for
from stillhook.errors import SpecError
from stillhook.export.plc.text import structured_text
from stillhook.library import changed, cranes
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


FRICTION = 0.2
"""Part by which the known friction is off that of a run: layer, displacement and pressures differ from what it holds
at."""


def test_known_friction_is_near_that_of_a_run_that_does_not_know_of_it():
    crane = load_crane("nov-250t")
    run = simulate(
        crane, Scenario(load="125 t", s_w="100 m", tip="sine 1 m 10 s", mode="ns", duration="60 s"), series=True
    )
    f, omega, T_f = plant_parameters(crane), np.abs(run.omega_m.values), np.abs(run.T_f.values)
    known = f.T_dry + f.T_stick * np.exp(-omega * f.i_omega_stick) + f.B * omega
    turning = omega > 10.0
    assert abs(np.mean(known[turning]) / np.mean(T_f[turning]) - 1.0) < FRICTION
    assert f.T_stick > 0.0
    assert f.B > 0.0
    assert plant_parameters(load_crane("nov-100t-electric")).T_dry == 0.0


def test_a_plc_that_was_set_up_for_another_crane_knows_the_numbers_of_that_one():
    crane = load_crane("nov-250t")
    worn = changed(crane, {"active": {"C_leak": "1 L/min/bar"}})
    case = Scenario(load="100 t", s_w="50 m", mode="ssc")
    params = pack(set_up_for(worn, crane), case).params
    assert params.plc.plant == plant_parameters(crane) != plant_parameters(worn)
    assert params.active == pack(worn, case).params.active


def test_in_every_draw_the_plc_knows_the_crane_that_it_was_set_up_for():
    crane, case = load_crane("nov-250t"), Scenario(load="100 t", s_w="50 m", mode="ssc")
    table = draws(Uncertainty.default(), 4)
    for drawn, of in Drawing(crane, case, table.columns).pairs(table.values):
        params = pack(drawn, of).params
        assert params.plc.plant == plant_parameters(crane)
        assert params.active.pumps != pack(crane, case).params.active.pumps


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
