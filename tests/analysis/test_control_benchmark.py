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
from benchmarks.control.entries import REFERENCE, entries_with, shipped
from benchmarks.control.fmu import FmuType, controller_fmu
from benchmarks.control.late import PREDICTED

from stillhook import Mode, Scenario, load_crane
from stillhook.engine.pack.winch import pack
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.engine.tasks import Task
from stillhook.errors import SpecError
from stillhook.export.fmu import write_fmu
from stillhook.export.twin import export, own_platform
from stillhook.library import changed
from stillhook.sea.motion.recorded import window_spans

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "docs" / "how-to" / "enter-the-benchmark.md"


def entry_of_the_guide() -> str:
    return GUIDE.read_text(encoding="utf-8").partition("```python\n")[2].partition("```")[0]


def exported(file: Path, K_p: float, fmi: str) -> Path:
    """SSC of the benchmark's crane as an FMU."""
    crane = changed(load_crane(course.CRANE), {"control": {"K_p": f"{K_p:g} 1/m", "t_lead": "50 ms"}})
    case = Scenario(load=course.LOAD, s_w=course.WIRE, tip="still", mode="ssc")
    return write_fmu(export(crane, case, "controller"), file, fmi=fmi, platforms=[str(own_platform())])[0]


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory):
    """The quick course by the command, with the guide's entry, from an empty store."""
    folder = tmp_path_factory.mktemp("benchmark")
    (folder / "ssc_more.py").write_text(entry_of_the_guide(), encoding="utf-8")
    exported(folder / "plc.fmu", K_p=0.2, fmi="2")
    command = [sys.executable, "-m", "benchmarks.control", "--quick", "--json"]
    command += ["--entry", str(folder / "ssc_more.py"), "--entry", str(folder / "plc.fmu")]
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


@pytest.mark.long
def test_the_command_runs_every_controller_and_the_guides_entry(quick):
    assert {e.name for e in shipped()} | {"ssc-more", "plc"} == set(quick["entries"])
    setting = quick["entries"]["ssc-more"]["settings"]["Hs 2 m, Tp 9 s"]
    assert set(setting) == {"lead", "K_p"}
    assert setting["lead"] in (0.035, 0.05, 0.065)


@pytest.mark.long
def test_ssc_at_its_best_has_less_error_than_with_the_crane_files_settings(quick):
    for sea, scores in quick["entries"][REFERENCE]["scores"].items():
        assert scores["e_c_pp"] < quick["entries"]["ssc-published"]["scores"][sea]["e_c_pp"]


@pytest.mark.long
def test_fixed_motors_do_not_travel_and_the_small_displacement_takes_the_pressure(quick):
    assert report.mean(quick["entries"]["hs"], "travel_m") == pytest.approx(0.0, abs=1e-3)
    assert report.mean(quick["entries"]["hs"], "p_max") > 1.2 * report.mean(quick["entries"][REFERENCE], "p_max")


@pytest.mark.long
def test_the_load_moves_more_than_the_wire_alone_would_have_it(quick):
    """On 487 m of wire the load swings on top of the control error."""
    for e in quick["entries"].values():
        assert report.mean(e, "load_pp") > report.mean(e, "e_c_pp")


@pytest.mark.long
def test_tables_and_figure_name_every_entry(quick):
    for name, of in report.TABLES.items():
        head, rows = of(quick)
        assert all(len(row) == len(head) for row in rows)
        names = head if name in ("seas", "deep") else [row[0] for row in rows]
        own = {REFERENCE, "ff", "ssc-more", "plc"} if name == "late" else set(quick["entries"])
        assert own - {REFERENCE} - ({"plc"} if name == "deep" else set()) <= set(names)
    assert len(report.figure(quick).axes) == 4
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
    assert done.stderr == "--entry nowhere.py: no such file. Give a controller's module, TOML file or FMU.\n"


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


