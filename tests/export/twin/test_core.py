"""The C core against `simulate`, which is another program on the same equations: other compiler flags, another loop."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.export.twin.host import DIVERGED, NO_NUMBER, NOT_NOW, OK, OUT_OF_RANGE, WRONG_STEP, Host
from tests.signers import KEY
from tests.validate.staged_certificate import staged, write

import stillhook
from stillhook.control.registry import code_of
from stillhook.engine.inputs import CycleInputs
from stillhook.export.twin import CONTENTS, Export, ExportError, compile_library, export, generate
from stillhook.kernels.c99.expressions import SubsetError
from stillhook.library import changed, cranes
from stillhook.validate import certificate_of

CLOSE = 1e-12
"""Control error that compilers may differ by [m]: the issue's bound; seen are 2e-13."""
RELATIVE = 1e-9
"""Part of a signal's largest value by which it may differ: the issue's bound."""
EXTRAPOLATED = 2e-6
"""Control error from holding the tip's acceleration over a step of 10 ms [m]: its jerk times the cube of the step, over
six, is 2e-8 m for a metre in 12 s, and 100 times that leaves room for harder motions."""
TIP = ("s_tip", "v_tip", "a_tip")


def case_of(crane: stillhook.Crane, **changes: object) -> stillhook.Scenario:
    mode = "ssc" if crane.plant.type.control == "displacement" else "position"
    values = {
        "load": f"{0.4 * crane.SWL / 1000} t",
        "s_w": "100 m",
        "tip": "sine 1 m 12 s",
        "mode": mode,
        "duration": "20 s",
        "ramp": "4 s",
        "warm_up": "0 s",
    }
    return stillhook.Scenario(**(values | changes))


def rows(crane: stillhook.Crane, case: stillhook.Scenario) -> np.ndarray:
    """The tip's motion at every PLC cycle."""
    drive = CycleInputs(crane, case)
    return np.array([drive.full_row(k)[:3] for k in range(drive.n_ticks + 1)])


def hosted(
    made: Export, compiled, tip: np.ndarray, names: tuple[str, ...] = (), *, ahead=True, cycles=1, **begun: float
):
    """Signals of a host that gives the tip at the end of every step (ahead) or at its start, and sets before it begins
    what is given."""
    host, h = Host(made, compiled), cycles * made.t_cycle
    host.set(input_time=0 if ahead else 1, **dict(zip(TIP, tip[0], strict=True)), **begun)
    assert host.start() == OK
    out = [[host.get(name) for name in names]]
    for k in range(0, len(tip) - 1, cycles):
        host.set(**dict(zip(TIP, tip[k + cycles] if ahead else tip[k], strict=True)))
        assert host.step(k * made.t_cycle, h) == OK
        out.append([host.get(name) for name in names])
    return host, np.array(out).T


def series(crane: stillhook.Crane, case: stillhook.Scenario):
    return stillhook.simulate(crane, case, every=f"{crane.control.t_cycle} s", series=True)


QUICK = ("nov-250t", "nov-100t-cylinder", "nov-100t-electric")
"""One of two lines of oil with a passive circuit, one of a rod, one without oil; the others take their time."""


@pytest.mark.long
@pytest.mark.parametrize(
    "name", [c if c in QUICK else pytest.param(c, marks=pytest.mark.thorough) for c in cranes() if c != "nov-150t"]
)
def test_every_drive_has_the_signals_of_simulate(name: str, compiled):
    crane = stillhook.load_crane(name)
    case = case_of(crane)
    made, run = export(crane, case), series(crane, case)
    names = tuple(p.name for p in made.ports if p.causality == "output" and p.name in run)
    assert {"e_c", "s_w", "v_w", "F_w", "u_p", "s_load"} <= set(names)
    _, signals = hosted(made, compiled, rows(crane, case), names)
    for signal, values in zip(names, signals, strict=True):
        true = run[signal].values
        bound = CLOSE if signal.startswith("e_c") else RELATIVE * max(float(np.abs(true).max()), 1e-30)
        assert np.abs(values - true).max() <= bound, signal


