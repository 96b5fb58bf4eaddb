"""The weight of the wire out, computed from crane and depth, in the load of friction tests."""

import dataclasses
import math

import numpy as np
import pytest
from tests.identify.refusals import refused

from stillhook import load_crane
from stillhook.engine.pack.lift import RHO_STEEL, wire_carried
from stillhook.identify.system_friction.campaign import load_campaign
from stillhook.identify.system_friction.measure import LOAD_CODE, carried, measure
from stillhook.physics.scalar import G
from stillhook.spec.scenario import RHO_SEA
from stillhook.units import parse

CRANE = load_crane("nov-150t")
MU = CRANE.wire.mass_per_length
H_TIP = 30.0
KNOWN = 0.01  # of the carried weight: the ramps and the noise of the staircase
DP = 120e5  # Pa, load of the staircase of conftest
D_6 = CRANE.drum.d + 11.0 * CRANE.wire.d  # diameter of layer 6
WIRE_A_TURN = 0.2  # m, of the staircase's motors
D_M, COUNT = parse("215 cm^3/rev", "displacement"), 11


def test_wire_in_air_weighs_what_it_is_and_wire_in_water_that_less_the_water_that_its_steel_displaces():
    in_water = 1000.0 * (MU - RHO_SEA * MU / RHO_STEEL)
    assert wire_carried(CRANE, 1030.0, H_TIP) == pytest.approx(30.0 * MU + in_water)
    assert wire_carried(CRANE, 20.0, H_TIP) == pytest.approx(20.0 * MU)  # the hook is in air
    assert wire_carried(CRANE, -0.3, H_TIP) == 0.0
    assert 0.86 < (wire_carried(CRANE, 1031.0, H_TIP) - wire_carried(CRANE, 1030.0, H_TIP)) / MU < 0.88


def campaign(folder, make_staircase, more: str, *, s_w_0: float | None = 1030.0, load: float = 40.0):
    """A campaign of one test: the staircase of conftest with its wire moved to s_w_0, or without a wire signal (None)."""
    log = make_staircase(regular=True)
    if s_w_0 is None:
        log = dataclasses.replace(log, columns={k: v for k, v in log.columns.items() if k != "s_w"})
    else:
        log = log.with_columns(s_w=(log["s_w"] - log["s_w"][0]) * math.pi * D_6 / CRANE.i_hD / WIRE_A_TURN + s_w_0)
    log.write(folder / "1.csv", header=",".join(log.columns))
    wire = "" if s_w_0 is None else 's_w = { column = "s_w", unit = "m" }\n'
    path = folder / "campaign.toml"
    path.write_text(
        'crane = "nov-150t"\nmotors = 11\n[signals]\ntime = { column = "time", unit = "s" }\np_a = { column = "p_a", unit = "bar" }\n'
        f'p_b = {{ column = "p_b", unit = "bar" }}\nomega_m = {{ column = "omega_m", unit = "rev/min" }}\n{wire}'
        f'[[test]]\nname = "1"\nlog = "1.csv"\nD_m = "215 cm^3/rev"\nload = "{load:.4f} t"\n{more}\n'
    )
    return load_campaign(path)


def measured(*of, **more):
    c = campaign(*of, **more)
    return measure(c, c.tests[0])


def on_hook(d: float, wire: float) -> float:
    """Load on the hook [t] that the pressures of the staircase carry on a layer of diameter d [m] with so much wire [kg]."""
    return (COUNT * D_M * DP * CRANE.i_hD / (0.5 * d) / G - CRANE.hook_mass - wire) / 1e3


@pytest.fixture(scope="module")
def deep(make_staircase, tmp_path_factory):
    """Payload that the staircase carries with 1,030 m of wire out, and the campaign that states it with its depth."""
    folder = tmp_path_factory.mktemp("deep")
    load = on_hook(D_6, 30.0 * MU + 1000.0 * MU * (1.0 - RHO_SEA / RHO_STEEL))
    return load, folder


