"""Virtual sensors: the twin's numbers with an uncertainty from the measured signals beside them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import stillhook
from stillhook.live.demo import with_friction
from stillhook.live.watch.virtual import VirtualSensor, VirtualSensors, formulas_of, sensors_of
from stillhook.units import KINDS
from stillhook.variables import SERIES

CRANES = ("nov-250t", "nov-100t-pure-active", "nov-250t-secondary", "nov-100t-cylinder", "nov-100t-electric")
CRANES += ("utility-20t-open-circuit",)
CRANE = stillhook.load_crane("nov-250t")
TIP = stillhook.Sine(height="1.2 m", period="9 s")
CASE = stillhook.Scenario(load="140 t", s_w="600 m", mode="ssc", duration="120 s", tip=TIP)


def rows_of(crane: stillhook.Crane) -> list[dict[str, float]]:
    run = stillhook.simulate(crane, CASE, every="0.1 s")
    names = [n for n in run.data_vars if run[n].dims == ("time",)]
    return [dict(zip(names, x, strict=True)) for x in np.column_stack([run[n].values for n in names]).tolist()]


TWIN = rows_of(CRANE)


@pytest.mark.parametrize("name", CRANES)
def test_every_winch_type_has_sensors_whose_units_and_formulas_are_known(name: str):
    crane = stillhook.load_crane(name)
    common = {v.name for v in SERIES}
    known = common | {row.name for row in crane.plant.type.rows}
    for s in sensors_of(crane):
        assert s.kind in KINDS
        assert s.value in formulas_of(crane) or s.value in known
        assert s.error in formulas_of(crane) or s.error in known
        assert set(s.beside) <= known


def test_flow_of_the_motors_is_that_of_displacement_and_speed():
    row = TWIN[600]
    motors = CRANE.active.motor
    q = motors.count * motors.D_max * row["alpha_m"] * row["omega_m"]
    (reading,) = [r for r in VirtualSensors(CRANE).read(row) if r.name == "Q_m"]
    assert reading.value == pytest.approx(q)


@pytest.mark.parametrize(("hidden", "beside"), [("p_a", "p_b"), ("p_b", "p_a")])
def test_a_pressure_that_was_hidden_is_within_what_the_other_line_says(hidden: str, beside: str):
    crane = rows_of(with_friction(CRANE, 1.3))
    sensor = VirtualSensor(hidden, "pressure", hidden, beside, (beside,), "")
    virtual, inside, n = VirtualSensors(CRANE, sensors=(sensor,)), 0, 0
    for m, s in zip(crane[100:], TWIN[100:], strict=True):
        virtual.add({k: v for k, v in m.items() if k != hidden}, s)
        (r,) = virtual.read(s)
        if r.valid:
            n += 1
            inside += abs(m[hidden] - r.value) <= r.half
    assert n > 700
    assert inside / n > 0.9


def test_without_a_measured_signal_beside_it_no_sensor_is_valid():
    virtual = VirtualSensors(CRANE)
    for s in TWIN[100:600]:
        virtual.add({}, s)
    assert not any(r.valid for r in virtual.read(TWIN[600]))
    assert all(math.isnan(r.half) for r in virtual.read(TWIN[600]))


def test_no_sensor_is_valid_before_half_a_minute_or_while_an_alarm_is_on():
    virtual = VirtualSensors(CRANE)
    for k, s in enumerate(TWIN[100:500]):
        if k == 290:
            assert not any(r.valid for r in virtual.read(s))
        virtual.add(s, s)
    now = virtual.read(TWIN[500])
    assert all(r.valid for r in now)
    assert {r.name for r in now if r.half > 1e-9} == {"Q_leak", "V_gas"}  # the file's own numbers may be off
    assert all(r.half < 0.31 * abs(r.value) for r in now)
    assert {(r.valid, r.reason) for r in virtual.read(TWIN[500], "alarm p_a")} == {(False, "alarm p_a")}


def test_uncertainty_grows_with_the_deviation_beside_it():
    halves = []
    for gain in (1.01, 1.05):
        virtual = VirtualSensors(CRANE)
        for s in TWIN[100:500]:
            virtual.add({**s, "p_hp": gain * s["p_hp"]}, s)
        halves.append(next(r.half for r in virtual.read(TWIN[500]) if r.name == "T_gas"))
    assert halves[1] == pytest.approx(5.0 * halves[0], rel=0.1)
