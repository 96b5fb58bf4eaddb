"""The command line as a user meets it: what it prints, what it returns, what it refuses and how."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from stillhook import cranes
from stillhook.cli import run

SUMMARY_KEYS = {
    "e_c_pp",
    "e_c_max",
    "eta_c",
    "p_a_max",
    "p_max",
    "alpha_p_max",
    "alpha_m_min",
    "u_p_max",
    "saturation_time",
    "relief_time",
    "status",
}
FAST = ["--motion", "sine 1 m 10 s", "--duration", "45 s", "--warm-up", "10 s"]


def answer(capsys: pytest.CaptureFixture[str], *arguments: str) -> object:
    assert run([*arguments, "--json"]) in (0, 1)
    return json.loads(capsys.readouterr().out)


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line of an error; nothing else is printed and the exit code is 2."""
    assert run(list(arguments)) == 2
    out = capsys.readouterr()
    assert out.out == ""
    lines = out.err.strip().splitlines()
    assert len(lines) == 1, lines
    assert lines[0].startswith("error: ")
    return lines[0]


class TestCalc:
    def test_motor_loss_of_the_specification(self, capsys):
        loss = answer(
            capsys,
            "calc",
            "motor-loss",
            "A6VM215",
            "--displacement",
            "215 cm^3/rev",
            "--speed",
            "1000 rev/min",
            "--dp",
            "200 bar",
        )
        assert round(loss["T_fm"], 6) == 38.698797

    def test_friction_of_the_specification(self, capsys):
        friction = answer(capsys, "calc", "friction", "crane-1", "--drum-torque", "1.5 MN m", "--speed", "100 rev/min")
        assert round(friction["T_fs"], 6) == 45.927398

    def test_drum_layer_of_the_specification(self, capsys):
        row = answer(capsys, "calc", "drum", "nov-250t", "--layer", "6")
        assert round(row["K_wire"], 6) == 1.322614
        assert row["layer"] == 6

    def test_all_layers_hold_all_the_wire(self, capsys):
        rows = answer(capsys, "calc", "drum", "nov-250t")
        assert len(rows) == 12
        assert sum(r["wire_length"] for r in rows) == pytest.approx(rows[-1]["wire_left"], rel=1e-12)

    @pytest.mark.slow
    def test_speed_of_the_specification(self, capsys):
        full = answer(capsys, "calc", "speed", "nov-250t")
        assert round(full["v_w_max"] * 60.0, 5) == 72.47127
        reduced = answer(capsys, "calc", "speed", "nov-250t", "--alpha-m", "0.6")
        assert reduced["v_w_max"] == pytest.approx(full["v_w_max"] / 0.6, rel=1e-12)

    def test_eigenfrequency_of_the_specification(self, capsys):
        assert round(answer(capsys, "calc", "eigenfrequency", "nov-250t")["omega_0"], 6) == 12.526991

    @pytest.mark.slow
    def test_gain_limit_of_the_specification(self, capsys):
        assert round(answer(capsys, "calc", "gain-limit", "nov-250t")["K_p_ms"], 6) == 2.026039
        assert round(answer(capsys, "calc", "gain-limit", "nov-250t", "--alpha-m", "0.6")["K_p_ms"], 6) == 0.998272

    def test_steady_ssc_of_the_specification(self, capsys):
        steady = answer(capsys, "calc", "steady", "nov-250t", "--v-w", "80 m/min")
        assert round(steady["alpha_m"], 6) == 0.760498
        assert round(steady["u_p"], 6) == 0.839502


class TestCompare:
    def test_one_object_a_mode_with_the_documented_keys(self, capsys):
        result = answer(capsys, "compare", "--controllers", "ns,ssc", *FAST)
        assert list(result) == ["ns", "ssc"]
        for summary in result.values():
            assert set(summary) >= SUMMARY_KEYS
            assert summary["status"] == "ok"

    @pytest.mark.thorough
    def test_files_are_written_and_repeat_the_run(self, capsys, tmp_path):
        assert run(["compare", "--controllers", "ssc", *FAST, "--out", str(tmp_path / "out")]) == 0
        assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["panels.png", "runs.nc", "summary.json"]
        stored = json.loads((tmp_path / "out" / "summary.json").read_text())
        capsys.readouterr()
        again = answer(capsys, "run", str(tmp_path / "out" / "runs.nc"))
        assert again == stored["ssc"]

    def test_a_winch_without_an_answer_says_no(self, capsys):
        assert (
            run(
                [
                    "compare",
                    "--controllers",
                    "ns",
                    "--motion",
                    "sine 4 m 12 s",
                    "--duration",
                    "45 s",
                    "--warm-up",
                    "15 s",
                ]
            )
            == 1
        )
        out = capsys.readouterr().out
        assert "saturated" in out
        assert "above the 88.95 m/min that ns reaches" in out

    def test_pure_active_crane_is_never_called_good_with_a_standing_offset(self, capsys):
        result = answer(capsys, "compare", "nov-100t-pure-active", "--load", "100 t", "--controllers", "ns,hs", *FAST)
        assert "offset" in result["ns"]["status"].split(", ")
        assert "relief" in result["hs"]["status"]
        assert any("standing offset" in note for note in result["ns"]["notes"])
        assert any("the load will sink" in note for note in result["hs"]["notes"])


