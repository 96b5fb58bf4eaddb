"""The guarded controller with the whole winch behind it: a signal that stays bad brings the wire to rest."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.export.twin.host import NO_NUMBER, OK, OUT_OF_RANGE, Host
from tests.export.twin.test_core import TIP, case_of, rows

import stillhook
from stillhook.control.guard import STOPPED, SUBSTITUTED
from stillhook.control.interface import Sensed
from stillhook.control.registry import code_of
from stillhook.engine.pack.guard import guard_settings, time_to_stop
from stillhook.engine.pack.winch import pack
from stillhook.export.twin import export
from stillhook.library import changed
from stillhook.physics.hydraulics.swash import MotorControl

PLACE = 1e-2
"""Wire within which a winch stands that its brake holds [m]: it rocks, while the load swings, by 1 mm on the elastic
friction of a drum's brake and by 7 mm on the oil of a locked rod. In two seconds the tip itself moves half a metre."""
CRANES = ("nov-250t", "nov-100t-pure-active", "utility-20t-open-circuit", "nov-250t-secondary", "nov-100t-cylinder",
          "nov-100t-electric")  # fmt: skip
BAD = 600
"""Cycle from which a signal is bad: the tip moves at nearly its full speed."""


def stop_cycles(crane: stillhook.Crane, case: stillhook.Scenario) -> int:
    plc = pack(crane, case).params.plc
    settings = guard_settings(crane, plc, MotorControl(0.0, 0.0, 1.0))
    return math.ceil(time_to_stop(settings, plc) / plc.t_cycle)


def run(host: Host, tip: np.ndarray, n: int, fault: dict[str, float]) -> list[dict[str, float]]:
    """Signals of every cycle of a host that gives the tip and, from `BAD` on, the faults."""
    host.set(input_time=0, **dict(zip(TIP, tip[0], strict=True)))
    assert host.start() == OK
    out = []
    for k in range(n):
        if k == BAD:
            host.set(**fault)
        given = dict(zip(TIP, tip[k + 1], strict=True))
        host.set(**(given | {name: x for name, x in fault.items() if k >= BAD}))
        assert host.step(k * host.export.t_cycle, host.export.t_cycle) == OK
        out.append({name: host.get(name) for name in ("v_w", "s_w", "u_p", "brake", "guard_state", "guard_cause")})
    return out


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [c if c == "nov-250t" else pytest.param(c, marks=pytest.mark.thorough) for c in CRANES]
)
@pytest.mark.parametrize("signal", ["v_tip", "s_w"])
def test_a_winch_stands_within_the_stated_time_after_a_signal_is_bad(name: str, signal: str, compiled):
    crane = stillhook.load_crane(name)
    case = case_of(crane)
    wait = stop_cycles(crane, case)
    out = run(Host(export(crane, case), compiled), rows(crane, case), BAD + wait + 200, {f"q_{signal}": 0.0})
    assert all(row["guard_state"] == 0.0 for row in out[:BAD])
    assert max(abs(row["v_w"]) for row in out[:BAD]) > 0.1
    after = out[BAD + wait :]
    assert {row["guard_state"] for row in after} == {STOPPED}
    assert {row["guard_cause"] for row in after} == {2.0 ** Sensed._fields.index(signal)}
    assert all(row["u_p"] == 0.0 and row["brake"] == 1.0 for row in after)
    assert np.ptp([row["s_w"] for row in after]) < PLACE


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "moved"), [("nov-250t", 1e-3), pytest.param("nov-250t-secondary", 1e-3, marks=pytest.mark.thorough)]
)
def test_a_light_load_stays_where_it_is_when_its_load_cell_fails(name: str, moved: float, compiled):
    """The passive motors carry by the load cell: by the SWL in its place they hoisted 20 t by 8.5 m in a minute."""
    crane = stillhook.load_crane(name)
    case = case_of(crane, load="20 t", duration="72 s")
    made, tip = export(crane, case), rows(crane, case)
    s_w = {
        q: np.array([row["s_w"] for row in run(Host(made, compiled, "-O2"), tip, BAD + 6000, {"q_F": q})])
        for q in (1.0, 0.0)
    }
    assert np.ptp(s_w[1.0]) > 1.5
    assert np.abs(s_w[0.0] - s_w[1.0]).max() < moved


@pytest.mark.parametrize("value", [25.0, 1e300])
def test_a_motion_that_no_crane_has_stops_the_winch_of_an_fmu(value: float, compiled):
    crane = stillhook.load_crane("nov-250t")
    case = case_of(crane)
    host, tip = Host(export(crane, case, "controller"), compiled), rows(crane, case)
    host.set(sensed_mode=code_of("ssc"), sensed_s_w=100.0, sensed_F=1e6, sensed_dp=1e7, sensed_dp_load=1e7)
    assert host.start() == OK
    for k in range(BAD):
        host.set(**{f"sensed_{n}": x for n, x in zip(TIP, tip[k], strict=True)})
        if k >= 300:
            host.set(sensed_v_tip=value)
        assert host.step(k * 0.01, 0.01) == OK
    assert (host.get("guard_state"), host.get("u_p"), host.get("brake")) == (STOPPED, 0.0, 1.0)


def test_a_host_that_gives_no_number_or_an_unknown_mode_is_told(compiled):
    crane = stillhook.load_crane("nov-250t")
    for contents, prefix in (("controller", "sensed_"), ("plant+controller", "")):
        host = Host(export(crane, case_of(crane), contents), compiled)
        for value in (float("nan"), float("inf"), -float("inf")):
            assert host.try_set(f"{prefix}v_tip", value) == NO_NUMBER
        for mode in (-1.0, 0.5, 99.0):
            assert host.try_set(f"{prefix}mode", mode) == OUT_OF_RANGE


def test_a_load_cell_that_is_bad_is_an_alarm_of_the_fmu(compiled):
    crane = stillhook.load_crane("nov-250t")
    case = case_of(crane)
    host = Host(export(crane, case), compiled)
    out = run(host, rows(crane, case), BAD + 100, {"q_F": 0.0})
    assert {row["guard_state"] for row in out[BAD:]} == {SUBSTITUTED}
    assert host.get("guard_alarm") == 2.0 ** Sensed._fields.index("F")


@pytest.mark.slow
def test_the_checks_of_the_crane_file_are_in_an_fmu_and_give_the_alarms_of_a_simulation(compiled):
    """A swapped speed of the tip contradicts its position and its acceleration: compensation ends."""
    crane = changed(stillhook.load_crane("nov-250t"), {"control": {"guard": {"wire": "0.3 m"}}})
    case = case_of(crane)
    host, tip = Host(export(crane, case, "controller"), compiled), rows(crane, case)
    host.set(sensed_mode=code_of("ssc"), sensed_s_w=100.0, sensed_F=1e6, sensed_dp=1e7, sensed_dp_load=1e7)
    assert host.start() == OK
    states = []
    for k in range(BAD):
        s, v, a = tip[k]
        host.set(sensed_s_tip=s, sensed_v_tip=-v if k >= 450 else v, sensed_a_tip=a)
        assert host.step(k * 0.01, 0.01) == OK
        states.append((host.get("guard_state"), int(host.get("guard_alarm"))))
    v_tip = 2 ** Sensed._fields.index("v_tip")
    assert {state for state, _ in states[:450]} == {0.0}
    assert states[460][0] == SUBSTITUTED
    assert states[-1][1] & v_tip
    assert abs(host.get("u_p")) < 1e-3
