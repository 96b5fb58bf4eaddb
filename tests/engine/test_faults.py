"""Faults of sensors in the twin, and the checks of its PLC: when they are detected, and what becomes of the load."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from tests.engine.lifts import deep_lift, in_sea
from tests.export.plc.cases import bits
from tests.export.plc.structured_text import Machine

import stillhook
from stillhook.analysis.maps.faults import Verdict, fault_tables, survive
from stillhook.control.interface import Sensed
from stillhook.control.sensor_errors import NEVER
from stillhook.engine.pack.winch import gains
from stillhook.errors import ScenarioError, StillhookError
from stillhook.export.plc import structured_text
from stillhook.export.plc.block import controller_block
from stillhook.export.plc.sequence import GOOD, Reference, inputs, numbers
from stillhook.library import changed
from stillhook.spec.guard import GuardTable
from stillhook.spec.scenario import Scenario, Sensors
from stillhook.spec.sensors import FaultKind

CRANE = "nov-250t"
PLAIN = {"load": "100 t", "s_w": "100 m", "tip": "sine 2 m 10 s", "mode": "ssc", "duration": "60 s", "warm_up": "20 s"}
T_CYCLE = 0.01
TWO_CYCLES = 2.0 * T_CYCLE
"""An alarm is given in a cycle: by as much a time that is calculated may be off, and by one for the trapezium."""


@functools.cache
def crane(**settings: object) -> stillhook.Crane:
    plain = stillhook.load_crane(CRANE)
    return changed(plain, {"control": {"guard": settings}}) if settings else plain


def guarded(**settings: object) -> stillhook.Crane:
    return crane(**({"wire": "0.3 m"} | settings))


def fault(kind: str, time: float = 30.0, **more: object) -> dict[str, object]:
    return {"faults": [{"time": f"{time} s", "kind": kind, **more}]}


@functools.cache
def plain_run():
    return stillhook.simulate(crane(), Scenario(**PLAIN), series=True)


def run(machine: stillhook.Crane, sensors: dict[str, object], **more: object):
    return stillhook.simulate(machine, Scenario(**(PLAIN | more), sensors=sensors), series=True, every="10 ms")


# --- faults of a sensor ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "value", "wanted"),
    [
        ("offset", "2 m", lambda x, t: x + 2.0),
        ("drift", "0.5 m", lambda x, t: x + 0.5 * (t - 30.0)),
        ("swapped", None, lambda x, t: -x),
        ("lost", None, lambda x, t: 0.0 * x),
        ("value", "7 m", lambda x, t: 0.0 * x + 7.0),
        ("spike", "2 m", lambda x, t: x + 2.0 * (np.round((t - 30.0) / T_CYCLE) % 100 == 0)),
    ],
)
def test_a_fault_is_what_its_kind_says_from_its_time_on(kind: str, value: str | None, wanted) -> None:
    more = {} if value is None else {"value": value}
    series = run(crane(), {"s_w": fault(kind, **more), "v_tip": {}}, duration="33.05 s", tip="still")
    t, x, read = series.time.values, series.s_w.values, series.s_w_measured.values
    before = t < 30.0 - 0.5 * T_CYCLE
    assert np.array_equal(read[before], x[before])
    np.testing.assert_allclose(read[~before], wanted(x[~before], t[~before]), atol=1e-9)


def test_a_fault_without_an_end_stays_and_goes_through_a_stored_scenario() -> None:
    case = Scenario(**PLAIN, sensors={"s_w": fault("drift", value="1 mm"), "v_tip": fault("swapped")})
    assert Scenario.from_dict(case.to_dict()) == case
    assert case.sensors.s_w.faults[0].record(T_CYCLE).until == NEVER


@pytest.mark.parametrize("kind", ["offset", "drift", "spike", "value"])
def test_a_kind_with_a_value_is_refused_without_one(kind: str) -> None:
    with pytest.raises(ScenarioError) as refused:
        Sensors(s_w=fault(kind))
    assert 'value belongs to kind = "value", "offset", "drift", "spike", and to no other.' in str(refused.value)
    assert "\n" not in str(refused.value)


def test_an_offset_of_the_tips_speed_is_the_error_that_the_gain_leaves() -> None:
    r"""In the steady state feedforward of the offset and feedback cancel: K_1 K_wire alpha_m dv = K_p |e_c|; each of the
    two runs has what friction and leakage leave besides, which the difference is without."""
    dv, more = 0.02, {"mode": "ns", "duration": "150 s"}
    off = [run(crane(), {"v_tip": {"offset": f"{sign * dv} m/s"}}, **more) for sign in (-1, 1)]
    tail = slice(100.0, 150.0)  # five periods of the tip
    apart = float(off[1].e_c.sel(time=tail).mean() - off[0].e_c.sel(time=tail).mean())
    moving = off[0].isel(time=int(np.argmax(np.abs(off[0].omega_m.values))))
    K_wire = crane().drum.d_max / (2.0 * float(moving.v_w / moving.omega_m) * crane().i_hD)
    expected = gains(crane()).K_1 * K_wire * crane().control.alpha_ns * 2.0 * dv / crane().control.K_p
    assert abs(apart) == pytest.approx(expected, rel=0.02)


# --- checks ---------------------------------------------------------------------------------------------------------


def test_a_healthy_run_with_checks_has_the_bits_of_one_without_and_no_alarm() -> None:
    plain, checked = plain_run(), stillhook.simulate(guarded(), Scenario(**PLAIN), series=True)
    for name in plain.data_vars:
        if plain[name].dtype.kind == "f":
            assert np.array_equal(plain[name], checked[name], equal_nan=True), name
    assert float(checked.alarms) == 0.0
    assert math.isnan(float(checked.alarm_first))
    assert not checked.guard_alarm.any()


@pytest.mark.parametrize("v", [0.4, 1.0, -0.5])
def test_a_frozen_encoder_is_detected_when_the_motors_have_moved_the_limit(v: float) -> None:
    r"""At a steady wire speed: limit = v T (1 - exp(-t / T)), near limit / v for a time short of T."""
    settings = guarded().control.guard
    block = controller_block(guarded(), "ssc")
    reference = Reference(block)
    omega = v * 2.0 * crane().i_hD / crane().drum.d_max
    y = Sensed(
        s_tip=0.0, v_tip=-v, a_tip=0.0, v_op=0.0, s_op=0.0, mode=block.code, f_pump=1.0, s_w=100.0, F=1e6, alpha_m=1.0,
        K_wire=1.0, dp=1e7, dp_load=1e7, p_hp=2e7, omega_m=omega, p_a=1.2e7, p_b=2e6,
    )  # fmt: skip
    n = 0
    for k in range(2000):
        t = k * T_CYCLE
        moved = y._replace(s_w=100.0 - v * min(t, 1.0), s_tip=-v * t, F=1e6 + k, p_a=1.2e7 + k, p_b=2e6 + k, dp=1e7 + k)
        if reference.step(moved._replace(dp_load=moved.dp, p_hp=2e7 + k)).alarm > 0.0:
            n = k
            break
    T = settings.t_memory
    wanted = -T * math.log(1.0 - settings.wire / (abs(v) * T)) + settings.t_confirm
    assert n * T_CYCLE - 1.0 == pytest.approx(wanted, abs=TWO_CYCLES)
    assert reference.laws.checks.k.left.s_w > 0.0
    assert reference.laws.checks.k.left.omega_m == 0.0


def test_a_frozen_encoder_in_waves_loses_the_load_without_checks_and_keeps_it_with_them() -> None:
    series = {
        name: run(m, {"s_w": fault("frozen")}, duration="90 s") for name, m in {"no": crane(), "yes": guarded()}.items()
    }
    healthy = stillhook.simulate(crane(), Scenario(**(PLAIN | {"duration": "90 s"})), series=True, every="10 ms")
    moved = {name: float(abs(each.s_w - healthy.s_w).max()) for name, each in series.items()}
    assert moved["no"] > 1.0
    assert moved["yes"] < guarded().control.guard.wire
    alarm = series["yes"].time.values[np.flatnonzero(series["yes"].guard_alarm.values)[0]]
    # at 30 s the tip moves at its largest speed, 2 m x 2 pi / 10 s x cos
    v = 2.0 * math.pi / 10.0
    assert alarm - 30.0 == pytest.approx(math.asin(0.3 * v / (2.0 * v)) / v, abs=0.1)
    assert float(series["yes"].alarm_first) == pytest.approx(alarm, abs=TWO_CYCLES)


def test_what_moved_or_weighs_wrong_is_named_by_the_alarm() -> None:
    for quantity, kind, value in (
        ("s_w", "swapped", {}),
        ("alpha_m", "lost", {}),
        ("F", "frozen", {}),
        ("p_a", "lost", {}),
    ):
        series = run(guarded(), {quantity: fault(kind, **value)}, duration="40 s")
        alarm = int(series.guard_alarm.values.max())
        assert alarm & 2 ** Sensed._fields.index(quantity), quantity
        assert not alarm & 2 ** Sensed._fields.index("v_tip"), quantity


@pytest.mark.parametrize(("reaction", "state"), [("alarm", 0.0), ("manual", 1.0), ("stop", 2.0)])
def test_a_reaction_of_the_crane_file_is_what_the_plc_does(reaction: str, state: float) -> None:
    series = run(guarded(on_encoder=reaction), {"s_w": fault("frozen")})
    last = series.sel(time=slice(55.0, None))
    assert float(last.guard_state[-1]) == state
    assert float(last.guard_alarm.max()) > 0.0
    at_rest = float(abs(last.v_w).max()) < 0.02
    assert at_rest == (reaction != "alarm")


def test_a_lost_motion_unit_ends_compensation_and_the_wire_comes_to_rest() -> None:
    lost = {q: fault("lost") for q in ("s_tip", "v_tip", "a_tip")}
    series = run(guarded(), lost)
    assert float(abs(series.v_w.sel(time=slice(40.0, None))).max()) < 0.02
    without = run(crane(), lost)
    assert float(series.F_w.max()) < float(without.F_w.max())


def test_a_table_of_faults_says_which_is_survived() -> None:
    case = Scenario(**(PLAIN | {"duration": "70 s"}))
    faults = ["s_w lost", "F spike 500 kN"]
    without, with_checks = (survive(m, case, ["ssc"], faults) for m in (crane(), guarded()))
    assert without.outcomes["s_w lost"]["ssc"].verdict is Verdict.LOST
    assert with_checks.outcomes["s_w lost"]["ssc"].verdict is Verdict.KEPT
    assert without.outcomes["F spike 500 kN"]["ssc"].verdict is Verdict.KEPT
    assert (without.ok, with_checks.ok) == (False, True)
    assert (without.false_alarms, with_checks.false_alarms) == (None, {"ssc": 0.0})
    assert with_checks.outcomes["s_w lost"]["ssc"].detected <= T_CYCLE


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("encoder frozen", 'faults: "encoder frozen": give a signal (s_tip,'),
        ("s_w stuck", 'faults: "s_w stuck": give a signal'),
        ("s_w offset", "value belongs to kind"),
        ("s_w offset 1 bar", 'unit "bar" is not one of'),
    ],
)
def test_a_fault_that_cannot_be_is_refused_in_one_line(text: str, line: str) -> None:
    with pytest.raises(ScenarioError) as refused:
        Sensors(**fault_tables(text, 10.0))
    assert line in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("settings", "line"),
    [
        ({"on_load": "feedback-off"}, 'on_load = "feedback-off" is not one of alarm, hold, manual, stop.'),
        (
            {"on_encoder": "open-loop"},
            'on_encoder = "open-loop" is not one of alarm, feedback-off, manual, stop.',
        ),
        ({"wire": "0.3 bar"}, 'unit "bar" is not one of'),
        ({"t_confirm": "0.05 s"}, "it must be less than"),
        ({"wires": "0.3 m"}, "wires: unknown field"),
    ],
)
def test_a_table_of_checks_that_cannot_be_is_refused_in_one_line(settings, line) -> None:
    with pytest.raises(StillhookError) as refused:
        crane(**settings)
    assert line in str(refused.value)
    assert "\n" not in str(refused.value)


def test_every_kind_of_fault_and_every_setting_is_described() -> None:
    assert {kind.value for kind in FaultKind} >= {"frozen", "lost", "offset", "drift", "spike", "swapped"}
    assert all(field.description for field in GuardTable.model_fields.values())


# --- on a PLC -------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_alarms_are_numbers_of_a_lowering_too_alone_in_a_batch_and_in_a_store(tmp_path) -> None:
    frozen = {"sensors": {"s_w": {"faults": [{"time": "10 s", "kind": "frozen"}]}}}
    lifts = [in_sea(deep_lift(**more), Hs=2.0) for more in (frozen, {})]
    plain, crane_of = stillhook.simulate(crane(), lifts[0]), guarded()
    one = stillhook.simulate(crane_of, lifts[0])
    several = stillhook.simulate(crane_of, lifts, store=tmp_path / "store")
    again = stillhook.simulate(crane_of, lifts, store=tmp_path / "store")
    assert float(one.alarms) >= 1.0
    assert 10.0 < float(one.alarm_first) < 15.0
    assert "alarms of the PLC on what it reads: " in str(one.notes.item())
    for runs in (several, again):
        assert runs.alarms.values.tolist() == [float(one.alarms), 0.0]
        assert runs.alarm_first.values[0] == float(one.alarm_first)
        assert math.isnan(runs.alarm_first.values[1])
    assert "alarms" not in plain


def rows_with_faults(block):
    """Inputs of the test sequence, with an encoder that freezes, a swapped speed and a displacement that is lost."""
    rows, frozen = [], None
    for k, (outside, _) in enumerate(inputs(block, Reference(block))):
        y, q = outside.y, outside.quality
        if 500 <= k < 800:
            frozen = y.s_w if frozen is None else frozen
            y = y._replace(s_w=frozen)
        if 1000 <= k < 1200:
            y = y._replace(v_tip=-y.v_tip, alpha_m=0.0)
        rows.append(outside._replace(y=y, quality=q))
    return rows


@pytest.mark.long
@pytest.mark.parametrize(("name", "controller"), [(CRANE, "ssc"), ("nov-100t-electric", "position")])
def test_the_text_with_checks_commands_the_bits_of_the_reference(name: str, controller: str) -> None:
    machine = changed(stillhook.load_crane(name), {"control": {"guard": {"wire": "0.3 m", "on_encoder": "manual"}}})
    block = controller_block(machine, controller)
    step, reference = Machine(structured_text(block)).start(), Reference(block)
    rows = rows_with_faults(block)
    ours = np.array([step(*numbers(outside)) for outside in rows])
    wanted = np.array([reference.step(*outside) for outside in rows])
    np.testing.assert_array_equal(bits(ours), bits(wanted))
    assert reference.laws.checks.k.alarms > 0.0
    assert GOOD == Sensed._make([1.0] * len(Sensed._fields))


def test_the_text_without_the_table_has_nothing_of_the_checks() -> None:
    assert "settings.checks" not in structured_text(controller_block(crane(), "ssc"))