@pytest.mark.long
def test_a_displacement_from_torque_and_speeds_is_that_of_simulate(nov: stillhook.Crane, compiled):
    crane = changed(nov, {"control": {"displacement_limit": "torque"}})
    case = case_of(crane, load="240 t", tip="sine 3 m 12 s")
    _, (alpha_m,) = hosted(export(crane, case), compiled, rows(crane, case), ("alpha_m",))
    true, by_load = (series(c, case)["alpha_m"].values for c in (crane, nov))
    assert np.abs(alpha_m - true).max() <= RELATIVE
    assert np.abs(by_load - true).max() > 0.02


@pytest.mark.long
def test_motors_with_other_loss_models_have_the_signals_of_simulate(compiled):
    """A measured map and a fitted model, whose constants the C core carries."""
    mj6 = {"law": "mj6", "C": [12.0, 0.0027, 0.87, 1.1e-14, 4.4e7, 3e-8]}
    models = {"active": {"law": "map", "map": "motor-map"}, "passive": mj6}
    crane = changed(stillhook.load_crane("nov-150t"), {c: {"motor": {"loss_model": m}} for c, m in models.items()})
    case = case_of(crane, duration="10 s")
    run = series(crane, case)
    _, signals = hosted(export(crane, case), compiled, rows(crane, case), ("e_c", "p_a", "T_f"))
    for name, values in zip(("e_c", "p_a", "T_f"), signals, strict=True):
        true = run[name].values
        assert np.abs(values - true).max() <= RELATIVE * float(np.abs(true).max()), name


@pytest.mark.long
def test_late_displacement_controls_have_the_signals_of_simulate_and_go_on_from_a_saved_state(compiled):
    dead_time = {"servo": {"dead_time": "83 ms"}}
    nov = stillhook.load_crane("nov-250t")
    crane = changed(nov, {"active": {"pump": dead_time}, "passive": {"motor": dead_time}})
    case = case_of(crane, duration="8 s")
    made, run, tip = export(crane, case), series(crane, case), rows(crane, case)
    _, (e_c, p_hp) = hosted(made, compiled, tip, ("e_c", "p_hp"))
    assert np.abs(e_c - run.e_c.values).max() <= CLOSE
    assert np.abs(p_hp - run.p_hp.values).max() <= RELATIVE * float(run.p_hp.max())
    assert np.abs(e_c - series(nov, case).e_c.values).max() > 1e-3
    host, _ = hosted(made, compiled, tip[:401], ("e_c",))
    kept = host.save()

    def later() -> float:
        for k in range(400, 500):
            host.set(**dict(zip(TIP, tip[k + 1], strict=True)))
            assert host.step(k * 0.01, 0.01) == OK
        return host.get("e_c")

    first = later()
    host.restore(kept)
    assert later() == first == e_c[500]


@pytest.mark.long
def test_a_motion_given_at_the_start_of_steps_is_extrapolated(nov: stillhook.Crane, compiled):
    case = case_of(nov)
    _, (e_c,) = hosted(export(nov, case), compiled, rows(nov, case), ("e_c",), ahead=False)
    error = np.abs(e_c - series(nov, case)["e_c"].values).max()
    assert 1e-10 < error < EXTRAPOLATED


def test_a_step_of_several_cycles_follows_the_quintic_between_its_ends(nov: stillhook.Crane, compiled):
    case = case_of(nov)
    _, (e_c,) = hosted(export(nov, case), compiled, rows(nov, case), ("e_c",), cycles=5)
    assert np.abs(e_c - series(nov, case)["e_c"].values[::5]).max() < EXTRAPOLATED


def test_load_wire_out_and_gains_are_those_that_were_set_before_the_start(nov: stillhook.Crane, compiled):
    other = nov.model_copy(update={"control": nov.control.model_copy(update={"K_p": 0.3})})
    case = case_of(other, load="180 t", s_w="1500 m", mode="ns")
    begun = {"load": 180e3, "s_w_start": 1500.0, "K_p": 0.3, "mode": code_of("ns")}
    _, (e_c, F_w) = hosted(export(nov, case_of(nov)), compiled, rows(nov, case), ("e_c", "F_w"), **begun)
    run = series(other, case)
    assert np.abs(e_c - run["e_c"].values).max() <= CLOSE
    assert np.abs(F_w - run["F_w"].values).max() <= RELATIVE * 2e6


