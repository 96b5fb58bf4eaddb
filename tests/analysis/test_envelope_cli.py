"""`stillhook envelope` as a user meets it."""

import json
import math

import pytest
import xarray

from stillhook import load_crane
from stillhook.analysis.steady.envelope import envelope
from stillhook.cli import run
from stillhook.cli.analysis.envelope import OUT_FILES
from stillhook.variables import BY_NAME

CRANE = "nov-100t-pure-active"
FAST = ["envelope", CRANE, "--controllers", "ns,ssc"]


def answer(capsys, *arguments, code=0):
    assert run([*arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out)


@pytest.mark.slow
def test_json_holds_what_the_dataset_holds_in_si(capsys):
    found = answer(capsys, *FAST, "--load", "40 t")
    data = envelope(load_crane(CRANE), loads=["40 t"], modes=["ns", "ssc"])
    by_mode = {r["mode"]: r for r in found["rows"]}
    assert set(by_mode) == {"ns", "ssc", "physical"}
    for mode, row in by_mode.items():
        assert row["v_w_top"] == pytest.approx(float(data["v_w_top"].sel(mode=mode).min()))
        slow = str(data["direction"].values[int(data["v_w_top"].sel(mode=mode).values.ravel().argmin())])
        assert row["direction"] == slow
    # a winch without passive circuit lifts the weight: lifting it fills the pumps first
    assert by_mode["ns"]["direction"] == "hoisting"
    assert by_mode["ssc"]["gain_over_ns"] == pytest.approx(by_mode["ssc"]["v_w_top"] / by_mode["ns"]["v_w_top"] - 1.0)
    assert "gain_over_hs" not in by_mode["ssc"]  # HS was not asked for


@pytest.mark.slow
def test_every_key_is_in_the_nomenclature(capsys):
    found = answer(capsys, *FAST, "--load", "40 t")
    keys = {*found, *found["rows"][-1], *found["loads"][0]} - {"rows", "loads"}
    assert keys <= set(BY_NAME)


@pytest.mark.slow
def test_a_load_that_no_mode_may_carry_ends_with_1_and_null(capsys):
    found = answer(capsys, "envelope", CRANE, "--controllers", "hs", "--loads", "90 t", code=1)
    (row,) = (r for r in found["rows"] if r["mode"] == "hs")
    assert row["v_w_top"] is None
    assert row["binds"] == "load of the mode"


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("units", "binds"), [('P_max = "10 MW"\nP_back = "10 MW"', "torque reserve"), ("", "hydraulic power")]
)
def test_table_tells_speed_and_limit_in_human_units(capsys, tmp_path, units, binds):
    """80 t drive 0.6 MW and more into the pumps while they sink; power units of 10 MW leave the torque reserve as the
    limit."""
    file = tmp_path / "units.toml"
    file.write_text(f'base = "{CRANE}"\n[hpu]\n{units}\n')
    assert (
        run(["envelope", str(file), "--controllers", "ns,ssc", "--loads", "40 t", "--loads", "80 t", "--verbose"]) == 0
    )
    out = capsys.readouterr().out
    assert "m/min" in out
    assert "pump flow" in out
    assert binds in out
    assert "over NS" in out
    assert "nan" not in out


@pytest.mark.slow
def test_layer_is_counted_from_the_bare_drum(capsys):
    inner, outer = (answer(capsys, *FAST, "--load", "40 t", "--layer", n)["rows"][-1] for n in ("1", "10"))
    assert inner["v_w_top"] < outer["v_w_top"]


@pytest.mark.thorough
def test_out_writes_every_file_that_is_promised(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(
        "stillhook.analysis.steady.envelope.LOADS", (0.0, 0.5, 1.0)
    )  # coarser pictures, for speed alone
    monkeypatch.setattr("stillhook.cli.analysis.envelope.LAYERS_SHARES", (1.0,))
    out = tmp_path / "folder"
    assert run([*FAST, "--load", "40 t", "--out", str(out)]) == 0
    assert sorted(p.name for p in out.iterdir()) == sorted(OUT_FILES)
    with xarray.open_dataset(out / "envelope.nc", engine="h5netcdf") as data:
        assert data["v_w_top"].attrs["units"] == "m/s"
        assert not math.isnan(float(data["v_w_top"].max()))
    told = json.loads((out / "envelope.json").read_text(encoding="utf-8"))
    capsys.readouterr()
    assert told == answer(capsys, *FAST, "--load", "40 t")