def loads_in_doubt(m):
    return [n for n in m.notes if n.code == LOAD_CODE]


@pytest.mark.slow
@pytest.mark.parametrize("more", ['layer = 6\ndepth = "1000 m"', 'layer = 6\nh_tip = "30 m"'])
def test_at_1000_m_the_wire_is_part_of_the_load_where_the_file_says_how_deep_the_hook_is(deep, make_staircase, more):
    load, folder = deep
    c = campaign(folder, make_staircase, more, load=load)
    m = measure(c, c.tests[0])
    assert loads_in_doubt(m) == []
    out = np.array([0.5 * (p.up.others["s_w"] + p.down.others["s_w"]) for p in m.pairs.pairs])
    assert m.test.wire == pytest.approx(30.0 * MU + (out.mean() - 30.0) * MU * (1.0 - RHO_SEA / RHO_STEEL))
    assert carried(c, m.test, m.points) == pytest.approx(1e3 * load, abs=KNOWN * (1e3 * load + m.test.wire))
    assert np.ptp(m.points.T_d) > 0.0  # every pair has the wire that was out there
    (text,) = (n.text for n in m.notes if n.code == "wire weight")
    assert f"and {m.test.wire / 1e3:.3g} t of wire (30 m in air, " in text


@pytest.mark.slow
def test_at_1000_m_a_load_without_its_wire_contradicts_the_pressures(deep, make_staircase):
    load, folder = deep
    c = campaign(folder, make_staircase, "layer = 6", load=load)
    (note,) = loads_in_doubt(measure(c, c.tests[0]))
    assert note.severe
    assert "check load, hook, depth, layer" in note.text


@pytest.mark.slow
def test_depth_and_height_of_the_tip_together_tell_the_wire_out_where_no_signal_does(deep, make_staircase, tmp_path):
    load, _ = deep
    c = campaign(tmp_path, make_staircase, 'layer = 6\ndepth = "1000 m"\nh_tip = "30 m"', s_w_0=None, load=load)
    m = measure(c, c.tests[0])
    assert m.test.wire == pytest.approx(wire_carried(CRANE, 1030.0, H_TIP))
    assert loads_in_doubt(m) == []
    assert c.weight(m.test) == pytest.approx((1e3 * load + CRANE.hook_mass + m.test.wire) * G)
    stated = campaign(tmp_path, make_staircase, 's_w = "1030 m"\ndepth = "1000 m"', s_w_0=None, load=load)
    assert measure(stated, stated.tests[0]).test.wire == pytest.approx(m.test.wire)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("more", "s_w_0", "line"),
    [
        ('depth = "-1 m"', 1030.0, 'depth = "-1 m": it must be greater than or equal to 0'),
        ('h_tip = "-1 m"', 1030.0, 'h_tip = "-1 m": it must be greater than or equal to 0'),
        ('depth = "1000 m"', None, "depth: alone it does not determine the wire out. Give h_tip too, or s_w, or map"),
        ('h_tip = "30 m"', None, "h_tip: alone it does not determine the wire out. Give depth too, or s_w, or map"),
        ('s_w = "900 m"\ndepth = "1000 m"', None, "depth 1000 m: more than the wire out, 900 m. Check depth and s_w."),
        ('depth = "1100 m"', 1030.0, "depth 1100 m: more than the wire out, 1030 m. Check depth and s_w."),
        ('depth = "1000 m"\nh_tip = "30 m"', 1030.0, "both given where the wire out (1030 m) is known as well."),
        ("depth = 1000", 1030.0, "depth = 1000: a bare number; write it as text with its unit"),
    ],
)
def test_what_cannot_be_is_one_line(tmp_path, make_staircase, more, s_w_0, line):
    more = more if more.startswith("s_w") else f"layer = 6\n{more}"
    problem = refused(measured, tmp_path, make_staircase, more, s_w_0=s_w_0)
    assert problem.startswith('campaign.toml: test "1": ')
    assert line in problem