@pytest.mark.long
def test_a_payload_in_water_has_its_buoyancy_added_mass_and_drag(nov: stillhook.Crane, compiled):
    water = {"volume": "20 m^3", "added_mass": "30 t", "C_D": 1.2, "area": "10 m^2"}
    case = case_of(nov, water=water)
    _, (F_w,) = hosted(export(nov, case), compiled, rows(nov, case), ("F_w",))
    assert np.abs(F_w - series(nov, case)["F_w"].values).max() <= RELATIVE * 2e6


def test_operator_and_mode_change_the_run_as_in_simulate(nov: stillhook.Crane, compiled):
    operator = {"profile": [[f"{t} s", f"{v} m/s"] for t, v in ((0, 0), (2, 0), (4, -0.3), (8, -0.3), (10, 0))]}
    case = case_of(nov, operator=operator, modes=[["0 s", "ssc"], ["12 s", "ns"]], duration="16 s")
    drive, host = CycleInputs(nov, case), Host(export(nov, case_of(nov)), compiled)
    host.set(input_time=0, mode=code_of("ssc"))
    assert host.start() == OK
    e_c = [host.get("e_c")]
    for k in range(1, drive.n_ticks + 1):
        row = drive.full_row(k)
        host.set(**dict(zip(TIP, row[:3], strict=True)), v_op=row[6], mode=row[8])
        assert host.step((k - 1) * 0.01, 0.01) == OK
        e_c.append(host.get("e_c"))
    assert np.abs(np.array(e_c) - series(nov, case)["e_c"].values).max() <= CLOSE


def test_a_restored_state_goes_on_with_the_same_bits_and_reading_changes_nothing(nov: stillhook.Crane, compiled):
    case = case_of(nov)
    made, tip = export(nov, case), rows(nov, case)
    host, _ = hosted(made, compiled, tip[:501], ("e_c",))
    kept = host.save()

    def later(read: bool) -> bytes:
        for k in range(500, 700):
            host.set(**dict(zip(TIP, tip[k + 1], strict=True)))
            assert host.step(k * 0.01, 0.01) == OK
            if read:
                host.get("e_c"), host.get("p_a"), host.text("causes")
        host.get("e_c")
        host.text("causes")
        return host.save()

    first = later(read=True)
    host.restore(kept)
    assert later(read=False) == first
    other = Host(made, compiled)
    other.restore(kept)
    assert other.get("s_w") == other.get("s_w")
    assert other.save()[:64] == kept[:64]


def test_what_is_wrong_is_refused_and_changes_nothing(nov: stillhook.Crane, compiled):
    host = Host(export(nov, case_of(nov)), compiled)
    assert host.step(0.0, 0.01) == NOT_NOW
    assert host.try_set("load", 251e3) == OUT_OF_RANGE
    assert host.try_set("load", -1.0) == OUT_OF_RANGE
    assert host.try_set("mode", 2.5) == OUT_OF_RANGE
    assert host.try_set("mode", 9.0) == OUT_OF_RANGE
    assert host.try_set("e_c", 0.0) == NOT_NOW
    assert host.start() == OK
    host.get("e_c")
    before = host.save()
    for value in (float("nan"), float("inf"), -float("inf")):
        assert host.try_set("s_tip", value) == NO_NUMBER
    assert host.try_set("load", 100e3) == NOT_NOW
    assert host.try_set("s_w_start", 100.0) == NOT_NOW
    assert host.try_set("f_pump", 0.0) == OUT_OF_RANGE
    for time, h in ((0.0, 0.015), (0.0, 0.0), (0.0, -0.01), (0.0, 0.004), (0.01, 0.01), (0.0, float("nan"))):
        assert host.step(time, h) == WRONG_STEP, (time, h)
    assert host.save() == before
    assert host.step(0.0, 0.01) == OK


