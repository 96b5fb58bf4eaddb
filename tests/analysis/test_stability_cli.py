"""`stability`, its sweeps, and the command."""

import json
import math

import numpy as np
import pytest
from tests.scripts import PAGES, script

from stillhook import load_crane
from stillhook.analysis.loop_stability.stability import gain_limit, stability
from stillhook.analysis.loop_stability.sweeps import bode, root_locus, slow_sweep, sweep
from stillhook.cli import run
from stillhook.library import changed
from stillhook.trust.manifest import NAME as MANIFEST
from stillhook.variables import BY_NAME

least_limit = script(PAGES / "reduced.py").least_limit
LIBRARY = load_crane("nov-250t")
WIRE = {"wire": {"zeta": 0.95, "zeta_low": 0.95, "zeta_high": 0.95}}
CRANE = changed(LIBRARY, WIRE)
"""A wire on which the load does not ring (that of paper C): slow and loaded, the gain then decides whether the winch
oscillates. On the library's wire a heavy load swings whatever the gain."""
KEYS = ("K_p_ms", "omega_c", "omega_0", "zeta", "gain_margin", "phase_margin", "delay_margin")
DIGITS_6 = 5e-7


@pytest.fixture
def calm(tmp_path) -> str:
    """Crane file of `CRANE`."""
    file = tmp_path / "calm.toml"
    file.write_text('base = "nov-250t"\n[wire]\nzeta = 0.95\nzeta_low = 0.95\nzeta_high = 0.95\n')
    return str(file)


def answer(capsys, *words: str) -> tuple[int, dict]:
    code = run(["stability", *words, "--json"])
    return code, json.loads(capsys.readouterr().out)


WORDS = ("nov-250t", "--load", "150 t", "--s-w", "100 m")


@pytest.mark.slow
def test_the_answer_is_no_where_the_plant_oscillates_and_no_place_has_a_margin_and_none(capsys):
    """150 t on 100 m of wire: slow it swings whatever K_p, fast it has a margin."""
    code, found = answer(capsys, *WORDS)
    assert (code, found["stable"]) == (1, False)
    own = {"stable", "least_at", "places", "decide", "no_gain", "oscillates", "damping", "published"}
    assert set(found) - own <= {*BY_NAME, "crane", "controller", "mode", "notes"}
    assert found["published"]["K_p_ms"] == pytest.approx(2.026039, abs=DIGITS_6)
    assert found["published"]["omega_0"] == pytest.approx(12.526991, abs=DIGITS_6)
    where = {(p["load"], p["s_w"], p["v_tip"]) for p in found["no_gain"]}
    least = found["least_at"]
    assert (least["load"], least["s_w"], least["v_tip"]) not in where
    assert abs(least["v_tip"]) > max(abs(v) for _, _, v in where)
    assert found["gain_margin_plc"] == pytest.approx(found["K_p_ms_plc"] / found["K_p"])
    dampings = {d["whose"]: d["zeta"] for d in found["damping"]}
    assert dampings == {"least": 0.005, "crane": 0.01, "most": 0.1, "paper C": 0.95}


@pytest.mark.slow
def test_the_answer_comes_first_and_fits_in_twelve_lines(capsys):
    assert run(["stability", *WORDS, "--verbose"]) == 1
    lines = [line for line in capsys.readouterr().out.splitlines() if line.strip()]
    assert "UNSTABLE, the complete plant oscillates at" in lines[0]
    assert lines[1].startswith("No gain K_p stabilises the complete plant at 150 t, ")
    assert lines[1].endswith("100 m of wire.")
    assert len(lines) <= 12
    assert max(map(len, lines)) <= 100
    assert any(line.startswith("Gain margin, one Stribeck speed above that, ") for line in lines)
    assert run(["stability", "nov-250t", "--load", "0 t", "--s-w", "100 m", "--verbose"]) == 0
    out = capsys.readouterr().out
    assert "STABLE at all" in out.splitlines()[0]
    assert "No gain" not in out


@pytest.mark.slow
def test_several_displacements_give_lists(capsys):
    words = ("nov-250t", "--alpha-m", "1", "--alpha-m", "0.6", "--delay", "50 ms", "--load", "0 t", "--s-w", "100 m")
    code, found = answer(capsys, *words)
    assert code == 0
    assert [p["K_p_ms"] for p in found["published"]] == pytest.approx([2.026039, 0.998272], abs=DIGITS_6)
    assert found["delay"] == [0.05, 0.05]
    assert found["K_p_ms_plc"][1] < found["K_p_ms_plc"][0]