class TestRefusals:
    @pytest.mark.thorough
    @pytest.mark.parametrize(
        ("arguments", "text"),
        [
            (
                ["compare", "--load", "320 t"],
                'Load 320 t exceeds the SWL 250 t of "nov-250t" (128 %). Lower the load or choose another crane.',
            ),
            (["compare", "--load", "100"], "100"),
            (["compare", "--load", "-5 t"], "greater than or equal to 0"),
            (["compare", "--load", "nan t"], "nan t"),
            (["compare", "--s-w", "5000 m"], "of wire that"),
            (["compare", "--motion", "sine 2.8 12"], "--motion"),
            (["compare", "--motion", "nothing.csv"], "no such file"),
            (["compare", "--controllers", "ns,fast"], 'mode "fast" is not one of'),
            (["compare", "--controllers", ","], "modes: empty"),
            (["compare", "nov-25t"], "nov-25t"),
            (["compare", "--step", "3 ms"], "not a whole part of the PLC cycle"),
            (["compare", "--duration", "20 s"], "warm_up 30 s leaves nothing"),
            (["run", "nothing.toml"], "no such file"),
            (["run", "nothing.nc"], "no such file"),
            (["crane", "nothing"], "nothing"),
            (["calc", "drum", "nov-250t", "--layer", "13"], "layers 1 to 12"),
            (["calc", "speed", "nov-250t", "--alpha-m", "0"], "above 0 up to 1"),
            (
                [
                    "calc",
                    "motor-loss",
                    "A6VM215",
                    "--displacement",
                    "215 cm^3",
                    "--speed",
                    "1 rev/min",
                    "--dp",
                    "1 bar",
                ],
                '"cm^3" is not one of',
            ),
            (
                [
                    "calc",
                    "motor-loss",
                    "A6VM215",
                    "--displacement",
                    "300 cm^3/rev",
                    "--speed",
                    "1 rev/min",
                    "--dp",
                    "1 bar",
                ],
                "215 cm^3/rev",
            ),
            (["calc", "friction", "crane-9", "--drum-torque", "1 MN m", "--speed", "1 rev/min"], "crane-9"),
            (["compare", "--nonsense"], "--nonsense"),
            (["nonsense"], "nonsense"),
        ],
    )
    def test_bad_input_is_one_line_and_exit_code_2(self, capsys, arguments, text):
        assert text in refusal(capsys, *arguments)

    @pytest.mark.thorough
    @pytest.mark.parametrize(
        ("content", "text"),
        [
            ("", "empty. A case file needs crane and [scenario]"),
            ("crane = 5\n[scenario]\n", "crane = 5"),
            ("crane = 'nov-250t'\n", "scenario: missing"),
            ("crane = 'nov-250t'\n[scenario]\nload = '1 t'\n", "s_w"),
            ("crane = 'nov-250t'\n[scenario]\nload = 100\ns_w = '1 m'\n", "100"),
            ("crane = 'nov-250t'\n[scenario]\nload = '1 t'\ns_w = '1 m'\nspeed = '1 m'\n", "speed"),
            ("crane = 'nov-250t'\n[scenario]\nload = '1 t'\ns_w = '1 m'\ntip = { file = 'no.csv' }\n", "no.csv"),
            ("crane = 'nov-250t'\n[scenario]\nload = '1 t'\ns_w = '1 m'\nsensors = 3\n", "sensors"),
            ("crane = [", "not valid TOML"),
        ],
    )
    def test_bad_case_files_are_one_line_that_names_the_file(self, capsys, tmp_path, content, text):
        file = tmp_path / "case.toml"
        file.write_text(content)
        line = refusal(capsys, "run", str(file), "--out", str(tmp_path / "out"))
        assert text in line
        assert "case.toml" in line
        assert not (tmp_path / "out").exists()

    def test_output_that_cannot_be_written_leaves_nothing(self, capsys, tmp_path):
        (tmp_path / "taken").write_text("")
        assert run(["compare", "--controllers", "ssc", *FAST, "--out", str(tmp_path / "taken" / "deeper")]) == 2
        assert "cannot be written" in capsys.readouterr().err


class TestShape:
    @pytest.mark.slow
    def test_help_imports_nothing_heavy(self):
        code = "import sys; from stillhook.cli import run; run(['--help']); print([m for m in ('numba', 'xarray', 'scipy', 'matplotlib', 'polars') if m in sys.modules])"
        out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert out.stdout.strip().splitlines()[-1] == "[]"

    @pytest.mark.thorough
    def test_every_command_has_help_with_an_example(self, capsys):
        for command in (
            ["list", "cranes"],
            ["crane"],
            ["run"],
            ["compare"],
            ["demo"],
            *(["calc", c] for c in ("motor-loss", "friction", "drum", "speed")),
        ):
            assert run([*command, "--help"]) == 0
            assert "Example: stillhook" in " ".join(capsys.readouterr().out.split()), command

    @pytest.mark.slow
    def test_cranes_are_listed_and_shown_with_sources(self, capsys):
        assert [c["name"] for c in answer(capsys, "list", "cranes")] == list(cranes())
        fields = answer(capsys, "crane", "nov-250t")["fields"]
        assert all(f["source"] and f["kind"] for f in fields.values())

    @pytest.mark.slow
    def test_a_user_file_on_a_library_crane_works_the_same(self, capsys, tmp_path: Path):
        file = tmp_path / "mine.toml"
        file.write_text('base = "nov-250t"\nname = "mine"\n[control]\nK_p = "0.3 1/m"\n')
        stiff = answer(capsys, "compare", str(file), "--controllers", "ssc", *FAST)
        plain = answer(capsys, "compare", "--controllers", "ssc", *FAST)
        assert stiff["ssc"]["e_c_pp"] < plain["ssc"]["e_c_pp"]
