"""Dead time of displacement controls: the twin's pumps and motors answer their commands later, and are otherwise the
same; in every way to run."""

import numpy as np
import pytest
from tests.scripts import DOCS

import stillhook
from stillhook.engine.pack.winch import active_record
from stillhook.errors import StillhookError
from stillhook.library import changed
from stillhook.live.estimate.parameters.commands import Setting
from stillhook.validate.parameters.settings import servo_response

CRANE = stillhook.load_crane("nov-250t")
STILL = stillhook.Scenario(load="100 t", s_w="100 m", mode="manual", duration="10 s", warm_up="0 s")
WAVES = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 9 s", mode="ssc", duration="8 s", warm_up="2 s")
H, CYCLE = 2e-3, 1e-2
"""Step and PLC cycle of these runs [s]."""
STEP = 0.25
"""A change of the pumps' command that their control follows within its highest rate [-]."""


def late(crane=CRANE, *, compute_share=None, **dead_times):
    """The crane with dead times [ms] by path, such as active_pump."""
    tables = {}
    for path, time in dead_times.items():
        circuit, unit = path.split("_")
        tables.setdefault(circuit, {})[unit] = {"servo": {"dead_time": f"{time} ms"}}
    if compute_share is not None:
        tables["control"] = {"compute_share": compute_share}
    return changed(crane, tables)


def after_a_step(crane, u_p=0.5, cycles=80):
    """Settings of pumps and motors (cycles, 2) from the cycle in which both commands change."""
    session = stillhook.Session(crane, STILL, step=f"{H} s")
    session.set("override", 1.0)
    session.set("u_p", 0.0)
    session.set("u_m", 1.0)
    session.set("brake", 1.0)
    session.step(cycles=40)
    session.set("u_p", u_p)
    session.set("u_m", 0.75)
    out = []
    for _ in range(cycles):
        out.append((session.state("alpha_p"), session.state("alpha_m")))
        session.step()
    return np.array(out)


def test_a_step_is_answered_later_by_the_dead_time_of_each_control_and_else_alike_to_the_bit():
    plain, shifted = after_a_step(CRANE), after_a_step(late(active_pump=40, active_motor=170))
    assert np.ptp(plain, axis=0).min() > 0.2
    for column, cycles in ((0, 4), (1, 17)):
        np.testing.assert_array_equal(shifted[cycles:, column], plain[:-cycles, column])
        assert np.ptp(shifted[: cycles + 1, column]) == 0.0


def test_a_dead_time_of_a_part_of_a_cycle_adds_to_the_computing_time():
    plain = after_a_step(late(compute_share=0.4))
    shifted = after_a_step(late(compute_share=0.0, active_pump=44, active_motor=44))
    np.testing.assert_array_equal(shifted[4:], plain[:-4])


def test_a_dead_time_off_the_steps_is_met_to_the_second_order():
    """A change of command within a step acts as its mean over the step: as late, smeared over h. The response's
    second derivative is at most omega_n^2 times the change, so the setting is off by h^2/8 of that at most."""
    servo = CRANE.active.pump.servo
    alpha = after_a_step(late(compute_share=0.0, active_pump=41.3), STEP)[:, 0]
    w, zeta = servo.omega_n, servo.zeta
    t = np.maximum(CYCLE * np.arange(len(alpha)) - 0.0413, 0.0)
    damped = w * np.sqrt(1.0 - zeta**2)
    exact = STEP * (1.0 - np.exp(-zeta * w * t) * (np.cos(damped * t) + zeta * w / damped * np.sin(damped * t)))
    assert np.abs(alpha - exact).max() < STEP * (w * H) ** 2 / 8.0


def test_no_dead_time_is_nothing_and_that_of_another_control_changes_no_bit_of_a_step():
    base = stillhook.simulate(CRANE, WAVES, every="10 ms")
    assert stillhook.simulate(late(active_pump=0), WAVES, every="10 ms").equals(base)
    np.testing.assert_array_equal(after_a_step(late(passive_motor=30)), after_a_step(CRANE))


def test_a_session_goes_on_from_its_saved_commands_with_the_same_bits():
    session = stillhook.Session(late(active_pump=60, passive_pump=90), WAVES)
    session.step(cycles=150)
    saved = session.save()
    names = [name for name in session.states if name.startswith("dead_time_memory.")]
    assert len(names) == 4 * 20
    assert session.state("dead_time_memory.u_p.x_1") != session.state("dead_time_memory.u_p.x_20")
    session.step(cycles=100)
    other = stillhook.Session(late(active_pump=60, passive_pump=90), WAVES)
    other.restore(saved)
    other.step(cycles=100)
    assert other.save() == session.save()
    with pytest.raises(StillhookError, match=r"dead_time_memory\.u_p\.x_3 = 1\.5") as problem:
        other.set_states({"dead_time_memory.u_p.x_3": 1.5})
    assert "\n" not in str(problem.value)


