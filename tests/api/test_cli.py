"""The command line as a user meets it: what it prints, what it returns, what it refuses and how."""

import errno
import json
import os
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from tests import commands
from tests.commands import case_file, refusal

from stillhook import cranes
from stillhook.cli import run

SUMMARY_KEYS = {"e_c_pp", "e_c_max", "eta_c", "p_max", "alpha_m_min", "u_p_max", "saturation_time", "status"}


@pytest.fixture
def fast(tmp_path: Path) -> Callable[..., str]:
    """A case file of a short run; other fields of its scenario, or another crane, by name."""
    return lambda crane="nov-250t", **fields: case_file(
        tmp_path, crane, **({"tip": "sine 1 m 10 s", "duration": "45 s", "warm_up": "10 s"} | fields)
    )


@pytest.fixture
def answer(capsys: pytest.CaptureFixture[str]) -> Callable[..., object]:
    return lambda *arguments, code=0: commands.answer(capsys, *arguments, code=code)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "name", "value", "digits"),
    [
        (["motor-loss", "A6VM215", "D_m=215 cm^3/rev", "omega_m=1000 rev/min", "dp_m=200 bar"], "T_fm", 38.698797, 6),
        (["friction", "crane-1", "T_d=1.5 MN m", "omega_m=100 rev/min"], "T_fs", 45.927398, 6),
        (["drum", "nov-250t", "layer=6"], "K_wire", 1.322614, 6),
        (["speed", "nov-250t"], "v_w_max", 72.47127 / 60.0, 7),
        (["speed", "nov-250t", "alpha_m=0.6"], "v_w_max", 72.47127 / 36.0, 6),
        (["eigenfrequency", "nov-250t"], "omega_0", 12.526991, 6),
        (["gain-limit", "nov-250t"], "K_p_ms", 2.026039, 6),
        (["gain-limit", "nov-250t", "alpha_m=0.6"], "K_p_ms", 0.998272, 6),
        (["steady", "nov-250t", "v_w=80 m/min"], "alpha_m", 0.760498, 6),
        (["steady", "nov-250t", "v_w=80 m/min", "controller=ssc"], "u_p", 0.839502, 6),
    ],
)
def test_single_numbers_are_those_of_the_specification(answer, words, name, value, digits):
    assert answer("calc", *words)[name] == pytest.approx(value, abs=0.6 * 10.0**-digits)


def test_all_layers_hold_all_the_wire(answer):
    rows = answer("calc", "drum", "nov-250t")
    assert len(rows) == 12
    assert sum(r["wire_length"] for r in rows) == pytest.approx(rows[-1]["wire_left"], rel=1e-12)


class TestCompare:
    def test_one_object_a_mode_with_the_documented_keys(self, answer, fast):
        result = answer("compare", fast(), "--controllers", "ns,ssc")
        assert list(result) == ["ns", "ssc"]
        for summary in result.values():
            assert set(summary) >= SUMMARY_KEYS
            assert summary["status"] == "ok"

    def test_compare_shows_the_motion_of_the_load_with_a_controller_that_gives_wire(self, answer, fast, capsys):
        result = answer("compare", fast(), "--controllers", "ssc,rope")
        assert all(0.0 < row["load_pp"] < row["s_tip_pp"] for row in result.values())
        assert "load_pp" not in answer("compare", fast(), "--controllers", "ssc")["ssc"]
        run(["compare", fast(), "--controllers", "ssc,rope"])
        shown = capsys.readouterr()
        assert "load p-p" in shown.out
        assert "Smallest motion of the load" in shown.out
        assert "rope: its control error holds the wire that it gives on purpose" in shown.out + shown.err

    def test_what_is_typed_goes_before_the_case_file(self, answer, fast):
        by_file, typed = (
            answer("compare", fast(load=load), "--controllers", "ssc", *more)
            for load, more in (("50 t", ()), ("100 t", ("--load", "50 t")))
        )
        assert typed == by_file

    @pytest.mark.thorough
    def test_files_are_written_and_repeat_the_run(self, answer, fast, tmp_path):
        out = tmp_path / "out"
        answer("compare", fast(), "--controllers", "ssc", "--out", str(out))
        assert sorted(p.name for p in out.iterdir()) == [
            "panels.png",
            "runs.nc",
            "stillhook-manifest.json",
            "summary.json",
        ]
        assert answer("run", str(out / "runs.nc")) == json.loads((out / "summary.json").read_text())["ssc"]

    def test_a_winch_without_an_answer_says_no(self, capsys, fast):
        assert run(["compare", fast(tip="sine 4 m 12 s", warm_up="15 s"), "--controllers", "ns", "--verbose"]) == 1
        out = capsys.readouterr().out
        assert "saturated" in out
        assert "above the 88.95 m/min that ns reaches" in out

    def test_pure_active_crane_is_never_called_good_with_a_standing_offset(self, answer, fast):
        result = answer("compare", fast("nov-100t-pure-active"), "--controllers", "ns,hs", code=1)
        assert "offset" in result["ns"]["status"].split(", ")
        assert "relief" in result["hs"]["status"]
        assert any("standing offset" in note for note in result["ns"]["notes"])
        assert any("the load will sink" in note for note in result["hs"]["notes"])


