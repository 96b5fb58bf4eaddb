"""Current over depth and wind over height: directions, profiles, and the force of the wind."""

from __future__ import annotations

import math

import numpy as np
import pytest

from stillhook.sea.steady_flow import Current, Wind

PROFILE = {"depth": ["0 m", "100 m"], "speed": ["1 m/s", "0.5 m/s"], "area": "50 m^2"}


def current(**changes):
    return Current.model_validate({**PROFILE, "direction": "90 deg", "sense": "going-to"} | changes)


def wind(**changes):
    fields = {"speed": "9 m/s", "direction": "0 deg", "sense": "going-to", "area": "100 m^2", "C_S": 1.0}
    return Wind.model_validate(fields | changes)


def test_a_current_that_goes_to_port_is_one_that_comes_from_starboard():
    to = current().velocity(np.array([-50.0]))
    assert to[0] == pytest.approx((0.0, 0.75))
    assert current(sense="coming-from", direction="270 deg").velocity(np.array([-50.0])) == pytest.approx(to)


def test_between_depths_the_current_turns_the_shorter_way_and_keeps_its_speed():
    v = current(direction=["350 deg", "30 deg"], speed="0.8 m/s").velocity(np.array([-50.0]))[0]
    assert math.degrees(math.atan2(v[1], v[0])) == pytest.approx(10.0)
    assert np.hypot(*v) == pytest.approx(0.8)


def test_above_the_surface_there_is_no_current_and_below_the_profile_it_stays():
    assert current().velocity(np.array([2.0, 0.0, -300.0]))[:, 1] == pytest.approx((0.0, 1.0, 0.5))


@pytest.mark.parametrize(
    ("load", "area", "C_S", "table", "allowed"), [(85.0, 50.0, 1.2, 9.0, 11.73), (65.0, 200.0, 1.4, 11.1, 5.86)]
)
def test_the_wind_force_is_that_of_a_crane_makers_examples(load, area, C_S, table, allowed):
    """Liebherr, "Influence of wind on crane operation", 5.2.1 and 5.2.2: the load is allowed the wind in which it has
    the force of 1.2 m^2 for each tonne in the wind of the load chart."""
    chart = wind(speed=f"{table} m/s", area=f"{1.2 * load} m^2").force(10.0)
    lift = wind(speed=f"{allowed} m/s", area=f"{area} m^2", C_S=C_S).force(10.0)
    assert lift[0] == pytest.approx(chart[0], rel=1e-3)  # of speeds with four digits


def test_the_wind_pressure_is_that_of_v_squared_over_1_6():
    """FEM 1.001 and EN 13000: q = v^2 / 1.6 in N/m^2, with air of 1.25 kg/m^3; here 1.226."""
    assert wind().force(10.0)[0] == pytest.approx(100.0 * 9.0**2 / 1.6, rel=0.02)


def test_a_gust_of_3_s_is_a_quarter_faster_than_the_mean():
    """ln 200 x 0.047 = 0.249; IEC and EN 13000 have factors of 1.25 to 1.4 over sea and land."""
    assert wind().at(10.0, 3.0) == pytest.approx(9.0 * 1.249, rel=1e-3)
    assert wind().at(30.0) == pytest.approx(9.0 * 1.141, rel=1e-3)  # 3^0.12
    assert wind(sense="coming-from").force(10.0)[0] == pytest.approx(-wind().force(10.0)[0])