def test_side_by_side_every_crane_has_its_own_dead_times_and_the_bits_of_a_run_alone():
    cranes = [late(active_pump=t, active_motor=t / 2) for t in (5, 41.3, 190)] + [CRANE]
    together = stillhook.simulate(cranes, WAVES, step="2 ms")
    for i, crane in enumerate(cranes):
        alone = stillhook.simulate(crane, WAVES, step="2 ms")
        assert float(together.e_c_max[i]) == float(alone.e_c_max)
        assert float(together.p_a_max[i]) == float(alone.p_a_max)
    assert len({float(x) for x in together.e_c_max}) == 4


@pytest.mark.parametrize(
    ("name", "path", "command"),
    [
        ("nov-100t-pure-active", "active_pump", "u_p"),
        ("nov-100t-cylinder", "cylinder_pump", "u_p"),
        ("utility-20t-open-circuit", "open_valve", "x_v"),
        ("nov-250t-secondary", "secondary_pump", "u_rp"),
        ("nov-250t-digital", "secondary_pump", "u_rp"),
    ],
)
def test_every_winch_type_runs_with_a_late_control_and_remembers_its_commands(name, path, command):
    """The command of ten cycles ago is the tenth last; the winch moves otherwise than without the dead time."""
    crane = stillhook.load_crane(name)
    case = WAVES.model_copy(update={"mode": crane.plant.type.default_mode, "load": 0.2 * crane.SWL})
    plain, delayed = (stillhook.Session(each, case) for each in (crane, late(crane, **{path: 100})))
    sent = []
    for _ in range(300):
        plain.step()
        delayed.step()
        sent.append(delayed.state(f"command.{command}"))
        if len(sent) > 10:
            assert delayed.state(f"dead_time_memory.{command}.x_10") == sent[-11]
    assert np.ptp(sent) > 0.0
    assert delayed.get("v_w") != plain.get("v_w")


def test_what_follows_from_logged_commands_has_the_dead_time_too():
    """The estimator's setting and the validation's response to a held command are those without it, later."""
    servo = active_record(CRANE).pump_servo
    t = CYCLE * np.arange(300)
    u = np.repeat(np.random.default_rng(1).uniform(-0.5, 0.5, 10), 30)
    u[:30] = 0.0
    shift = 7
    plain, delayed = (Setting(s).follow(t, u) for s in (servo, servo._replace(dead_time=shift * CYCLE)))
    np.testing.assert_allclose(delayed[shift:], plain[:-shift], atol=1e-12)
    block = Setting(servo._replace(dead_time=shift * CYCLE))
    parts = [block.follow(t[i : i + 50], u[i : i + 50]) for i in range(0, 300, 50)]
    np.testing.assert_array_equal(np.concatenate(parts), delayed)
    response = [servo_response(u, servo.omega_n, servo.zeta, CYCLE, T) for T in (0.0, shift * CYCLE)]
    np.testing.assert_allclose(response[1][shift:], response[0][:-shift], atol=1e-12)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"active": {"pump": {"servo": {"dead_time": "195 ms"}}}},
            "active.pump.servo.dead_time 0.195 s is more than 20 PLC",
        ),
        ({"passive": {"motor": {"servo": {"dead_time": "-1 ms"}}}}, "passive.motor.servo.dead_time"),
        ({"active": {"motor": {"servo": {"dead_time": "40"}}}}, "dead_time = .40.: no unit"),
    ],
)
def test_a_dead_time_that_cannot_be_is_refused_in_one_line(changes, message):
    with pytest.raises(StillhookError, match=message) as problem:
        changed(CRANE, changes)
    assert "\n" not in str(problem.value)


def test_units_that_a_drive_controls_without_cycles_take_none():
    crane = stillhook.load_crane("nov-250t-secondary")
    with pytest.raises(StillhookError, match=r"unit\.servo\.dead_time: the drive controls") as problem:
        changed(crane, {"secondary": {"unit": {"servo": {"dead_time": "20 ms"}}}})
    assert "\n" not in str(problem.value)


def test_errors_of_late_pumps_are_those_of_the_page():
    page = (DOCS / "explanation" / "control.md").read_text(encoding="utf-8")
    rows = {name: cells for name, *cells in (line.strip("| ").split(" | ") for line in page.splitlines())}
    times = [float(x) for x in rows["dead time [ms]"]]
    case = stillhook.Scenario(
        load="100 t", s_w="487 m", tip="sine 2 m 12 s", mode="ssc", duration="120 s", warm_up="36 s"
    )
    cranes = [late(active_pump=t) for t in times]
    leading = [changed(c, {"control": {"t_lead_ff": f"{t} ms"}}) for c, t in zip(cranes, times, strict=True)]
    for row, machines in (("error [cm]", cranes), ("with `t_lead_ff` as long [cm]", leading)):
        errors = [float(stillhook.simulate(each, case).e_c_pp) for each in machines]
        assert [f"{100.0 * e:.1f}" for e in errors] == rows[row]