def test_a_motion_beyond_all_numbers_ends_the_instance(nov: stillhook.Crane, compiled):
    host = Host(export(nov, case_of(nov)), compiled)
    assert host.start() == OK
    host.set(s_tip=1e200, v_tip=1e300)
    answers = [host.step(k * 0.01, 0.01) for k in range(5)]
    assert answers[-1] == DIVERGED
    assert host.get("limits_passed") == 2.0
    assert "diverged" in host.text("causes")


def test_limits_have_the_times_and_words_of_a_run(nov: stillhook.Crane, compiled):
    case = case_of(nov, tip="sine 5 m 9 s", mode="ns", load="200 t")
    begun = {"load": 200e3, "mode": code_of("ns")}
    host, (now,) = hosted(export(nov, case_of(nov)), compiled, rows(nov, case), ("limit_saturation",), **begun)
    run = stillhook.simulate(nov, case)
    passed = ("saturation", "relief", "overspeed", "stroke", "cavitation", "power", "boost", "slack", "wire")
    for name in passed:
        assert host.get(f"{name}_time") == pytest.approx(float(run[f"{name}_time"]), abs=0.0101), name
    words = set(str(run["status"].item()).split(", ")) - {
        "audit",
        "uncompensated",
        "offset",
        "unstable",
        "overload",
        "peak load",
    }
    assert "saturated" in words
    assert set(host.text("causes").split(", ")) == words
    assert host.get("limits_passed") == 1.0
    assert now.sum() * 0.01 == pytest.approx(float(run["saturation_time"]), abs=0.0101)


@pytest.mark.long
def test_plant_and_controller_apart_are_the_winch_with_its_plc(nov: stillhook.Crane, compiled):
    """The controller goes first at every point, on what the plant says that it reads."""
    case = case_of(nov)
    tip = rows(nov, case)
    plant, plc = (Host(export(nov, case, contents), compiled) for contents in ("plant", "controller"))
    plant.set(input_time=0, **dict(zip(TIP, tip[0], strict=True)))
    names = [p.name for p in plc.export.ports if p.name.startswith("sensed_")]

    def connect() -> None:
        plc.set(**{name: plant.get(name) for name in names})
        plant.set(**{name: plc.get(name) for name in ("u_p", "u_m", "brake")})

    assert plant.start() == OK
    plc.set(**{name: plant.get(name) for name in names})
    assert plc.start() == OK
    connect()
    e_c = [plant.get("e_c")]
    for k in range(len(tip) - 1):
        plant.set(**dict(zip(TIP, tip[k + 1], strict=True)))
        assert plc.step(k * 0.01, 0.01) == OK
        assert plant.step(k * 0.01, 0.01) == OK
        connect()
        e_c.append(plant.get("e_c"))
    assert np.abs(np.array(e_c) - series(nov, case)["e_c"].values).max() <= CLOSE


@pytest.mark.thorough
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("contents", CONTENTS)
def test_the_source_compiles_without_warnings(compiler: str, contents: str, nov: stillhook.Crane, tmp_path: Path):
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is not installed")
    (tmp_path / "m.c").write_text(export(nov, case_of(nov), contents).source)
    command = [compiler, "-std=c99", "-O1", "-Wall", "-Wextra", "-pedantic", "-Werror", "-c", "-o", "m.o", "m.c"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"contents": "motor"}, ("contents", "plant+controller")),
        ({"coupling": "rope"}, ("coupling", "tip, wire or vessel")),
        ({"contents": "controller", "coupling": "wire"}, ("coupling wire", "no wire")),
    ],
)
def test_what_cannot_be_exported_is_said_in_a_line(
    changes: dict[str, str], words: tuple[str, ...], nov: stillhook.Crane
):
    with pytest.raises(ExportError) as refused:
        export(nov, case_of(nov), **changes)
    assert all(word in str(refused.value) for word in words)
    assert "\n" not in str(refused.value)


def test_sensors_that_only_a_run_has_are_not_left_out_in_silence(nov: stillhook.Crane):
    with pytest.raises(ExportError, match="delay, noise"):
        export(nov, case_of(nov, sensors={"delay": "50 ms"}))
    with pytest.raises(ExportError, match="sensors: errors of s_w, p_a are not exported"):
        export(nov, case_of(nov, sensors={"p_a": {"noise": "1 bar"}, "s_w": {}}))


