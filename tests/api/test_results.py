"""Results: labelled, on disk whole or not at all, and repeatable from their own record."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray
from tests.engine.lifts import SPLASH, in_sea
from tests.engine.test_lowering import whole_lift

from stillhook import Scenario, load_crane, load_run, save_run, simulate
from stillhook.cli import run as command
from stillhook.engine.scenario.summary import numbers_of
from stillhook.errors import SimulationError, StillhookError
from stillhook.formats.results import origin, rerun, save_json, to_json
from stillhook.kernels.build import driver, kernel_hash
from stillhook.library import changed
from stillhook.library.catalogue import read_compensator
from stillhook.spec.scenario import Sensors
from stillhook.variables import SERIES, SUMMARY

CRANE = changed(load_crane("nov-250t"), {"active": {"line": {"V": "93 L"}}})
CASE = Scenario(
    name="one",
    load="80 t",
    s_w="100 m",
    tip="sine 1 m 9 s",
    duration="50 s",
    warm_up="10 s",
    sensors=Sensors(noise_s_w="1 mm", seed=4),
)
OTHER = CASE.model_copy(update={"name": "two", "load": 20e3})


@pytest.fixture(scope="module")
def single() -> xarray.Dataset:
    return simulate(CRANE, CASE, every="50 ms")


@pytest.fixture(scope="module")
def batch() -> xarray.Dataset:
    return simulate(CRANE, [CASE, OTHER])


def test_every_column_is_a_variable_with_its_unit_and_meaning(single):
    signals = driver(CRANE.plant.value, 1).Signals._fields
    own = {*signals, *numbers_of(CRANE), "status", "notes"}
    named = {v.name: v for v in SERIES + SUMMARY if v.name in own}
    assert set(single.data_vars) == set(named) == own
    for name, column in single.data_vars.items():
        v = named[str(name)]
        assert column.attrs["long_name"] == v.meaning
        assert column.attrs.get("units", "") == v.unit
        assert column.dims == (("time",) if v in SERIES else ())


@pytest.mark.slow
def test_a_list_of_cases_adds_the_dimension_case_and_stores_no_series(single, batch):
    assert batch.sizes == {"case": 2}
    assert batch["case"].values.tolist() == ["one", "two"]
    assert "time" not in batch.coords
    both = simulate(CRANE, [CASE, OTHER], series=True, every="50 ms")
    assert both.e_c.dims == ("case", "time")
    assert np.array_equal(both.e_c.values[0], single.e_c.values)


def test_cases_of_unequal_length_share_a_table_with_blanks():
    short = CASE.model_copy(update={"duration": 20.0})
    data = simulate(CRANE, [CASE, short], series=True, every="50 ms")
    assert float(data.time[-1]) == pytest.approx(50.0)
    assert not np.isnan(data.p_a.values[0]).any()
    assert np.isnan(data.p_a.values[1][data.time.values > 20.001]).all()
    assert not np.isnan(data.p_a.values[1][data.time.values < 20.001]).any()


def test_the_counted_part_and_the_warm_up_are_said(single):
    assert single.counted_time.item() == pytest.approx(40.0)
    assert single.warm_up.item() == pytest.approx(10.0)


def test_a_run_carries_what_repeats_it(single):
    cranes, cases = origin(single)
    assert cranes == [CRANE]
    assert cases == [CASE]
    assert single.attrs["stillhook_kernel"] == kernel_hash()
    assert single.attrs["step"] == pytest.approx(0.002)
    assert single.attrs["stillhook_version"]


@pytest.mark.thorough
@pytest.mark.parametrize("which", ["single", "batch"])
def test_a_run_comes_back_from_disk_as_it_was_and_repeats_itself(which, request, tmp_path):
    run = request.getfixturevalue(which)
    path = save_run(run, tmp_path / "results" / "run.nc")
    stored = load_run(path)
    again = rerun(stored)
    for other in (stored, again):
        assert set(other.data_vars) == set(run.data_vars)
        for name in run.data_vars:
            assert other[name].dims == run[name].dims
            assert np.array_equal(other[name].values, run[name].values, equal_nan=run[name].dtype.kind == "f"), name
            assert other[name].variable.identical(run[name].variable), name
    assert {k: str(v) for k, v in again.attrs.items()} == {k: str(v) for k, v in run.attrs.items()}
    assert [p.name for p in path.parent.iterdir()] == ["run.nc"]


def same_again(run, again):
    """Every number, and what repeats it, to the bit."""
    assert again.identical(run)


@pytest.mark.long
@pytest.mark.parametrize("several", [pytest.param(False, marks=pytest.mark.thorough), True])
def test_lowerings_come_back_from_disk_and_run_again(several, tmp_path):
    lift = whole_lift(duration="12 s")
    run = simulate(CRANE, [lift, lift.model_copy(update={"name": "b"})] if several else lift, on_failure="mark")
    back = load_run(save_run(run, tmp_path / "lift.nc"))
    assert back.identical(run)
    same_again(run, rerun(back))


@pytest.mark.thorough
def test_a_lowering_in_its_own_waves_runs_again_with_its_water(tmp_path):
    case = in_sea(SPLASH, water=True).lowering()
    case = case.model_copy(update={"duration": 30.0})
    run = simulate(CRANE, case)
    path = save_run(run, tmp_path / "lift.nc")
    same_again(run, rerun(load_run(path)))
    assert path.stat().st_size < 5e6


@pytest.mark.long
def test_lowerings_that_are_told_by_sea_and_seed_run_again_on_their_cranes(tmp_path):
    other = changed(CRANE, {"control": {"K_p": "0.2 1/m"}})
    cases = [in_sea(seed=i, left=0.5) for i in range(3)]
    run = simulate([CRANE, other, CRANE], cases, sampling="20 ms", end="programme")
    path = save_run(run, tmp_path / "seas.nc")
    same_again(run, rerun(load_run(path)))
    assert path.stat().st_size < 1e6  # one lift, one sea, one vessel


@pytest.mark.thorough
def test_a_compensated_lowering_runs_again(tmp_path):
    case = whole_lift(duration="15 s").model_copy(update={"compensator": read_compensator("phc-60t"), "h_tip": 40.0})
    run = simulate(CRANE, case, on_failure="mark")
    same_again(run, rerun(load_run(save_run(run, tmp_path / "lift.nc"))))


@pytest.mark.thorough
def test_the_command_runs_a_stored_lowering_again(tmp_path, capsys):
    run = simulate(CRANE, whole_lift(duration="15 s"), on_failure="mark")
    save_run(run, tmp_path / "lift.nc")
    assert command(["lower", str(tmp_path / "lift.nc"), "--json"]) in (0, 1)
    said = json.loads(capsys.readouterr().out)
    assert said["F_w_max"] == float(run["F_w_max"])
    assert command(["lower", str(tmp_path / "lift.nc"), "--seed", "2"]) == 2
    assert "--seed" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (None, "without what repeats them"),
        ("{", "stored lowerings"),
        ("[]", "stored lowerings"),
        ('{"lifts": [], "tips": [], "waters": [], "seas": [], "raos": [], "cases": []}', "no cases"),
        ('{"lifts": [{}], "tips": [], "waters": [], "seas": [], "raos": [], "cases": [{"lift": 0}]}', "payload"),
    ],
)
def test_lowerings_that_cannot_be_run_again_say_so_in_a_line(text, says):
    run = xarray.Dataset(attrs={"crane": "", "step": 0.005, "single": 1})
    if text is not None:
        run.attrs["lowerings"] = text
    with pytest.raises(StillhookError, match=says) as refused:
        rerun(run)
    assert "\n" not in str(refused.value)


@pytest.mark.thorough
def test_a_saved_run_replaces_an_older_one(single, batch, tmp_path):
    path = save_run(single, tmp_path / "run.nc")
    save_run(batch, path)
    assert load_run(path).sizes == {"case": 2}


@pytest.mark.parametrize("before", [None, b"an older file"])
def test_a_failed_write_leaves_nothing_behind(single, tmp_path, monkeypatch, before):
    target = tmp_path / "run.nc"
    if before is not None:
        target.write_bytes(before)

    def fail(self, data):
        self.write_text("half of it")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", fail)
    with pytest.raises((OSError, StillhookError)):
        save_run(single, target)
    assert [p.name for p in tmp_path.iterdir()] == ([] if before is None else ["run.nc"])
    assert before is None or target.read_bytes() == before


def test_a_folder_that_cannot_be_made_is_refused(single, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SimulationError) as e:
        save_run(single, tmp_path / "file" / "run.nc")
    text = str(e.value)
    assert text.endswith("Choose another folder.")
    assert "cannot be written" in text


@pytest.mark.slow
def test_a_file_that_is_missing_or_no_run_is_refused(tmp_path):
    with pytest.raises(StillhookError, match=r"no such file\. Give a file that save_run or --out wrote\.$"):
        load_run(tmp_path / "none.nc")
    text = tmp_path / "text.nc"
    text.write_text("not a run")
    with pytest.raises(StillhookError, match="not a NetCDF file of a run") as e:
        load_run(text)
    assert "\n" not in str(e.value)
    other = tmp_path / "other.nc"
    xarray.Dataset({"x": ("time", [1.0, 2.0])}).to_netcdf(other, engine="h5netcdf")
    with pytest.raises(
        StillhookError,
        match=r"not a run of Stillhook, crane, step missing\. Write runs with save_run\.$",
    ):
        load_run(other)


def test_json_has_no_numbers_that_json_does_not_know(tmp_path):
    data = {"a": float("nan"), "b": [1.0, float("inf"), {"c": 2}], "d": "text"}
    path = save_json(data, tmp_path / "summary.json")
    assert json.loads(path.read_text(encoding="utf-8")) == {"a": None, "b": [1.0, None, {"c": 2}], "d": "text"}
    assert "NaN" not in to_json(data)


def test_a_failed_json_leaves_nothing_behind(tmp_path):
    with pytest.raises(TypeError):
        save_json({"a": object()}, tmp_path / "summary.json")
    assert list(tmp_path.iterdir()) == []
