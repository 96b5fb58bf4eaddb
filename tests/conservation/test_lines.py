"""Restrictions between pumps and motors: no joule is lost in them unseen, and without them nothing changes."""

import numpy as np
import pytest
from tests.engine.runs import run_one

from stillhook import Scenario, load_crane
from stillhook.analysis.steady.operating_point import operating_point
from stillhook.engine.session import Session
from stillhook.errors import SpecError, UnitError
from stillhook.library import changed, crane_from_toml, crane_toml
from stillhook.physics.hydraulics.lines import P_VAPOUR, Restriction, pressure_drop
from stillhook.units import parse

AUDIT = 1.0e-4
"""As the audit of energy: powers are summed once per PLC cycle."""
LOADS = {"nov-250t": "100 t", "nov-100t-pure-active": "40 t"}
PORTS = ("p_a_pump", "p_b_pump", "p_a_motor", "p_b_motor")
CASE = {"s_w": "200 m", "tip": "sine 1.5 m 12 s", "duration": "40 s", "warm_up": "10 s", "mode": "ssc"}
cranes = pytest.mark.parametrize("name", sorted(LOADS))


def restricted(name, R_1="0.002 bar/(L/min)", R_2="4e-6 bar/(L/min)^2"):
    return changed(load_crane(name), {"active": {"lines": {"R_1": R_1, "R_2": R_2}}})


def run(name, crane, **case):
    return run_one(crane, Scenario(load=LOADS[name], **(CASE | case)), n_sub=5, every=1)


@cranes
def test_lines_without_restrictions_change_no_bit(name):
    without = run(name, load_crane(name))
    zero = run(name, restricted(name, "0 bar/(L/min)", "0 bar/(L/min)^2"))
    assert not set(PORTS) & set(without.signals)
    for signal in without.signals:
        assert np.array_equal(without.column(signal), zero.column(signal)), signal
    for port in PORTS:
        assert np.array_equal(zero.column(port), zero.column(port[:3])), port
    assert zero.stats.power.throttling == 0.0


@cranes
def test_the_throttled_power_closes_the_audit(name):
    result = run(name, restricted(name), duration="120 s")
    assert abs(result.energy_unaccounted) < AUDIT
    assert result.stats.power.throttling > 0.01 * result.stats.power.pump


@cranes
def test_ports_differ_from_the_line_by_half_of_its_restriction(name):
    crane = restricted(name)
    result, a = run(name, crane), crane.active
    R = Restriction(a.lines.R_1, a.lines.R_2)
    Q_p = a.pump.D_total * a.pump.omega_p * result.column("alpha_p")
    Q_m = a.motor.D_total * result.column("alpha_m") * result.column("omega_m")
    above_vapour = np.min([result.column(port) for port in PORTS], axis=0) > P_VAPOUR
    assert above_vapour.mean() > 0.9
    for port, line, Q, sign in (
        ("p_a_pump", "p_a", Q_p, 1.0),
        ("p_b_pump", "p_b", Q_p, -1.0),
        ("p_a_motor", "p_a", Q_m, -1.0),
        ("p_b_motor", "p_b", Q_m, 1.0),
    ):
        expected = result.column(line) + sign * 0.5 * pressure_drop(Q, R)
        assert result.column(port)[above_vapour] == pytest.approx(expected[above_vapour], rel=1e-9)


def test_a_steady_hoist_takes_the_drop_of_both_lines_from_the_pumps():
    """At one wire speed the motors need what they needed before; the oil in the middle of the lines has half of both
    drops more, and that is D Q (R_1 + R_2 Q) by hand."""
    name, v_w, alpha_m = "nov-100t-pure-active", 0.8, 0.9
    crane = restricted(name)
    free, throttled = (operating_point(c, v_w, alpha_m, load=40e3, s_w=200.0) for c in (load_crane(name), crane))
    Q = crane.active.motor.D_total * alpha_m * free.omega_m
    drop = crane.active.lines.R_1 * Q + crane.active.lines.R_2 * Q**2
    assert throttled.dp_m - free.dp_m == pytest.approx(drop, rel=1e-6)


def test_a_port_never_falls_below_the_vapour_pressure():
    result = run("nov-100t-pure-active", restricted("nov-100t-pure-active", "0.2 bar/(L/min)"))
    assert min(result.column(port).min() for port in PORTS) >= P_VAPOUR
    assert abs(result.energy_unaccounted) < 10.0 * AUDIT  # what the oil loses into a void is bounded by that pressure


def test_a_session_shows_the_ports():
    crane = restricted("nov-100t-pure-active")
    session = Session(crane, Scenario(load="40 t", **CASE))
    for _ in range(200):
        session.step()
    drop = session.get("p_a_pump") - session.get("p_a_motor")
    assert drop != 0.0
    assert abs(drop) < parse("40 bar", "pressure")


def test_a_crane_with_lines_is_read_back_alike():
    crane = restricted("nov-250t")
    assert crane_from_toml(crane_toml(crane), "again").active.lines == crane.active.lines


@pytest.mark.parametrize(
    ("lines", "problem"),
    [
        ({"R_1": "-1 bar/(L/min)"}, "R_1"),
        ({"R_1": "1 bar"}, "unit"),
        ({"R_3": "1 bar/(L/min)"}, "R_3"),
        ({"R_2": "1 bar/(L/min)"}, "unit"),
    ],
)
def test_lines_that_cannot_be_are_refused(lines, problem):
    with pytest.raises((SpecError, UnitError)) as error:
        changed(load_crane("nov-250t"), {"active": {"lines": lines}})
    assert problem in str(error.value)
    assert "\n" not in str(error.value)