def test_a_platform_that_is_unknown_leaves_nothing_behind(nov: stillhook.Crane, tmp_path: Path):
    with pytest.raises(ExportError, match="linux64, win64, macos-arm64"):
        compile_library(export(nov, case_of(nov)).source, "amiga", tmp_path / "m.so")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_a_host_is_told_when_it_leaves_what_was_validated(tmp_path: Path, compiled):
    """Staged: 82 t to 164 t, 486 m to 2314 m, 0.8 m to 2 m, 8 s to 11 s, ns and ssc; ends reach 1 % further."""
    made = certificate_of(staged(write(tmp_path, synthetic=False))).signed(KEY)
    (tmp_path / "certificate.json").write_text(made.text(), encoding="utf-8")
    (tmp_path / "crane.toml").write_text(made.crane_toml(), encoding="utf-8")
    crane = stillhook.load_crane(tmp_path / "crane.toml")
    case = case_of(crane, load="100 t", s_w="1000 m", tip="sine 0.8 m 9 s", duration="70 s")
    twin, tip = export(crane, case), rows(crane, case)
    names = ("valid", *(p.name for p in twin.ports if p.name.startswith("valid_")))
    host, values = hosted(twin, compiled, tip, names)
    assert values.all()
    assert host.text("outside") == ""
    host.set(mode=code_of("hs"), f_pump=0.5)
    assert host.step(70.0, 0.01) == OK
    assert [name for name in names if not host.get(name)] == ["valid", "valid_mode", "valid_pumps"]
    assert host.text("outside") == "mode, loss of a hydraulic power unit"

    def after(tip: str = "sine 0.8 m 9 s", duration: str = "1 s", **begun: float) -> str:
        return hosted(twin, compiled, rows(crane, case_of(crane, tip=tip, duration=duration)), **begun)[0].text(
            "outside"
        )

    assert after(load=200e3) == "load"
    assert after(s_w_start=400.0) == "wire out"
    assert after("sine 1.5 m 9 s", "20 s") == "tip motion over 30 s"
    assert after("sine 0.8 m 14 s", "70 s") == "period of the tip"


def test_an_uncertified_crane_is_never_valid(nov: stillhook.Crane, compiled):
    host = Host(export(nov, case_of(nov)), compiled)
    assert host.start() == OK
    assert host.get("valid") == 0.0
    assert host.text("outside") == "not validated"


@pytest.mark.long
def test_a_winch_on_a_host_s_wire_is_that_of_a_session(nov: stillhook.Crane, compiled):
    """The tension of a run, given at the end of every cycle to the C core and to `Session`."""
    case = case_of(nov)
    run = series(nov, case)
    host, session = Host(export(nov, case, coupling="wire"), compiled), stillhook.Session(nov, case, coupling="wire")
    names = ("F_w", *TIP)
    host.set(input_time=0, **{n: float(run[n][0]) for n in TIP})
    assert host.start() == OK
    assert host.get("s_w") == session.get("s_w")
    for k in range(1, 601):
        given = {n: float(run[n][k]) for n in names}
        host.set(**given)
        assert host.step((k - 1) * 0.01, 0.01) == OK
        session.step(given)
    for name in ("s_w", "v_w", "e_c", "p_a", "omega_m"):
        bound = CLOSE if name == "e_c" else RELATIVE * float(np.abs(run[name]).max())
        assert abs(host.get(name) - session.get(name)) <= bound, name
    assert abs(host.get("s_w") - float(run["s_w"][600])) < 1e-4


def test_a_winch_outside_what_is_translated_is_refused_in_a_line(nov: stillhook.Crane, monkeypatch: pytest.MonkeyPatch):
    def outside(self: object, *arguments: object, **named: object) -> None:
        raise SubsetError("own.py:12: the statement Try")

    monkeypatch.setattr(generate.Translator, "function", outside)
    with pytest.raises(ExportError, match=r'"nov-250t": .* own\.py:12'):
        export(nov, case_of(nov))
