"""Friction verified in the running twin: staircases and heave compensation repeated by their logged commands."""

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from trials.independent_crane.crane import Case as SeaCase
from trials.independent_crane.crane import Defect, Must, write_campaign
from trials.independent_crane.sea_trial import COLUMNS as SEA_COLUMNS

from stillhook import Scenario, identify, load_crane, simulate
from stillhook.cli import run
from stillhook.engine.pack.winch import active_record, drum_record, friction_record
from stillhook.errors import StillhookError
from stillhook.identify.system_friction.campaign import load_campaign
from stillhook.library.draws import crane_with
from stillhook.library.examples import FRICTION_TESTS, example_campaign
from stillhook.library.parameter_sets import load_friction
from stillhook.physics.friction import system_friction
from stillhook.physics.hydraulics.motor import torque_loss
from stillhook.physics.load_path.drum import layer_diameter, wire_to_layer
from stillhook.physics.scalar import G
from stillhook.spec.scenario import Commands
from stillhook.units import parse
from stillhook.validate.dynamics.friction.report import verification_report
from stillhook.validate.dynamics.friction.verify import (
    PressureStretch,
    Use,
    Verification,
    deviation,
    friction_parts,
    verify_friction,
)

pytestmark = pytest.mark.slow

BAR, RPM = 1e5, math.pi / 30.0
RINGING = 0.005
"""Of the pressure drop: what the mean over a stretch leaves of the load's ringing on its wire."""
NOISE = 0.25 * BAR
"""Mean of a stretch of the example: 50 samples with 0.5 bar of noise and steps of 0.1 bar, and the ringing."""
CRANE, LAYER, LOAD = "nov-150t", 11, 55e3
SIGNALS = """
[signals]
time = { column = "Time", unit = "s" }
p_a = { column = "PT A", unit = "bar" }
p_b = { column = "PT B", unit = "bar" }
omega_m = { column = "Motor speed", unit = "rev/min" }
u_p = { column = "Pump command", unit = "1" }
alpha_m = { column = "Motor displacement", unit = "1" }
"""
TEST = '[[test]]\nname = "A"\nlog = "A.csv"\nload = "55 t"\nlayer = 11\nahc = true\n'


