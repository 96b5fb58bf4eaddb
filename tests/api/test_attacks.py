"""Stillhook in the hands of a careless and of a hostile user: every input gives an answer or one line, and no bad run is called good."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray
from tests.commands import refusal

import stillhook
from stillhook import Scenario, compare, load_crane, metrics, save_run, simulate
from stillhook.base.atomic import atomic_folder
from stillhook.cli import run as command
from stillhook.errors import MotionError, ScenarioError, SimulationError, SpecError, StillhookError
from stillhook.formats.case_file import stored_cases
from stillhook.library import changed
from stillhook.spec.scenario import Operator, PowerLoss, Sensors

CRANE = load_crane("nov-250t")
PURE = load_crane("nov-100t-pure-active")
SWELL = "sine 1 m 10 s"
STILLHOOK = [sys.executable, "-c", "from stillhook.cli import main; main()"]
CASE = 'crane = "nov-250t"\n[scenario]\nload = "1 t"\ns_w = "10 m"\nduration = "35 s"\n'


def scenario(**fields) -> Scenario:
    return Scenario(**({"load": "100 t", "s_w": "100 m", "tip": SWELL, "duration": "65 s"} | fields))


def answer(crane=CRANE, **fields) -> xarray.Dataset:
    return simulate(crane, scenario(**fields), step="5 ms")


def status(crane=CRANE, **fields) -> set[str]:
    return set(answer(crane, **fields).status.item().split(", "))


def other(**tables):
    """The 250 t crane with some fields changed."""
    return changed(CRANE, tables)


def lowering(speed: str, since: str = "0 s") -> Operator:
    return Operator(profile=((since, "0 m/min"), ("40 s", speed)))


def process(*arguments: object, cache: Path | None = None, **options) -> subprocess.Popen:
    environment = os.environ | ({"STILLHOOK_CACHE": str(cache)} if cache is not None else {})
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen([*STILLHOOK, *map(str, arguments)], env=environment, text=True, **(pipes | options))


class TestLimitsAreNamed:
    def test_wire_that_runs_out_while_lowering_is_said_before_and_after_the_run(self):
        run = answer(s_w="2790 m", operator=lowering("-60 m/min"))
        assert "wire" in run.status.item().split(", ")
        assert run.wire_time.item() > 0.0
        assert "of wire out, and there are 0 m (hook at the crane tip) to 2804 m (3 turns kept)" in run.notes.item()

    def test_a_hook_that_is_pulled_into_the_crane_tip_is_not_ok(self):
        assert status(s_w="0.5 m") == {"wire"}
        assert status(s_w="2 m") == {"ok"}

    @pytest.mark.slow
    def test_a_hook_that_is_hauled_through_the_crane_tip_keeps_its_numbers(self):
        for crane in (CRANE, PURE):
            run = answer(crane, load="20 t", s_w="0 m", duration="100 s", operator=lowering("100 m/min", "1 s"))
            assert run.s_w.values[-1] < -crane.wire.L_0
            assert "wire" in run.status.item().split(", ")
            assert "audit" not in run.status.item()

    def test_an_empty_hook_at_the_crane_tip_hangs_still(self):
        for crane in (CRANE, PURE):
            assert status(crane, load="0 t", s_w="0 m", tip="still") == {"ok"}

    def test_motors_of_the_passive_circuit_have_a_speed_limit_too(self):
        slow = other(passive={"motor": {"n_max_full": "500 rev/min", "n_max": "900 rev/min"}})
        run = answer(slow)
        assert run.status.item() == "overspeed"
        assert "above their limit 900 rev/min" in run.notes.item()

    def test_a_load_beyond_the_passive_motors_is_foreseen(self):
        run = answer(other(SWL="1000 t"), load="800 t")
        assert run.status.item() != "ok"
        assert "holding the load takes 271% of the passive motors at 280 bar" in run.notes.item()
        assert "passive motors" not in answer(load="250 t", s_w="10 m").notes.item()

    def test_the_relief_valve_of_the_passive_circuit_is_one_of_the_reliefs(self):
        low = other(passive={"relief": {"p": "281 bar"}})
        run = answer(low)
        assert run.status.item() == "relief"
        assert run.p_max.item() < CRANE.active.relief.p

    def test_a_tip_faster_than_the_winch_at_this_load_and_layer_saturates_and_was_foreseen(self):
        run = answer(tip="sine 5 m 10 s")
        assert "saturated" in run.status.item()
        assert run.notes.item().startswith(
            "tip speed 188.5 m/min is above the 118.6 m/min that ssc reaches at this load and layer"
        )

    def test_an_operator_faster_than_the_winch_is_foreseen_like_the_tip(self):
        run = answer(s_w="500 m", operator=lowering("-200 m/min"))
        assert "saturated" in run.status.item()
        assert run.notes.item().startswith("speed of tip and operator ")

    @pytest.mark.parametrize(
        ("limit", "fields"),
        [
            ("slack", {"load": "0 t", "tip": "sine 10 m 6 s"}),
            ("cavitation", {"tip": "sine 20 m 12 s"}),
            ("accumulator", {"load": "250 t", "tip": "sine 8 m 30 s"}),
            ("relief", {"tip": "sine 20 m 12 s"}),
            ("saturated", {"operator": Operator(steps=(("40 s", "1 km"),))}),
        ],
    )
    def test_every_limit_has_its_name(self, limit, fields):
        assert limit in status(**fields)

    def test_layers_change_without_a_word(self):
        run = answer(s_w="290 m", duration="75 s", operator=lowering("-30 m/min"))
        assert np.ptp(np.ceil(run.layer.values)) == 1.0
        assert set(run.status.item().split(", ")) <= {"ok", "offset"}

    def test_events_after_the_end_of_the_run_are_said(self):
        run = answer(power_loss=PowerLoss(time="100 s"), modes=(("80 s", "ns"),))
        assert "the loss of a hydraulic power unit at 100 s comes after the end of the run at 65 s" in run.notes.item()
        assert "the change of mode at 80 s comes after" in run.notes.item()

    def test_a_loss_of_power_from_the_first_moment_is_run(self):
        assert status(power_loss=PowerLoss(time="0 s", run_down="0 s", detection="0 s")) == {"ok"}

    def test_a_set_point_step_at_the_first_moment_is_taken(self):
        run = answer(tip="still", operator=Operator(steps=(("0 s", "1 m"),)))
        assert run.s_w.values[-1] == pytest.approx(99.0, abs=0.5)


class TestBadWinchesAreNotCalledGood:
    @pytest.mark.parametrize("gain", ["2.5 1/m", "50 1/m", "1000 1/m"])
    @pytest.mark.parametrize("tip", ["still", SWELL])
    def test_a_gain_above_the_marginal_one_is_unstable_however_the_run_went(self, gain, tip):
        run = answer(other(control={"K_p": gain}), tip=tip)
        assert "unstable" in run.status.item()
        assert f"K_p {gain} is above the 2.063 1/m at which the position loop is marginally stable" in run.notes.item()

    def test_the_limit_of_the_gain_is_that_of_the_displacement_in_use(self):
        stiff = other(control={"K_p": "1.5 1/m"})
        assert status(stiff, mode="ssc") == {"ok"}
        assert "unstable" in status(stiff, mode="hs")
        assert status(stiff, mode="manual", tip="still") == {"ok"}

    def test_a_winch_that_does_not_follow_is_not_ok_though_no_limit_was_met(self):
        idle = other(active={"line": {"V": "999 m^3"}})
        assert status(idle) == {"uncompensated", "implausible"}

    def test_a_delay_that_makes_it_worse_is_not_ok(self):
        assert status(sensors=Sensors(delay="5 s")) == {"uncompensated", "implausible"}

    def test_a_run_whose_energy_does_not_add_up_is_not_ok(self):
        crane = other()
        rubber = crane.model_copy(update={"wire": crane.wire.model_copy(update={"E": 1e-3})})  # no file could say so
        assert "audit" in status(rubber)

    def test_manual_mode_has_no_control_error_and_no_efficiency(self):
        run = answer(mode="manual")
        assert run.status.item() == "ok"
        for name in ("e_c_pp", "eta_c", "e_c_max", "e_c_mean", "e_c_std"):
            assert np.isnan(run[name].item()), name

    def test_a_part_that_is_shorter_than_the_window_is_said(self):
        run = answer(duration="0.01 s", warm_up="0 s")
        assert run.counted_time.item() == pytest.approx(0.01)
        assert "shorter than the window of 30 s" in run.notes.item()

    @pytest.mark.slow
    @pytest.mark.parametrize(
        "tables",
        [
            {"active": {"motor": {"servo": {"omega_n": "99000 rad/s"}}}},
            {"active": {"pump": {"servo": {"omega_n": "2000 rad/s", "zeta": 0.001}}}},
            {"passive": {"motor": {"servo": {"omega_n": "99000 rad/s"}}}},
            {"passive": {"pump": {"servo": {"omega_n": "99000 rad/s"}}}},
            {"active": {"motor": {"C_1": "100 L/min/bar"}}},
            {"active": {"line": {"V": "1 L"}}},
            {"passive": {"accumulator": {"R_piston": "100 bar/(L/min)"}}},
            {"friction": {"system": {"Y_5": "1000 N m s/rad"}}},
        ],
    )
    def test_stiff_parts_are_refused_with_the_step_to_take(self, tables):
        crane = other(**tables)
        with pytest.raises(
            SpecError, match=r"is too long for this crane: .* \(allowed 2\.6\)\. (Use a step of \"|Check)"
        ) as e:
            simulate(crane, scenario())
        step = str(e.value).rpartition('Use a step of "')[2].partition('"')[0]
        if step and float(step.split()[0]) > 0.05:
            assert (
                simulate(crane, scenario(duration="10 s", warm_up="0 s"), step=step, on_failure="mark").status.item()
                != "diverged"
            )

    @pytest.mark.parametrize(
        ("tables", "text"),
        [
            ({"active": {"relief": {"p": "20 bar"}}}, "relief.p 20 bar is not above boost.p"),
            ({"control": {"t_cycle": "100 s"}}, 'control.t_cycle = "100 s": it must be less than or equal to 1'),
            ({"control": {"t_cycle": "0.001 ms"}}, "control.t_cycle"),
            ({"passive": {"accumulator": {"gas": {"V_0": "0.61 m^3"}}}}, "V_stroke 1.2 m^3 is too large for the gas"),
            ({"hook_mass": "0 t"}, "Nothing is suspended from the wire"),
        ],
    )
    def test_absurd_cranes_are_refused_in_one_line(self, tables, text):
        with pytest.raises(StillhookError) as e:
            simulate(other(**tables), scenario(load="0 t"))
        assert text in str(e.value)
        assert "\n" not in str(e.value)

    @pytest.mark.thorough
    @pytest.mark.parametrize("T_0", ["1 K", "-200 degC", "1900 K"])
    def test_nitrogen_at_a_temperature_that_no_accumulator_has_is_refused(self, T_0):
        pytest.importorskip("CoolProp")
        with pytest.raises(SpecError, match=r"T_0 must be between -73\.15 degC and 226\.9 degC"):
            simulate(other(passive={"accumulator": {"gas": {"model": "nitrogen", "T_0": T_0}}}), scenario())

    @pytest.mark.slow
    @pytest.mark.parametrize("t_cycle", ["5 ms", "7 ms", "20 ms", "150 ms"])
    def test_default_steps_fit_every_plc_cycle(self, t_cycle):
        crane = other(control={"t_cycle": t_cycle})
        one, many = simulate(crane, scenario()), simulate(crane, [scenario()])
        assert one.status.item() == many.status.values[0] == "ok"
        assert one.e_c_pp.item() == pytest.approx(many.e_c_pp.values[0], rel=0.01)


class TestScenarios:
    @pytest.mark.parametrize(
        ("fields", "text"),
        [
            ({"duration": "30.004 s"}, "leaves no whole PLC cycle of 0.01 s of the duration 30.004 s"),
            ({"load": "250.1 t"}, "(100.04 %)"),
        ],
    )
    def test_what_cannot_be_run_is_refused(self, fields, text):
        with pytest.raises(ScenarioError) as e:
            simulate(CRANE, scenario(**fields))
        assert text in str(e.value)

    @pytest.mark.parametrize("value", [float("nan"), -5.0, "100 t", None])
    def test_a_copy_with_a_bad_number_is_refused(self, value):
        with pytest.raises(ScenarioError, match=r"^load = .*: not a number of 0 or more in SI\."):
            simulate(CRANE, scenario().model_copy(update={"load": value}))

    def test_a_field_called_self_is_an_unknown_field(self):
        with pytest.raises(ScenarioError, match=r"^Scenario\.self: unknown field"):
            Scenario(**dict.fromkeys(("self", "load", "s_w"), "1 m"))

    def test_a_name_of_several_lines_is_shown_on_one(self):
        for bad in (lambda: Scenario(**{"a\nb": 1, "load": "1 t", "s_w": "1 m"}), lambda: scenario().with_mode("a\nb")):
            with pytest.raises(ScenarioError) as e:
                bad()
            assert "\n" not in str(e.value)
            assert r"a\nb" in str(e.value)

    @pytest.mark.parametrize("stored", [{}, None, {"tip": {"type": "still"}}, {"tip": 5}])
    def test_a_stored_scenario_that_is_none_is_refused(self, stored):
        with pytest.raises(StillhookError, match="Simulate again"):
            Scenario.from_dict(stored)


class TestPython:
    @pytest.mark.parametrize(
        ("crane", "case", "text"),
        [
            ("nov-250t", scenario(), 'crane = "nov-250t": not a Crane. Read one with load_crane'),
            (None, scenario(), "crane = nothing"),
            (CRANE, None, "case 0 = nothing: not a Scenario"),
            (CRANE, [scenario(), "x"], 'case 1 = "x": not a Scenario'),
            (CRANE, {"load": "1 t"}, 'case 0 = "load": not a Scenario'),
            (CRANE, [], "the list of cases is empty"),
        ],
    )
    def test_wrong_things_to_simulate_are_named(self, crane, case, text):
        with pytest.raises(StillhookError) as e:
            simulate(crane, case)
        assert text in str(e.value)

    @pytest.mark.parametrize(
        "options",
        [{"threads": 0}, {"threads": 1.5}, {"threads": "2"}, {"on_failure": "no"}, {"step": ""}, {"every": 0.1}],
    )
    def test_wrong_options_are_named(self, options):
        with pytest.raises(StillhookError, match=rf"^{next(iter(options))} = "):
            simulate(CRANE, [scenario()], **options)

    def test_unknown_options_fail(self):
        with pytest.raises(TypeError, match="speed"):
            simulate(CRANE, scenario(), speed="1 m/s")

    @pytest.mark.parametrize(
        ("arguments", "text"),
        [
            ((CRANE, scenario(), "ssc"), "give a list"),
            ((CRANE, scenario(), []), "empty"),
            ((CRANE, scenario(), ["ns", "ns"]), '"ns" is named twice'),
            ((CRANE, scenario(), [5]), "not one of"),
            (("nov-250t", scenario()), "not a Crane"),
            ((CRANE, None), "not a Scenario"),
            ((CRANE, [scenario()]), "a list of cases"),
        ],
    )
    def test_wrong_things_to_compare_are_named(self, arguments, text):
        with pytest.raises(StillhookError, match=text):
            compare(*arguments)

    @pytest.mark.slow
    def test_cases_of_different_length_come_back_in_the_order_given(self):
        cases = [scenario(duration=f"{40 + i} s", name=f"c{i}", load=f"{10 * i + 10} t") for i in (5, 0, 3, 1)]
        both = simulate(CRANE, cases)
        assert both.case.values.tolist() == ["c5", "c0", "c3", "c1"]
        alone = [simulate(CRANE, [c]).e_c_pp.values[0] for c in cases]
        assert both.e_c_pp.values.tolist() == alone
        series = simulate(CRANE, cases, series=True)
        assert np.isnan(series.e_c.values).sum(axis=1).tolist() == [0, 50, 20, 40]

    @pytest.mark.slow
    def test_one_case_in_twenty_that_loses_its_numbers_is_marked_and_the_rest_is_as_alone(self):
        jump = stillhook.Recorded(np.arange(200) * 0.5, 1e200 * np.sin(np.arange(200.0)))
        cases = [scenario(load=f"{i + 1} t") for i in range(20)]
        cases[7] = scenario(tip=jump)
        run = simulate(CRANE, cases, on_failure="mark")
        assert run.status.values.tolist() == ["diverged" if i == 7 else "ok" for i in range(20)]
        assert np.isnan(run.e_c_pp.values[7])
        assert run.e_c_pp.values[19] == simulate(CRANE, cases[19:]).e_c_pp.values[0]
        with pytest.raises(SimulationError, match=r"^1 of 20 cases failed\. First: case 7"):
            simulate(CRANE, cases)

    def test_the_series_of_a_lost_case_ends_where_its_numbers_do(self):
        jump = stillhook.Recorded(np.arange(200) * 0.5, np.where(np.arange(200) < 20, 0.0, 1e200))
        run = simulate(CRANE, scenario(tip=jump), on_failure="mark")
        lost = np.isnan(run.p_a.values)
        assert lost.any()
        assert lost[int(np.argmax(lost)) :].all()

    def test_metrics_say_what_a_dataset_lacks_and_refuse_a_window_that_is_none(self):
        with pytest.raises(StillhookError, match="no time series"):
            metrics.eta_c(simulate(CRANE, [scenario()]))
        run = answer(tip="still")
        assert metrics.e_c_pp(run, window="30 s").identical(metrics.e_c_pp(run))
        for window in (0, 30.0, float("nan"), "30", "0 s", "-1 s", "30 m", None):
            with pytest.raises(StillhookError, match=r"^metrics: window = "):
                metrics.e_c_pp(run, window=window)
        with pytest.raises(StillhookError, match="has no e_c"):
            metrics.e_c_pp(run.drop_vars("e_c"))
        with pytest.raises(StillhookError, match="after the end of the run"):
            metrics.settling_time(run, start="1e6 s", target="0 m/s", step="1 m/s")
        assert metrics.e_c_pp(run, window="1e9 s").isnull().all()

    def test_complex_heights_are_no_motion(self):
        with pytest.raises(MotionError, match="not numbers"):
            stillhook.Recorded(np.arange(10.0), np.arange(10.0) * 1j)


class TestCaseFiles:
    @pytest.mark.thorough
    @pytest.mark.parametrize(
        ("content", "text"),
        [
            (b"", "empty. A case file needs crane and [scenario]"),
            (b"crane = 5\n[scenario]\n", "crane = 5"),
            (b"crane = 'nov-250t'\n", "scenario: missing"),
            (b"crane = 'nov-250t'\n[scenario]\nload = 100\ns_w = '1 m'\n", "load = 100: a bare number"),
            (CASE.encode() + b"tip = { file = 'no.csv' }\n", "no.csv"),
            (b"x = " + b"[" * 5000 + b"]" * 5000, "not valid TOML"),
            (CASE.encode("utf-16"), "not UTF-8"),
            (CASE.encode() + b"\x00", "not valid TOML"),
            (CASE.encode() + b'"a\\nb" = 1\n', r"a\nb: unknown field"),
            (CASE.encode() + b"sensors = { seed = 1.5 }\n", "Sensors.seed = 1.5"),
            (CASE.encode() + b"operator = { profile = [['0 s']] }\n", "Operator.profile[0][1]: missing"),
            (CASE.encode() + b"modes = [['5 s', 'ns'], ['5 s', 'hs']]\n", "times must rise"),
            (CASE.encode() + b"water = []\n", "Scenario.water = []: it must be a table"),
            (CASE.encode() + b"power_loss = { time = '0 s', unit = 4 }\n", "power_loss.unit 4"),
            (b'step = "3 ms"\n' + CASE.encode(), "not a whole part of the PLC cycle"),
            (CASE.replace("nov-250t", "a" * 5000 + ".toml").encode(), "File name too long"),
            (CASE.encode() + b"#" * 2_000_000, "holds more than 1 MB"),
            (b"crane = 'nov-250t'\n[[scenario]]\nload = '1 t'\n", "scenario: write one table, [scenario]"),
        ],
    )
    def test_bad_ones_are_one_line_that_names_the_file(self, capsys, tmp_path, content, text):
        file = tmp_path / "case.toml"
        file.write_bytes(content)
        line = refusal(capsys, "run", file, "--out", tmp_path / "out")
        assert text in line
        assert "case.toml" in line
        assert not (tmp_path / "out").exists()

    @pytest.mark.slow
    @pytest.mark.parametrize("name", [".", "/dev/zero", "fifo", "loop", "nowhere", "a" * 300, "a\0b"])
    def test_what_is_no_file_is_refused_at_once(self, capsys, tmp_path, monkeypatch, name):
        monkeypatch.chdir(tmp_path)
        if name == "fifo":
            os.mkfifo(name)
        if name == "loop":
            os.symlink(name, name)
        refusal(capsys, "run", name)

    @pytest.mark.parametrize("content", [b"\xef\xbb\xbf" + CASE.encode(), CASE.replace("\n", "\r\n").encode()])
    def test_byte_order_marks_and_foreign_line_ends_do_no_harm(self, capsys, tmp_path, content):
        file = tmp_path / "é ☃.toml"
        file.write_bytes(content)
        assert command(["run", str(file), "--json"]) == 0
        strict(capsys.readouterr().out)

    @pytest.mark.slow
    @pytest.mark.parametrize(
        "option",
        [
            ["--motion", "x" * 5000],
            ["--motion", "a\0b"],
            ["--controllers", "ns\nhs"],
            ["--controllers", "ns,ns"],
            ["/"],
        ],
    )
    def test_odd_arguments_are_one_line(self, capsys, option):
        refusal(capsys, "compare", *option)

    @pytest.mark.long
    def test_two_cases_of_one_name_stay_two(self, capsys, tmp_path):
        file = save_run(
            simulate(CRANE, [scenario(duration="35 s"), scenario(duration="35 s", load="50 t")]), tmp_path / "two.nc"
        )
        assert command(["run", str(file), "--json"]) == 0
        assert list(json.loads(capsys.readouterr().out)) == ["0", "1"]

    @pytest.mark.thorough
    @pytest.mark.parametrize(
        "attribute", [{"scenarios": "x"}, {"scenarios": "[{}]"}, {"scenarios": "[]"}, {"step": "x"}, {"crane": 5}]
    )
    def test_stored_runs_that_were_tampered_with_are_refused(self, tmp_path, attribute):
        run = simulate(CRANE, [scenario(duration="35 s")])
        run.attrs |= attribute
        with pytest.raises(StillhookError):
            stored_cases(save_run(run, tmp_path / "run.nc"))


def strict(text: str) -> object:
    """JSON without NaN and with nothing around it."""

    def none(name: str) -> None:
        raise ValueError(name)

    return json.loads(text, parse_constant=none)


class TestOutput:
    FAST = ("compare", "--motion", SWELL, "--duration", "35 s", "--controllers", "ssc")

    @pytest.mark.slow
    @pytest.mark.parametrize("tip", ["still", "sine 20 m 12 s"])
    def test_json_is_strict_and_alone(self, capsys, tip):
        command(["compare", "--motion", tip, "--duration", "35 s", "--controllers", "manual,ssc", "--json"])
        out = capsys.readouterr()
        assert set(strict(out.out)) == {"manual", "ssc"}

    @pytest.mark.slow
    @pytest.mark.parametrize("taken", ["out", "out/panels.png/x", "out/runs.nc/x", "out/summary.json/x"])
    def test_a_folder_that_cannot_take_the_files_is_refused_before_the_run(self, capsys, tmp_path, taken):
        path = tmp_path / taken
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("mine")
        assert "cannot be written" in refusal(capsys, *self.FAST, "--out", tmp_path / "out")
        assert [p for p in tmp_path.rglob("*") if p.is_file()] == [path]

    def test_files_of_a_run_appear_together_or_not_at_all(self, tmp_path):
        def fill(folder: Path) -> None:
            with atomic_folder(folder) as part:
                (part / "panels.png").write_text("half")
                raise OSError(28, "No space left on device")

        with pytest.raises(SimulationError, match="No space left"):
            fill(tmp_path / "out")
        assert not (tmp_path / "out").exists()
        with atomic_folder(tmp_path / "out") as part:
            (part / "a").write_text("whole")
        assert [p.name for p in (tmp_path / "out").iterdir()] == ["a"]

    @pytest.mark.thorough
    @pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
    def test_a_full_disk_under_the_output_is_one_line(self):
        with open("/dev/full", "w") as full:
            p = process("calc", "speed", "nov-250t", "--json", stdout=full)
            error = p.communicate()[1]
        assert p.returncode == 2
        assert error == "error: standard output: No space left on device. Choose another place for the output.\n"

    @pytest.mark.thorough
    @pytest.mark.skipif(os.name == "nt", reason="pipes close differently there")
    def test_a_reader_that_leaves_causes_no_traceback(self):
        p = process("crane", "nov-250t", "--json")
        p.stdout.close()
        assert (p.wait(), p.stderr.read()) == (141, "")
        p.stderr.close()

    @pytest.mark.thorough
    @pytest.mark.skipif(os.name == "nt", reason="no SIGINT to send there")
    def test_an_interrupt_leaves_nothing_and_says_so(self, tmp_path):
        def listening():
            signal.signal(signal.SIGINT, signal.default_int_handler)

        answer(duration="31 s")  # the model is compiled
        p = process("compare", "--duration", "24 h", "--out", tmp_path / "out", preexec_fn=listening)
        time.sleep(2.5)
        p.send_signal(signal.SIGINT)
        out, error = p.communicate()
        assert (p.returncode, out, error) == (130, "", "stopped: no file was left half-written\n")
        assert not (tmp_path / "out").exists()

    @pytest.mark.thorough
    def test_bad_input_says_nothing_of_compiling(self, tmp_path):
        p = process("compare", "--load", "320 t", cache=tmp_path / "cache")
        assert p.communicate()[1].splitlines() == [
            'error: Load 320 t exceeds the SWL 250 t of "nov-250t" (128 %). Lower the load or choose another crane.'
        ]


class TestCache:
    FAST = ("compare", "--motion", "still", "--duration", "31 s", "--controllers", "ssc", "--json")

    @pytest.mark.thorough
    def test_two_that_start_with_a_cold_cache_agree_and_damage_is_mended(self, tmp_path):
        both = [process(*self.FAST, cache=tmp_path / "cache") for _ in range(2)]
        first, second = [p.communicate()[0] for p in both]
        assert first == second
        strict(first)
        for file in (tmp_path / "cache").rglob("*.nbi"):
            file.write_bytes(file.read_bytes()[:50])
        again = process(*self.FAST, cache=tmp_path / "cache")
        assert again.communicate()[0] == first
        assert again.returncode == 0
