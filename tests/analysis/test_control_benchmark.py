"""The benchmark of controllers: its seas, its scores, its command, and margins of a controller that learns."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from benchmarks.control import course, report
from benchmarks.control.entries import REFERENCE, shipped

from stillhook import Mode, load_crane
from stillhook.engine.pack.winch import pack
from stillhook.library import changed
from stillhook.sea.motion.recorded import window_spans

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "docs" / "how-to" / "enter-the-benchmark.md"


def entry_of_the_guide() -> str:
    return GUIDE.read_text(encoding="utf-8").partition("```python\n")[2].partition("```")[0]


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory):
    """The quick course by the command, with the guide's entry, from an empty store."""
    folder = tmp_path_factory.mktemp("benchmark")
    (folder / "ssc_more.py").write_text(entry_of_the_guide(), encoding="utf-8")
    command = [sys.executable, "-m", "benchmarks.control", "--quick", "--json", "--entry", str(folder / "ssc_more.py")]
    command += ["--store", str(folder / "store"), "--ship", str(folder / "none.txt")]
    paths = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
    done = subprocess.run(
        command, cwd=folder, env=os.environ | {"PYTHONPATH": paths}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_highest_third_of_a_sea_is_the_share_of_its_height_that_the_tip_has():
    duration = 1800.0
    t = np.arange(0.0, duration, 0.25)
    s = course.jonswap(2.0, 9.0, duration).sample(t)[0]
    assert 4.0 * np.std(s) == pytest.approx(0.7 * 2.0, rel=0.05)


def test_the_range_of_a_sine_is_twice_its_amplitude_in_any_window_of_a_period():
    t = np.arange(0.0, 60.0, 0.1)
    x = 0.3 * np.sin(2.0 * np.pi * t / 12.0)
    assert window_spans(x, 121).max() == pytest.approx(0.6, rel=1e-3)
    assert window_spans(x + 0.05 * t, 121).max() > window_spans(x, 121).max()
    assert window_spans(x, 11).max() < 0.3  # a second of a sine of 12 s


def test_the_draws_change_the_machine_and_leave_the_plc_as_it_is():
    crane = load_crane(course.CRANE)
    case = course.seas(course.QUICK)["Hs 2 m, Tp 9 s"]
    pairs = course.plants(crane, case, 3)
    assert len({repr(c.friction) for c, _ in pairs}) == 3
    known = pack(crane, case).params.plc
    assert all(pack(*pair).params.plc.plant == known.plant for pair in pairs)
    assert all(pack(*pair).params.plc.gains == known.gains for pair in pairs)


def test_the_command_runs_every_controller_and_the_guides_entry(quick):
    assert {e.name for e in shipped()} | {"ssc-more"} == set(quick)
    assert set(quick["ssc-more"]["settings"]["Hs 2 m, Tp 9 s"]) == {"lead", "K_p"}
    assert quick["ssc-more"]["settings"]["Hs 2 m, Tp 9 s"]["lead"] in (0.035, 0.05, 0.065)


def test_ssc_at_its_best_has_less_error_than_with_the_crane_files_settings(quick):
    for sea, scores in quick[REFERENCE]["scores"].items():
        assert scores["e_c_pp"] < quick["ssc-published"]["scores"][sea]["e_c_pp"]


def test_fixed_motors_do_not_travel_and_the_small_displacement_takes_the_pressure(quick):
    assert report.mean(quick["hs"], "travel_m") == pytest.approx(0.0, abs=1e-3)
    assert report.mean(quick["hs"], "p_max") > 1.2 * report.mean(quick[REFERENCE], "p_max")


def test_the_load_moves_more_than_the_wire_alone_would_have_it(quick):
    """On 487 m of wire the load swings on top of the control error."""
    for e in quick.values():
        assert report.mean(e, "load_pp") > report.mean(e, "e_c_pp")


def test_tables_and_figure_name_every_entry(quick):
    for name, of in report.TABLES.items():
        head, rows = of(quick)
        assert all(len(row) == len(head) for row in rows)
        names = head if name == "seas" else [row[0] for row in rows]
        assert set(quick) - {REFERENCE} <= set(names)
    assert len(report.figure(quick).axes) == 2
    assert "travel of the pumps" in dict(report.losses_table(quick)[1])["ff"]


def test_an_entry_that_is_not_there_is_refused_in_one_line():
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.control", "--entry", "nowhere.py"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr == "--entry nowhere.py: no such file. Give a controller's module or TOML file.\n"


def test_the_gain_of_ff_is_less_with_what_it_has_learned_and_that_of_ssc_before_it_has():
    """Its feedforward by measured pressure and displacement is in the loop as soon as it is trusted; with a memory of
    an hour it is not trusted after two minutes, and its loop is that of SSC."""
    crane = load_crane(course.CRANE)
    slow = changed(crane, {"control": {"ff": {"tau_k": "3600 s"}}})
    ssc = course.places(crane, Mode("ssc"), 1.0).K_p
    before, learned = (course.places(c, Mode("ff"), 1.0).K_p for c in (slow, crane))
    assert before == pytest.approx(ssc, rel=1e-3)
    assert 0.5 * ssc < learned < 0.95 * ssc
    assert math.isfinite(learned)
