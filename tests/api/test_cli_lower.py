"""`stillhook lower` as a user meets it."""

import base64
import io
import json
import os
import re
from pathlib import Path

import numpy as np
import pytest
import xarray
from PIL import Image
from tests.frozen.inputs import LID

from stillhook.cli import run
from stillhook.control.supervisor import wire_weight
from stillhook.engine.pack.programme import settings
from stillhook.engine.simulate import simulate
from stillhook.errors import StillhookError
from stillhook.formats.lift_file import load_lift
from stillhook.report.plots import film as filming
from stillhook.report.plots.film import DOTS, MP4, PAGE, Film, hull_of, save_film
from stillhook.report.plots.moments import time_segments
from stillhook.report.plots.run import about_mean
from stillhook.report.save import LOWERING_FILES, static_tension
from stillhook.variables import BY_NAME


@pytest.fixture
def lift_toml(tmp_path: Path) -> Path:
    path = tmp_path / "lid.toml"
    path.write_text(LID)
    return path


@pytest.fixture(scope="module")
def landed(tmp_path_factory: pytest.TempPathFactory) -> tuple[xarray.Dataset, object]:
    path = tmp_path_factory.mktemp("lid") / "lid.toml"
    path.write_text(LID)
    file = load_lift(path)
    return simulate(file.crane, file.lift), file


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line of an error; nothing else is printed and the exit code is 2."""
    assert run(["lower", *arguments]) == 2
    out = capsys.readouterr()
    assert out.out == ""
    lines = out.err.strip().splitlines()
    assert len(lines) == 1, lines
    return lines[0]


@pytest.mark.slow
def test_a_payload_goes_through_the_surface_and_lands_in_one_run(capsys, lift_toml):
    code = run(["lower", str(lift_toml), "--json"])
    found = json.loads(capsys.readouterr().out)
    assert found["status"] == "ok", found["notes"]
    assert code == 0
    assert [s["name"] for s in found["phases"]] == ["through", "down", "land", "after"]
    assert [s["mode"] for s in found["phases"]] == ["splash", "ahc", "landing", ""]
    assert found["t_landed"] is not None
    assert found["z_load_end"] == pytest.approx(-25.0, abs=0.5)
    named = {key for key in (*found, *found["phases"][0]) if key not in BY_NAME} - {"name"}
    assert not named


@pytest.mark.slow
def test_the_tension_that_is_held_after_landing_is_the_one_that_was_set(landed):
    run_, file = landed
    last = run_.sel(time=slice(130.0, None))
    wire = wire_weight(float(last["s_w"].mean()), settings(file.crane, file.lift))
    held = last["F_w"].mean().item() - wire
    assert held == pytest.approx(100e3, rel=0.15)  # 50 m of wire: millimetres of control error are tens of kN


def test_tension_at_rest_is_what_the_run_swings_about(landed):
    """While nothing lies on the bottom, the mean of tension over static tension is 1."""
    run_, file = landed
    free = run_.sel(time=slice(5.0, 60.0))
    ratio = free["F_w"].values / static_tension(free, file.crane, file.lift)
    assert ratio.mean() == pytest.approx(1.0, abs=0.03)  # drag of a plate that sinks at 0.5 m/s takes a part


@pytest.mark.thorough
def test_pictures_series_and_numbers_are_written_together(capsys, lift_toml, tmp_path):
    out = tmp_path / "out"
    assert run(["lower", str(lift_toml), "--out", str(out), "--verbose"]) == 0
    assert {p.name for p in out.iterdir()} == {*LOWERING_FILES, "stillhook-manifest.json"}
    text = capsys.readouterr().out
    assert "Status: ok" in text
    assert "not validated" in text
    stored = json.loads((out / "summary.json").read_text())
    with xarray.open_dataset(out / "lowering.nc") as series:
        assert float(series["F_w"].max()) <= stored["F_w_max"] * (1.0 + 1e-9)
        assert series["z_load"].values[-1] == pytest.approx(stored["z_load_end"], abs=0.01)


@pytest.fixture(scope="module")
def film(landed) -> Film:
    """The lift twice, in pictures of which there are few."""
    run_, file = landed
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(filming, "FRAMES", 3)
        return Film({"ns": run_, "ssc": run_.isel(time=slice(None, -100))}, file, "lid <b>&</b>")


def test_a_film_shows_the_passage_the_compensated_phase_and_the_landing_in_their_order(landed, film):
    run_, file = landed
    assert [stretch.name for stretch in film.stretches] == ["through the surface", "down", "landing"]
    assert film.n_frames == 9
    whole = Film({"ssc": run_}, file)
    for stretch in whole.stretches:
        shown = stretch.times[-1] - stretch.times[0]
        assert len(stretch.times) == min(150, round(10.0 * shown))
        assert stretch.faster == pytest.approx(max(1.0, 10.0 * shown / len(stretch.times)))
    assert np.isclose(whole.stretches[-1].times, float(run_["t_landed"]), atol=0.6).any()


def test_every_scene_of_a_film_has_one_scale_in_height_and_width(film):
    figure = film.canvas()
    width, height = figure.get_size_inches()
    seen = 0
    for _ in film.frames(figure):
        scales = set()
        for ax in figure.axes[:-2]:  # the last two hold curves
            box, (left, right), (low, high) = ax.get_position(), ax.get_xlim(), ax.get_ylim()
            scales |= {round((right - left) / (box.width * width), 6), round((high - low) / (box.height * height), 6)}
        assert len(scales) == 1
        seen += 1
    assert seen == film.n_frames


def test_a_payload_far_below_is_seen_in_a_second_window_of_the_same_scale(landed):
    run_, file = landed
    deep = file._replace(lift=file.lift.model_copy(update={"depth": 525.0}))
    below = run_.assign(z_load=run_["z_load"].where(run_["z_load"] > -9.0, run_["z_load"] - 500.0))
    (surface,) = Film({"ssc": below}, deep).stretches[0].windows
    upper, lower = Film({"ssc": below}, deep).stretches[-1].windows
    assert lower.high < upper.low < surface.high
    assert lower.low < -525.0
    assert (upper.left, upper.right) == (lower.left, lower.right)


def test_the_hull_of_a_film_is_that_of_the_vessel_file_or_said_to_be_assumed(landed):
    known = hull_of(load_lift("template-through-the-surface"))
    assert known == (27.0, 7.2, -24.0, "")
    assert hull_of(landed[1]).words in Film({"ssc": landed[0]}, landed[1], "lid").title


@pytest.mark.long
def test_a_film_without_ffmpeg_is_a_page_with_every_picture_inside(film, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    path = save_film(film, tmp_path)
    assert path.name == PAGE
    page = path.read_text()
    frames = json.loads(re.search(r"const frames = (\[.*?\]), rate", page, re.DOTALL)[1])
    assert len(frames) == film.n_frames
    sizes = {Image.open(io.BytesIO(base64.b64decode(frame))).size for frame in frames}
    assert len(sizes) == 1
    assert "<b>&</b>" not in page
    assert not re.search(r"https?://|<link|src=\"(?!data)", page)


@pytest.mark.long
@pytest.mark.skipif(os.name != "posix", reason="the stand-in for ffmpeg is a shell script")
def test_a_film_with_ffmpeg_gets_every_picture(film, tmp_path, monkeypatch):
    """A stand-in for ffmpeg keeps the raw pictures that it is given."""
    script = tmp_path / "ffmpeg"
    script.write_text('#!/bin/sh\nfor last; do :; done\nexec cat > "$last"\n')
    script.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    path = save_film(film, tmp_path)
    assert path.name == MP4
    width, height = (round(DOTS * side) for side in film.canvas().get_size_inches())
    assert path.stat().st_size == pytest.approx(film.n_frames * 4 * width * height, rel=0.02)


def test_surface_and_seabed_are_worth_a_picture(landed):
    run_, file = landed
    surface, seabed = time_segments(run_, file.lift)
    z = run_["z_load"].values
    assert z[surface.first] > 0.0 > z[surface.last]
    assert z[seabed.first] > -25.0 > z[seabed.last]


def test_a_straight_path_has_no_motion_about_its_mean():
    t = np.arange(0.0, 100.0, 0.1)
    assert np.abs(about_mean(t, 3.0 - 0.2 * t)).max() < 1e-9


@pytest.mark.slow
def test_a_run_that_ends_before_its_programme_answers_with_1(capsys, lift_toml):
    assert run(["lower", str(lift_toml), "--duration", "20 s", "--verbose"]) == 1
    out = capsys.readouterr().out
    assert "Status: unfinished" in out
    assert 'the run of 20 s ends in phase "through"' in out


@pytest.mark.slow
def test_a_load_that_touches_the_seabed_on_its_way_down_answers_with_1_and_names_the_phase(capsys, lift_toml):
    text = lift_toml.read_text().replace('depth = "20 m"', 'time = "40 s"').replace('time = "20 s"', 'time = "10 s"')
    lift_toml.write_text(text)
    assert run(["lower", str(lift_toml), "--verbose"]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert "touchdown" in out
    assert re.search(
        r'phase "down" does not land, and the load touches the seabed in it after [\d.]+ s at [\d.]+ m/min', out
    )
    assert re.search(r"Touch-down after [\d.]+ s at [\d.]+ m/min", out)


def test_a_phase_that_times_out_leaves_the_programme_stuck(capsys, lift_toml):
    lift_toml.write_text(LID.replace('depth = "10 m"', 'depth = "10 m"\ntimeout = "5 s"'))
    assert run(["lower", str(lift_toml), "--duration", "20 s"]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert "Status: stuck" in out
    assert 'phase "through" did not end within its timeout of 5 s' in out


def test_a_load_above_the_swl_is_refused_before_the_run(capsys, lift_toml):
    lift_toml.write_text(LID.replace('mass = "30 t"', 'mass = "260 t"\nvolume = "8 m^3"'))
    assert "SWL 250 t" in refusal(capsys, str(lift_toml), "--duration", "5 s")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["nowhere.toml"], "nowhere.toml"),
        (["nothing"], 'No lift "nothing": the library has anchor-to-3000m'),
        (["LIFT", "--duration", "5"], "--duration"),
        (["LIFT", "--seed", "3"], "--seed: belongs to waves"),
        (["LIFT", "--film", "ssc"], "--film: is written to a folder. Give --out as well."),
        (["LIFT", "--out", "OUT", "--film", "ns,ssk"], '--film: unknown controller "ssk". Choose of '),
        (["LIFT", "--out", "OUT", "--film", "ns,,ssc"], '--film: unknown controller "". Choose of '),
        (["LIFT", "--out", "OUT", "--film", "ns,hs,ssc,ssc-cubic"], "--film: 4 controllers. Give 3 at most."),
        (["LIFT", "--step", "7 ms"], "--step: moved. Write step in the lift file."),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(capsys, lift_toml, tmp_path, arguments, says):
    places = {"LIFT": str(lift_toml), "OUT": str(tmp_path / "out")}
    assert says in refusal(capsys, *(places.get(a, a) for a in arguments))


def test_a_lift_that_this_crane_cannot_be_asked_names_the_file_and_its_fields(capsys, lift_toml):
    lift_toml.write_text(LID.replace('start_depth = "-2 m"', 'start_depth = "-18 m"'))
    assert "lid.toml: start_depth = -18 m: the hook would be above the crane tip" in refusal(capsys, str(lift_toml))


def test_a_folder_that_cannot_be_written_to_is_told_before_the_run(capsys, lift_toml):
    assert "not a folder" in refusal(capsys, str(lift_toml), "--out", str(lift_toml))


def test_a_lift_file_that_names_itself_no_crane_is_refused(lift_toml):
    lift_toml.write_text(LID.replace('crane = "nov-250t"\n', ""))
    with pytest.raises(StillhookError, match="crane: missing"):
        load_lift(lift_toml)