@pytest.mark.long
def test_a_late_motion_unit_costs_less_with_prediction(quick):
    for name in (REFERENCE, "ssc-more"):
        plain, predicted = (quick["late"][n]["errors"]["0.2"]["Hs 2 m, Tp 9 s"] for n in (name, name + PREDICTED))
        assert predicted < 0.8 * plain


@pytest.mark.long
def test_the_tension_loop_leaves_the_load_in_deep_water_stiller_than_ssc(quick):
    rope, ssc = (np.array([*quick["deep"][name]["motions"].values()]) for name in ("rope", REFERENCE))
    assert len(rope) == 4
    assert (rope < 0.8 * ssc).all()


@pytest.mark.long
def test_a_best_lead_at_an_end_of_the_grid_is_said(quick):
    e = quick["entries"]
    at_the_end = {n for n, x in e.items() if {s["lead"] for s in x["settings"].values()} & {0.035, x["leads"][-1]}}
    assert {line.partition(":")[0] for line in report.ends(quick)} == at_the_end - {"ssc-published"}


@pytest.mark.long
@pytest.mark.parametrize("fmi", ["2", "3"])
def test_ssc_in_an_fmu_moves_the_winch_as_ssc_does_to_the_bit(fmi, tmp_path: Path):
    """With a first reading of the tip without noise: a PLC refers the wire to it, and our own to the tip itself."""
    crane = changed(load_crane(course.CRANE), {"control": {"K_p": "0.2 1/m", "t_lead": "50 ms"}})
    sensors = {name: of for name, of in course.SENSORS.items() if name != "s_tip"}
    times = {"warm_up": "5 s", "duration": "25 s"}
    tips = ["sine 1 m 9 s", "sine 0.5 m 6 s"]
    cases = [Scenario(load="100 t", s_w="487 m", tip=tip, mode="ssc", sensors=sensors, **times) for tip in tips]
    fmu = controller_fmu(exported(tmp_path / "plc.fmu", 0.3, fmi)).at(0.05, 0.2)
    own = run_cases([crane] * 2, cases, every=1, step=2, keep=unchanged)
    hosted = Task(FmuType(fmu), [0, 1], [crane] * 2, cases, 2, 16, 1, unchanged).run()
    for a, b in zip(own, hosted, strict=True):
        for name in ("u_p", "u_m", "s_w", "p_a", "e_c"):
            assert np.array_equal(a.column(name)[:-1], b.column(name)[:-1]), name
        assert np.ptp(a.column("u_p")) > 0.1
        assert a.row["e_c_pp"] == b.row["e_c_pp"]


@pytest.mark.long
def test_an_fmu_has_the_scores_of_ssc_and_no_margins(quick):
    """K_p 0.2 in place of 0.214 of strong SSC, at the same leads."""
    plc, ssc = quick["entries"]["plc"], quick["entries"][REFERENCE]
    for sea, setting in plc["settings"].items():
        assert setting["K_p"] == 0.2
        assert plc["scores"][sea]["e_c_pp"] == pytest.approx(ssc["scores"][sea]["e_c_pp"], rel=0.03)
    assert plc["margin"]["gain_margin"] is None
    assert plc["margin"]["K_p"] == 0.2


@pytest.mark.parametrize(("content", "words"), [(b"none", "not an FMU"), (None, "no FMU for co-simulation with an")])
def test_a_file_that_is_no_controller_is_refused_in_one_line(content, words, tmp_path: Path):
    file = tmp_path / "x.fmu"
    if content is None:
        crane = load_crane(course.CRANE)
        case = Scenario(load=course.LOAD, s_w=course.WIRE, tip="still", mode="ssc")
        write_fmu(export(crane, case, "plant"), file, platforms=["source"])
    else:
        file.write_bytes(content)
    with pytest.raises(SpecError, match=words) as error:
        controller_fmu(file)
    assert "\n" not in str(error.value)


@pytest.mark.long
def test_two_entries_of_one_name_are_refused(tmp_path: Path):
    with pytest.raises(SpecError, match=r'Two entries are called "ff"'):
        entries_with([exported(tmp_path / "ff.fmu", 0.2, "2")])
