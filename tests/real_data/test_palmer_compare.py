"""A measured ship motion through the command line: believable for a crane engineer."""

import json

import pytest
from tests.commands import case_file

from stillhook.base.gateway.named_files import VARIABLE
from stillhook.cli import run

pytestmark = pytest.mark.slow

POSITION = '["-10 m", "8 m", "25 m"]'
"""Crane tip of a mid-ship crane from the motion sensor: a little aft, to port, up."""


@pytest.fixture(scope="module")
def results(shared_data, tmp_path_factory):
    out = tmp_path_factory.mktemp("palmer")
    log = shared_data / "ship_motion_palmer" / "NBP1406_seap-2014-08-01.txt"
    case = case_file(out, load="60 t", warm_up="30 s", tip=f'{{ file = "{log}", position = {POSITION} }}')
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, str(shared_data))
        code = run(["compare", case, "--out", str(out), "--json"])
    return code, json.loads((out / "summary.json").read_text()), out


@pytest.mark.thorough
def test_the_log_gives_a_table_and_figures(results):
    _, summary, out = results
    assert list(summary) == ["ns", "hs", "ssc"]
    assert (out / "panels.png").stat().st_size > 50_000
    assert (out / "runs.nc").exists()


@pytest.mark.long
def test_the_whole_log_is_run(results):
    _, summary, _ = results
    assert summary["ssc"]["counted_time"] == pytest.approx(682.9, abs=0.1)


def test_compensation_is_good_but_not_magic(results):
    _, summary, _ = results
    for s in summary.values():
        assert 0.5 < s["eta_c"] < 0.99
        assert 0.0 < s["e_c_pp"] < s["s_tip_pp"]


def test_energy_is_found_again_on_a_measured_motion(results):
    _, summary, _ = results
    for s in summary.values():
        assert abs(s["energy_unaccounted"]) < 1e-3  # the project's audit limit


def test_a_saturated_controller_is_named_and_ssc_is_the_best(results):
    code, summary, _ = results
    assert summary["ssc"]["e_c_pp"] <= min(s["e_c_pp"] for s in summary.values())
    assert all((s["saturation_time"] > 0.0) == ("saturated" in s["status"]) for s in summary.values())
    assert code == (0 if any(s["status"] == "ok" for s in summary.values()) else 1)
