"""The form of the leak that a crane file states: what it packs, where its number holds, and what is refused."""

import math
import re
from pathlib import Path

import pytest

from stillhook import load_crane
from stillhook.engine.pack.winch import active_record, pack
from stillhook.errors import SpecError
from stillhook.library import changed, crane_toml, cranes, sheet
from stillhook.library.leakage import leak_at, leak_misfit, stated_leak
from stillhook.physics.hydraulics.motor import motor_leakage
from stillhook.physics.hydraulics.pump import pump_leakage
from stillhook.spec.scenario import Scenario
from stillhook.units import in_display
from stillhook.validate.dynamics.model import bent
from stillhook.winches.circuits.tables import LeakForm

CRANE = load_crane("nov-250t")
N = 1000.0 * math.pi / 30.0  # rad/s
SIX_DIGITS = 1e-5  # C_1 and C_2 are written with six


def with_form(form: LeakForm, **active):
    return changed(CRANE, {"active": {"leak": {"form": form.value}, **active}})


def packed(crane, alpha_p: float, n_m: float) -> float:
    """Leak conductance as the kernels have it [L/min/bar]."""
    a = active_record(crane)
    return in_display(float(pump_leakage(alpha_p, a.pumps.leak) + motor_leakage(n_m, a.motors)), "leakage")


@pytest.mark.parametrize("form", LeakForm)
def test_every_form_gives_the_stated_number_where_it_holds(form):
    assert packed(with_form(form), 1.0, N) == pytest.approx(0.4, rel=SIX_DIGITS)
    assert in_display(stated_leak(with_form(form).active), "leakage") == pytest.approx(0.4, rel=SIX_DIGITS)


def test_a_constant_leak_is_the_stated_number_at_every_stroke_and_speed():
    """At the working point of heave compensation the table alone would give 0.32."""
    crane = with_form(LeakForm.CONSTANT)
    for alpha_p, n_m in ((0.0, 0.0), (0.3, 0.5 * N), (-0.7, -1.8 * N), (1.0, 2.0 * N)):
        assert packed(crane, alpha_p, n_m) == pytest.approx(0.4, rel=SIX_DIGITS)
    assert packed(CRANE, 0.3, 0.5 * N) < 0.33


def test_the_forms_with_stroke_and_with_speed_go_with_that_alone():
    stroke, speed = with_form(LeakForm.STROKE), with_form(LeakForm.SPEED)
    assert packed(stroke, 0.5, 0.0) == packed(stroke, 0.5, 2.0 * N) < packed(stroke, 1.0, 0.0)
    assert packed(speed, 0.2, N) == packed(speed, 1.0, N) < packed(speed, 0.2, 2.0 * N)


def test_another_reference_point_is_where_the_constant_number_holds():
    at = {"alpha_p": 0.4, "n_m": "500 rev/min"}
    crane = changed(CRANE, {"active": {"leak": {"form": "constant", "at": at}}})
    expected = in_display(leak_at(CRANE.active, 0.4, 0.5 * N), "leakage")
    assert packed(crane, 1.0, 2.0 * N) == pytest.approx(expected)


@pytest.mark.parametrize("name", [name for name in cranes() if load_crane(name).circuits])
def test_the_library_states_form_and_point_and_its_total_holds_there(name):
    crane = load_crane(name)
    assert crane.active.leak is not None
    assert leak_misfit(crane.active) is None
    rows = {r.field: r for section in sheet(crane) for r in section.rows}
    assert rows["active.leak.form"].value == "stroke+speed"
    assert "1000 rev/min" in rows["active.leak"].meaning


def test_a_file_without_a_form_leaks_as_before(tmp_path: Path):
    before = re.sub(r"\[(active|passive)\.leak(\.at)?\]\n([^\[\n].*\n)*", "", crane_toml(CRANE))
    assert ".leak]" not in before
    (tmp_path / "old.toml").write_text(before)
    old = load_crane(tmp_path / "old.toml")
    assert old.active.leak is None
    assert active_record(old) == active_record(CRANE)


def test_the_passive_circuit_has_a_form_as_well():
    crane = changed(CRANE, {"passive": {"leak": {"form": "constant"}}})
    P = pack(crane, Scenario(load="100 t", s_w="487 m", mode="ssc", duration="60 s")).params.passive
    assert len(set(P.pumps.leak)) == 1
    assert P.motors.C_2 == 0.0


def file_of(tmp_path: Path, active: str) -> Path:
    path = tmp_path / "mine.toml"
    path.write_text(f'base = "nov-250t"\n[active]\n{active}\n')
    return path


def test_a_stated_total_that_the_parts_do_not_leak_is_refused_with_two_ways_out(tmp_path: Path):
    path = file_of(tmp_path, 'C_leak = "0.52 L/min/bar"\nleak = {form = "constant"}')
    with pytest.raises(SpecError) as refused:
        load_crane(path)
    message = str(refused.value)
    assert message.startswith(
        "mine.toml: active: C_leak 0.52 L/min/bar is not what pumps and motors leak at 225 bar, alpha_p 1, 1000 rev/min"
    )
    assert 'C_leak = "0.4 L/min/bar"' in message
    scale = message.split("pump.leak_scale = ")[1].rstrip(".")
    fixed = load_crane(
        file_of(tmp_path, f'C_leak = "0.52 L/min/bar"\nleak = {{form = "constant"}}\npump = {{leak_scale = {scale}}}')
    )
    assert packed(fixed, 0.3, 0.0) == pytest.approx(0.52, rel=1e-3)


def test_a_file_that_takes_the_form_from_its_base_is_read_as_before(tmp_path: Path):
    crane = load_crane(file_of(tmp_path, "pump = {leak_scale = 1.5}"))
    assert crane.active.pump.leak_scale == 1.5
    (tmp_path / "again.toml").write_text(crane_toml(crane))
    assert active_record(load_crane(tmp_path / "again.toml")) == active_record(crane)


def test_an_unknown_form_is_refused_with_the_four(tmp_path: Path):
    with pytest.raises(SpecError, match=r"active\.leak\.form.*constant.*stroke.*speed"):
        load_crane(file_of(tmp_path, 'leak = {form = "square"}'))


@pytest.mark.parametrize("form", LeakForm)
def test_a_leak_that_rises_more_with_speed_keeps_its_form_elsewhere(form):
    """The factor of step 4 that stands for slip works in every form, and does nothing at 1."""
    crane = with_form(form)
    same, more = bent(crane, {"speed_leakage": 0.0}), bent(crane, {"speed_leakage": math.log(2.0)})
    for alpha_p in (0.3, 1.0):
        assert packed(same, alpha_p, 0.7 * N) == pytest.approx(packed(crane, alpha_p, 0.7 * N))
        assert packed(more, alpha_p, 0.0) == pytest.approx(packed(crane, alpha_p, 0.0))
        rise = in_display(5 * CRANE.active.motor.C_2 * N, "leakage")
        assert packed(more, alpha_p, N) - packed(crane, alpha_p, N) == pytest.approx(rise)