LOSS = ["calc", "motor-loss", "A6VM215", "omega_m=1 rev/min", "dp_m=1 bar"]


class TestRefusals:
    @pytest.mark.thorough
    @pytest.mark.parametrize(
        ("arguments", "text"),
        [
            (["compare", "--load", "320 t"], 'Load 320 t exceeds the SWL 250 t of "nov-250t" (128 %). Lower the load'),
            (["compare", "--load", "100"], "100"),
            (["compare", "--load", "-5 t"], "greater than or equal to 0"),
            (["compare", "--load", "nan t"], "nan t"),
            (["compare", "--s-w", "5000 m"], "of wire that"),
            (["compare", "--motion", "sine 2.8 12"], "--motion"),
            (["compare", "--motion", "nothing.csv"], "no such file"),
            (["compare", "--controllers", "ns,fast"], 'mode "fast" is not one of'),
            (["compare", "--controllers", ","], "modes: empty"),
            (["compare", "nov-25t"], "nov-25t"),
            (["compare", "--duration", "20 s"], "warm_up 30 s leaves nothing"),
            (["run", "nothing.toml"], "no such file"),
            (["run", "nothing.nc"], "no such file"),
            (["crane", "nothing"], "nothing"),
            (["calc", "drum", "nov-250t", "layer=13"], "layers 1 to 12"),
            (["calc", "drum", "nov-250t", "layer=a"], 'layer = "a": is not a number'),
            (["calc", "speed", "nov-250t", "alpha_m=0"], "above 0 up to 1"),
            ([*LOSS, "D_m=215 cm^3"], '"cm^3" is not one of'),
            ([*LOSS, "D_m=300 cm^3/rev"], "215 cm^3/rev"),
            (["calc", "friction", "crane-9", "T_d=1 MN m", "omega_m=1 rev/min"], "crane-9"),
            (["compare", "--nonsense"], "--nonsense"),
            (["nonsense"], "nonsense"),
        ],
    )
    def test_bad_input_is_one_line_and_exit_code_2(self, capsys, arguments, text):
        assert text in refusal(capsys, *arguments)

    def test_output_that_cannot_be_written_leaves_nothing(self, capsys, fast, tmp_path):
        (tmp_path / "taken").write_text("")
        out = str(tmp_path / "taken" / "deeper")
        assert "cannot be written" in refusal(capsys, "compare", fast(), "--controllers", "ssc", "--out", out)


class TestShape:
    @pytest.mark.slow
    def test_cranes_are_listed_and_shown_with_sources(self, answer):
        assert [c["name"] for c in answer("list", "cranes")] == list(cranes())
        fields = answer("crane", "nov-250t")["fields"]
        assert all(f["source"] and f["kind"] for f in fields.values())

    @pytest.mark.slow
    def test_a_user_file_on_a_library_crane_works_the_same(self, answer, fast, tmp_path: Path):
        (tmp_path / "mine.toml").write_text('base = "nov-250t"\nname = "mine"\n[control]\nK_p = "0.3 1/m"\n')
        stiff = answer("compare", fast("mine.toml"), "--controllers", "ssc")
        plain = answer("compare", fast(), "--controllers", "ssc")
        assert stiff["ssc"]["e_c_pp"] < plain["ssc"]["e_c_pp"]


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="a caller closes streams differently there")
def test_a_stream_that_the_caller_closed_changes_no_exit_code():
    for arguments, code in ((["calc", "speed", "nov-250t"], 0), (["calc", "speed", "no-crane"], 2)):
        command = shlex.join([sys.executable, "-m", "stillhook", *arguments])
        assert subprocess.run(f"{command} <&- >&- 2>&-", shell=True).returncode == code


def test_a_name_that_no_system_takes_is_shown_in_part(capsys):
    line = refusal(capsys, "manifest", "x" * 5000)
    assert line.endswith('...": File name too long. Check the name, your rights and the room there.')
    assert len(line) < 300


def test_too_many_open_files_are_not_taken_for_a_full_disk(monkeypatch, capsys):
    def opened(arguments):
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE), "/usr/lib/a")

    monkeypatch.setattr("stillhook.cli._called", opened)
    assert "Raise the limit (ulimit -n)" in refusal(capsys, "list", "cranes")