@pytest.mark.slow
def test_a_drive_is_judged_by_the_same_keys(capsys):
    words = ("--load", "50 t", "--s-w", "100 m", "--v-tip", "2 m/min")
    _, closed = answer(capsys, "nov-250t", *words)
    code, drive = answer(capsys, "nov-100t-electric", *words)
    assert code == 0
    assert set(drive) == set(closed)
    assert drive["published"] is None
    assert drive["gain_margin_plc"] > 2.0


@pytest.mark.thorough
def test_slow_sweep_falls_with_load_and_rises_with_displacement():
    data = slow_sweep(LIBRARY, [0.6, 0.8, 1.0], loads=[0.0, 150e3])["K_p_ms_plc"].sel(wire_zeta=0.95)
    assert np.all(np.diff(data.values, axis=0) > 0.0)
    assert data.sel(load=150e3, alpha_m=0.6) < 0.1 * data.sel(load=0.0, alpha_m=0.6)


@pytest.mark.slow
def test_gain_beyond_the_limit_is_a_no(capsys, tmp_path):
    file = tmp_path / "hot.toml"
    file.write_text('base = "nov-250t"\n[control]\nK_p = "1.2 1/m"\n')
    words = (str(file), "--alpha-m", "0.6", "--load", "0 t", "--s-w", "100 m")
    code, found = answer(capsys, *words)
    assert code == 1
    assert found["gain_margin_plc"] < 1.0
    assert found["no_gain"] == []
    assert found["oscillates"]
    assert run(["stability", *words, "--verbose"]) == 1
    assert "K_p is above its limit, least at empty hook" in capsys.readouterr().out


@pytest.mark.long
def test_whole_plant_by_command(capsys, calm):
    at = ("--full", "--load", "100 t", "--s-w", "100 m", "--v-tip", "60 m/min")
    code, found = answer(capsys, calm, *at)
    assert code == 0
    assert found["v_tip"] == 1.0
    assert 0.8 < found["alpha_m"] < 0.9
    assert found["K_p_ms"] == pytest.approx(2.90, abs=0.01)
    code, ringing = answer(capsys, "nov-250t", *at)
    assert code == 0
    assert (
        0.3 < ringing["K_p_ms"] / found["K_p_ms"] < 0.7
    )  # a load that rings takes half of the limit, at speed not all of it