@pytest.fixture(scope="module")
def tests(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("example")
    example_campaign(FRICTION_TESTS, folder)
    return folder / "campaign.toml"


def verified(path: Path, friction: str, *names: str) -> Verification:
    """Some tests of a campaign, with a friction."""
    c = load_campaign(path)
    chosen = tuple(t for t in c.tests if not names or t.name in names)
    return verify_friction(replace(c, tests=chosen, verify=c.verify.model_copy(update={"friction": friction})))


def quay(folder: Path, truth, *, seconds: float = 50.0, alpha: float = 1.0) -> dict[str, np.ndarray]:
    """Heave compensation on the quay (paper D section 4.3): the tip at rest, the winch moves 55 t as waves would."""
    drum, t = drum_record(truth), np.arange(0.0, seconds, 0.01)
    commands = Commands(t, 0.35 * alpha * np.clip(3.0 * np.sin(0.1 * math.pi * t), -1.0, 1.0), np.full_like(t, alpha))
    s_w = drum.L_full - wire_to_layer(LAYER - 0.5, drum)
    case = Scenario(load=f"{LOAD} kg", s_w=f"{s_w} m", mode="ns", ramp="0 s", warm_up="0 s", commands=commands)
    result = simulate(truth, case, every="10 ms")
    log = {
        "Time": result.time.values,
        "PT A": result.p_a.values / BAR,
        "PT B": result.p_b.values / BAR,
        "Motor speed": result.omega_m.values / RPM,
        "Pump command": result.u_p.values,
        "Motor displacement": result.alpha_m.values,
    }
    write(folder, log)
    return log | {name: result[name].values for name in ("p_hp", "alpha_pm")}


def write(folder: Path, log: dict[str, np.ndarray], *, test: str = TEST, motors: int = 11, more: str = "") -> Path:
    """The log and a campaign file for it."""
    with (folder / "A.csv").open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(log)
        rows.writerows(zip(*(np.round(x, 6).tolist() for x in log.values()), strict=True))
    signals = "".join(
        f"{row}\n" for row in SIGNALS.splitlines() if not row or any(f'"{c}"' in row for c in log) or "[" in row[:1]
    )
    text = f'title = "SYNTHETIC"\ncrane = "{CRANE}"\nmotors = {motors}\nmotor = "A6VM215"\n{signals}[verify]\nfriction = "crane"\n{more}'
    path = folder / "c.toml"
    path.write_text(text + test, encoding="utf-8")
    return path


PASSIVE_OFF = 5e-3
"""Of the passive circuit on the independent crane: 0.05 % of the pressure and 0.3 % of the displacement are seen."""


def words_of(v: Verification) -> str:
    """The remarks of the report."""
    return " ".join(verification_report(v, {}).section("Remarks").parts[0].lines)


# Physics


def test_a_staircase_of_the_twin_keeps_the_torque_balance_of_its_friction(tests):
    """Motors' torque equals load torque plus all friction hauling in, less it paying out, at every steady stretch."""
    v = verified(tests, "crane", "3", "10")
    crane = load_crane(CRANE)
    y, fit, n = friction_record(crane.friction.system), active_record(crane).motors.fit, 11
    d = float(layer_diameter(float(LAYER), drum_record(crane)))
    for r in v.runs:
        T_d = (r.test.load + crane.hook_mass) * G * 0.5 * d
        for s in r.judged:
            T_f = system_friction(abs(s.omega_sim), T_d, y) + torque_loss(s.omega_sim, s.D_m, s.dp_sim, fit)
            assert s.dp_sim == pytest.approx((T_d / crane.i_hD / n + s.direction * T_f) / s.D_m, rel=RINGING)
            of = (r.t >= s.start) & (r.t <= s.end)
            assert np.nanmean(r.omega_m[of], axis=0) == pytest.approx([s.omega_m, s.omega_sim], rel=RINGING)
            assert np.nanmean(r.dp_m[of], axis=0) == pytest.approx([s.dp_m, s.dp_sim], rel=RINGING)


def test_in_heave_compensation_the_active_motors_carry_the_friction_of_all_motors(tmp_path):
    """Half the pressure difference of both directions is the friction of 3 active and 8 passive motors (paper D 4.3)."""
    crane = load_crane(CRANE)
    log = quay(tmp_path, crane)
    v = verify_friction(load_campaign(tmp_path / "c.toml"))
    up, down = (np.mean([s.dp_sim for s in v.runs[0].judged if s.direction == w]) for w in (1, -1))
    omega, D, D_a = 960.0 * RPM, crane.active.motor.D_max, crane.active.motor.D_max
    T_d = (LOAD + crane.hook_mass) * G * 0.5 * float(layer_diameter(float(LAYER), drum_record(crane)))
    passive = D * float(np.median(log["alpha_pm"])), float(np.median(log["p_hp"])) - crane.passive.p_lp
    fit, dp = active_record(crane).motors.fit, 0.5 * float(up - down)
    T_f = 11 * system_friction(omega, T_d, friction_record(crane.friction.system))
    T_f += 8 * torque_loss(omega, *passive, fit) + 3 * torque_loss(omega, D_a, dp, fit)
    assert dp == pytest.approx(T_f / (3 * D_a), rel=0.02)  # the speed swings by 5 % about 960 rev/min at each turn
    assert v.passed


def test_statistics_of_a_hand_case():
    """Paper D 4.3: 20 bar when paying out and none when hauling in are 10 of 130 bar, and 4 % of the nominal torque."""
    T_N = 8 * 70.0 / 3 * 275.0  # of 8 passive motors, a active motor [cm^3/rev bar]
    base = (0.0, 1.0)
    rows = [
        ("15", *base, w, w * 100.0, w * 100.0, w * 130.0, w * 130.0 + off, 0.0, 215.0, T_N)
        for w, off in ((1, 0.0), (-1, 20.0))
    ]
    d = deviation([PressureStretch(*row) for row in rows])
    assert (d.mean, d.magnitude, d.n) == (10.0, 10.0, 2)
    assert d.rms == pytest.approx(math.sqrt(200.0))
    assert d.of_pressure == pytest.approx(1.0 / 13.0)
    assert d.of_torque == pytest.approx(0.042, abs=0.0005)


def test_the_friction_part_is_half_the_difference_of_both_directions_with_the_interval_of_a_t_test():
    """Deviations 3, 5 hauling in and 0, 2 paying out: (4 - 1) / 2, and t(2) sqrt(1 + 1) / 2 of its standard error."""
    rows = [(1, 60.0, 63.0), (1, 60.0, 65.0), (-1, -40.0, -40.0), (-1, -40.0, -38.0)]
    stretches = [PressureStretch("", 0.0, 1.0, w, w, w, m, s, 0.0, 1.0, 1.0) for w, m, s in rows]
    part, measured = friction_parts(stretches)
    assert (part.value, measured) == (1.5, 50.0)
    assert part.half == pytest.approx(4.3027 * math.sqrt(2.0) / 2.0, rel=1e-4)
    assert friction_parts(stretches[:3]) is None


# True friction passes, other friction is flagged


def test_the_true_friction_passes_on_every_staircase(tests):
    v = verified(tests, "crane")
    assert v.passed
    assert {r.use for r in v.runs} == {Use.UNSEEN}
    off = [deviation([s]).magnitude for r in v.runs for s in r.judged]
    assert np.mean(off) < NOISE
    assert max(deviation(r.judged).of_pressure for r in v.runs) < 0.03


def test_a_set_of_another_winch_is_flagged_on_every_loaded_staircase(tests):
    v = verified(tests, "crane-1", "1", "2", "6", "9")
    assert not v.passed
    assert [bool(v.exceeded(r)) for r in v.runs] == [False, True, True, True]
    assert "of the load torque" in v.exceeded(v.runs[1])[0]
    remarks = words_of(v)
    assert "its form, or more than one of its parameters, is not the crane's." in remarks
    assert "its form" not in words_of(verified(tests, "crane", "1", "2", "6", "9"))


def test_another_friction_is_flagged_in_heave_compensation(tmp_path):
    truth = crane_with(load_crane(CRANE), load_friction("crane-1"))
    quay(tmp_path, truth, alpha=160.0 / 215.0)
    v = verify_friction(load_campaign(tmp_path / "c.toml"))
    assert not v.passed
    assert v.exceeded(v.runs[0])[0].endswith("of the measured pressure")


@pytest.mark.long
@pytest.mark.parametrize(("friction", "passed", "low", "high"), [(1.0, True, 0.0, 0.06), (1.4, False, 0.25, 0.33)])
def test_an_independent_crane_at_sea(tmp_path, monkeypatch, friction, passed, low, high):
    """Its laws, PLC and sensors are other code; with 40 % more friction the twin lacks 0.4 / 1.4 = 29 % of the pressure."""
    from trials.independent_crane import crane as independent

    monkeypatch.setattr(independent, "TESTS", tuple(t for t in independent.TESTS if t.name in ("A1", "A4")))
    write_campaign(tmp_path / "tests", SeaCase("made", "", Must.PASS, (), Defect(friction=friction)))
    crane = load_crane("nov-250t")
    rows = [f'{c.signal} = {{ column = "{c.header}", unit = "{c.unit}" }}' for c in SEA_COLUMNS if c.signal != "mode"]
    count = sum(c.motor.count for c in crane.circuits.values())
    head = [
        'title = "SYNTHETIC"',
        'crane = "nov-250t"',
        f"motors = {count}",
        "[signals]",
        *rows,
        '[verify]\nfriction = "crane"',
    ]
    test = '[[test]]\nname = "{0}"\nlog = "{0}.txt"\nload = "{1} t"\nahc = true'
    path = tmp_path / "tests" / "verify.toml"
    path.write_text("\n".join([*head, test.format("A1", 82), test.format("A4", 162)]), encoding="utf-8")
    v = verify_friction(load_campaign(path))
    assert v.passed is passed
    for r in v.runs:
        assert low <= deviation(r.judged).of_pressure < high
        for measured, simulated in r.passive.values():  # of the crane's PLC and of the twin's
            assert simulated == pytest.approx(measured, rel=PASSIVE_OFF)
    assert [list(r.passive) for r in v.runs] == [["p_hp", "alpha_pm"]] * 2
    (table,) = verification_report(v, {}).section("Passive circuit in heave compensation").parts
    assert [row[0] for row in table.rows] == ["A1", "A4"]


@pytest.mark.long
def test_the_identified_friction_is_verified_on_tests_that_it_was_not_fitted_to(tests):
    c = load_campaign(tests)
    c = replace(c, tests=tuple(t for t in c.tests if t.name in ("1", "2", "3", "5", "9", "11")))
    result = identify.friction(c, proposals=0)
    v = verify_friction(c, result)
    assert [r.use for r in v.runs] == [*[Use.FITTED] * 4, *[Use.UNSEEN] * 2]
    assert "1, 2, 3, 5" in v.friction
    assert v.passed
    fitted = replace(c, tests=tuple(replace(t, hold_out=False) for t in c.tests))
    assert not verify_friction(fitted, identify.friction(fitted, proposals=0)).passed  # nothing unseen: no claim


def test_a_run_in_heave_compensation_is_never_fitted(tests, tmp_path):
    c = load_campaign(tests)
    with_ahc = replace(c, tests=(*c.tests[:5], *(replace(t, ahc=True) for t in c.tests[5:6])))
    result = identify.friction(with_ahc, proposals=0)
    assert [t.name for t in result.campaign.tests] == ["1", "2", "3", "4", "5"]
    with pytest.raises(StillhookError, match="every test has ahc = true"):
        identify.friction(replace(c, tests=(replace(c.tests[0], ahc=True),)))


# The command line


def test_the_command_verifies_writes_a_page_and_returns_one_over_the_limit(tmp_path, capsys):
    quay(tmp_path, crane_with(load_crane(CRANE), load_friction("crane-1")))
    words = ["identify", "friction", str(tmp_path / "c.toml"), "--verify"]
    assert run([*words, "--out", str(tmp_path / "out")]) == 1
    assert "Over the limit: test A, " in capsys.readouterr().out
    page = (tmp_path / "out" / "verification.html").read_text(encoding="utf-8")
    assert "Deviation by motor speed and displacement" in page
    assert "data:image" in page or "<svg" in page
    rows = (tmp_path / "out" / "verification.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0].split(",")[:4] == ["test", "start", "end", "direction"]
    assert run([*words, "--json"]) == 1
    found = json.loads(capsys.readouterr().out)["verification"]
    assert found["passed"] is False
    (test,) = found["tests"]
    assert test["use"] == "AHC"
    assert test["directions"]["paying out"]["mean"] == pytest.approx(-test["directions"]["hauling in"]["mean"], rel=0.1)
    assert json.loads((tmp_path / "out" / "verification.json").read_text(encoding="utf-8")) == found


def test_limits_come_from_the_campaign_file(tmp_path):
    log = quay(tmp_path, crane_with(load_crane(CRANE), load_friction("crane-1")))
    path = write(tmp_path, {k: x for k, x in log.items() if k[0].isupper()}, more='pressure = "15 %"\n')
    assert verify_friction(load_campaign(path)).passed


# Bad input


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> dict[str, np.ndarray]:
    found = quay(tmp_path_factory.mktemp("quay"), load_crane(CRANE))
    return {name: x for name, x in found.items() if name[0].isupper()}


ONE_WAY = "no stretch of paying out at 250 rev/min or more after the first 10 s"


@pytest.mark.parametrize(
    ("change", "of", "says"),
    [
        (lambda x: x.pop("Pump command"), {}, "A.csv: no signal u_p. Map the pump command u_p"),
        (lambda x: x.pop("Motor displacement"), {}, "D_m: missing, and the log has no D_m, alpha_m or u_m."),
        (lambda x: x.pop("PT B"), {}, "A.csv: no signal p_b. Map p_a and p_b, or their difference dp_m."),
        (lambda x: x.update({k: y[:1500] for k, y in x.items()}), {}, "15 s long. Give 20 s or more of heave comp"),
        (lambda x: x.update({"Motor speed": np.abs(x["Motor speed"])}), {}, ONE_WAY),
        (lambda x: None, {"test": TEST.replace('load = "55 t"\n', "")}, 'test "A": load: missing'),
        (lambda x: None, {"test": TEST.replace("layer = 11\n", "")}, "layer: missing, and the log has no signal s_w"),
        (lambda x: None, {"test": TEST.replace("ahc = true\n", ""), "motors": 3}, "motors = 3: the twin repeats"),
        (lambda x: x["Pump command"].__setitem__(slice(2000, 3000), np.nan), {}, "of u_p is missing, allowed is 5%"),
        (lambda x: None, {"more": 'pressure = "0 %"\n'}, "verify.pressure"),
    ],
)
def test_what_cannot_be_repeated_is_refused_in_one_line(log, tmp_path, capsys, change, of, says):
    changed = {name: x.copy() for name, x in log.items()}
    change(changed)
    path = write(tmp_path, changed, **of)
    assert run(["identify", "friction", str(path), "--verify"]) == 2
    message = capsys.readouterr().err.strip()
    assert says in message
    assert "\n" not in message


@pytest.mark.parametrize(("friction", "says"), [("identified", "needs the result"), ("no-such", "no-such")])
def test_a_friction_that_is_not_at_hand_is_refused(tests, friction, says):
    with pytest.raises(StillhookError, match=says):
        verified(tests, friction, "1")


def test_a_second_loop_that_was_not_run_cannot_be_verified(tests):
    c = load_campaign(tests)
    c = replace(c, tests=c.tests[:5], verify=c.verify.model_copy(update={"friction": "second-loop"}))
    with pytest.raises(StillhookError, match=r"no second loop was run. Give fit.loops = 1 or more\."):
        verify_friction(c, identify.friction(c, proposals=0))


def test_a_test_slower_than_the_limits_apply_to_is_reported_and_not_judged(tests, tmp_path, capsys):
    text = (
        tests.read_text(encoding="utf-8")
        .replace('name = "2"', 'name = "2"\nend = "60 s"')
        .partition('[[test]]\nname = "3"')[0]
    )
    head, _, two = text.partition('[[test]]\nname = "1"')
    path = tests.with_name("slow.toml")
    path.write_text(
        f'{head}[verify]\nfriction = "crane"\n[[test]]\nname = "2"{two.partition(chr(34) + "2" + chr(34))[2]}',
        encoding="utf-8",
    )
    assert run(["identify", "friction", str(path), "--verify"]) == 1
    assert "Not verified: no test reaches 250 rev/min." in capsys.readouterr().out


def test_displacement_may_be_stated_in_place_of_logged(log, tmp_path):
    without = {name: x for name, x in log.items() if name != "Motor displacement"}
    path = write(tmp_path, without, test=TEST + 'D_m = "215 cm^3/rev"\n')
    assert verify_friction(load_campaign(path)).passed
    assert verify_friction(load_campaign(path)).runs[0].stretches[0].D_m == pytest.approx(
        parse("215 cm^3/rev", "displacement")
    )