@pytest.mark.long
def test_one_point_alone_has_the_margins_of_the_twin_beside_its_own(capsys):
    """At 60 m/min the displacement is the least that the waves have: the twin, which is faster and slower, swings later."""
    at = ("--full", "--load", "100 t", "--s-w", "487 m", "--v-tip", "60 m/min")
    code, found = answer(capsys, "nov-250t", *at)
    assert code == 0
    twin = found["twin"]
    assert found["gain_margin_plc"] < twin["factor"]["swings"] < 2.0 * found["gain_margin_plc"]
    assert 0.01 < twin["delay"]["error"] < 0.05
    assert twin["delay"]["swings"] is None
    assert found["delay_margin_plc"] > 1.0
    assert run(["stability", "nov-250t", *at]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert f"half more with {twin['factor']['error']:.3g} times K_p or commands" in said
    assert f"a disturbance stays with {twin['factor']['swings']:.3g} times K_p." in said


@pytest.mark.slow
def test_a_controller_that_learns_is_said_to_be_judged_by_what_it_has_learned(capsys):
    words = ("nov-250t", "--load", "100 t", "--s-w", "487 m", "--v-tip", "60 m/min", "--verbose")
    run(["stability", *words, "--controller", "ff"])
    assert "ff with what it has learned after 120 s of waves (sine 0.7 m 9 s)." in capsys.readouterr().out
    run(["stability", *words])
    assert "learned" not in capsys.readouterr().out


@pytest.mark.slow
def test_winch_that_swings_without_feedback_is_told_why(capsys):
    words = ("nov-250t", "--full", "--load", "100 t", "--s-w", "15 m", "--v-tip", "1 m/min", "--alpha-m", "0.6")
    assert run(["stability", *words, "--verbose"]) == 1
    assert "UNSTABLE at every K_p. Friction falls with speed here" in capsys.readouterr().out
    code, found = answer(capsys, *words)
    assert code == 1
    assert (found["K_p_ms"], found["gain_margin"], found["K_p_strong"]) == (0.0, 0.0, 0.0)


@pytest.mark.thorough
def test_out_writes_pictures_sweeps_and_numbers(capsys, tmp_path):
    import xarray

    from stillhook.cli.analysis.stability import NAMES

    folder = tmp_path / "out"
    assert run(["stability", "nov-150t", "--out", str(folder)]) == 1  # slow and loaded it oscillates
    assert {p.name for p in folder.iterdir()} == {*NAMES, MANIFEST}
    with xarray.open_dataset(folder / "layer.nc", engine="h5netcdf") as data:
        assert data["K_p_ms"].dims == ("layer",)
        assert data["K_p_ms"].attrs["units"] == "1/m"
    assert json.loads((folder / "stability.json").read_text())["published"]["K_p_ms"] > 0.0


# The verb


def test_layer_takes_its_own_diameter_and_inertia():
    s = stability(CRANE, 0.6, layer=6)
    assert s.K_wire == pytest.approx(1.322614, abs=DIGITS_6)
    assert s.J_m < 4.1
    assert s.K_p_ms > gain_limit(CRANE, 0.6, s.K_wire).K_p_ms  # a drum half full is lighter as well


def test_tip_speed_moves_the_motors_poles_and_no_limit():
    still, fast = stability(CRANE, 0.7), stability(CRANE, 0.7, v_tip=1.2)
    names = [n for n in still._fields if n not in ("v_tip", "poles")]
    assert all(getattr(still, n) == getattr(fast, n) for n in names)
    assert not np.allclose(still.poles, fast.poles)
    assert stability(CRANE, v_tip=1.6).alpha_m < 1.0


def test_limit_rises_again_only_far_below_any_mode():
    """Where it is least, about 7 % displacement, no mode goes: within the range of every mode the limit grows with the
    displacement."""
    alpha_m, K_p = least_limit(CRANE)
    assert alpha_m == pytest.approx(0.069, abs=0.001)
    assert alpha_m < 0.2 * CRANE.active.motor.alpha_min
    assert gain_limit(CRANE, 0.5 * alpha_m).K_p_ms > K_p
    assert np.all(np.diff(sweep(CRANE, "alpha_m", np.linspace(0.1, 1.0, 10))["K_p_ms"].values) > 0.0)


@pytest.mark.slow
def test_sweeps_move_the_limit_as_physics_says():
    for over in ("leakage", "damping", "bulk_modulus"):
        data = sweep(CRANE, over)
        assert np.all(np.diff(data["K_p_ms"].values) > 0.0)  # more damping, or a stiffer spring
        middle = data["K_p_ms"].values[len(data["K_p_ms"]) // 2]
        assert middle == pytest.approx(gain_limit(CRANE).K_p_ms, rel=1e-9)
    assert np.all(np.diff(sweep(CRANE, "layer")["K_p_ms"].values) < 0.0)
    delayed = sweep(CRANE, "delay", [0.0, 0.1])
    assert delayed["K_p_ms"].values[0] == delayed["K_p_ms"].values[1]
    assert delayed["phase_margin_plc"].values[0] > delayed["phase_margin_plc"].values[1]


def test_bode_and_root_locus_meet_at_the_limit():
    limit = gain_limit(CRANE, 0.6)
    data = bode(CRANE, 0.6, omega=np.array([limit.omega_c]))
    assert float(data["loop_gain"][0]) * limit.K_p_ms / CRANE.control.K_p == pytest.approx(1.0, rel=1e-9)
    assert math.cos(float(data["loop_phase"][0])) == pytest.approx(-1.0, abs=1e-9)
    locus = root_locus(CRANE, 0.6, K_p=[0.0, 0.999 * limit.K_p_ms, 1.001 * limit.K_p_ms])
    assert list(locus["pole_re"].max("branch").values > 1e-9) == [False, False, True]


def test_a_layer_has_its_own_diameter_and_inertia(capsys):
    (_, inner), (_, outer) = (answer(capsys, "nov-250t", "--layer", layer, "--alpha-m", "0.6") for layer in ("1", "12"))
    assert inner["K_wire"] > outer["K_wire"] >= 1.0
    assert inner["J_m"] < outer["J_m"]
    assert run(["stability", "nov-250t", "--layer", "1", "--load", "50 t"]) == 2
    assert "--layer applies to the published loop only" in capsys.readouterr().err
