"""`stillhook map` as a user meets it."""

import json
import subprocess
import sys

import pytest
from tests.commands import case_file

from stillhook.cli import run
from stillhook.variables import BY_NAME

SMALL = ["map", "nov-250t", "--loads", "50 t, 175 t", "--speeds", "40 m/min, 100 m/min"]


def answer(capsys, *arguments):
    assert run([*SMALL, *arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


class TestOutput:
    @pytest.mark.slow
    def test_table_shows_values_marks_and_their_meaning(self, capsys):
        assert run([*SMALL, "--verbose"]) == 0
        out = capsys.readouterr().out
        assert "SSC" in out
        assert "best classic" in out
        assert "load = load above limit of mode" in out
        assert "sat = pumps saturated" in out
        assert "SSC against best classic (median where both apply): error -" in out

    @pytest.mark.slow
    def test_json_holds_the_numbers_of_the_map_in_si(self, capsys):
        from stillhook import load_crane
        from stillhook.analysis.maps.operability import map_of

        data = answer(capsys)
        m = map_of(load_crane("nov-250t"), loads="50 t, 175 t", speeds="40 m/min, 100 m/min")
        assert data["controllers"]["ssc"]["e_c_pp"] == m.values["e_c_pp"][2, :, :, 0, 0].tolist()
        assert data["controllers"]["hs"]["cause"][1][0] == "load above limit of mode"
        assert data["controllers"]["hs"]["e_c_pp_change"][1][0] is None
        assert data["load"] == [50e3, 175e3]

    @pytest.mark.thorough
    @pytest.mark.parametrize("metric", ["e_c_pp", "settling"])
    def test_every_key_is_in_the_nomenclature(self, capsys, metric):
        data = answer(capsys, "--metric", metric)
        keys = set(data) - {"crane", "summary"}
        for part in (data["controllers"]["ssc"], data["summary"]["ssc"]):
            keys |= set(part)
        assert keys <= set(BY_NAME)

    @pytest.mark.slow
    def test_layers_and_periods_have_tables_of_their_own(self, capsys):
        one_cell = ["map", "nov-250t", "--controllers", "ssc", "--loads", "50 t", "--speeds", "40 m/min"]
        assert run([*one_cell, "--layer", "12", "--layer", "3", "--periods", "8 s, 12 s", "--verbose"]) == 0
        out = capsys.readouterr().out
        assert out.count("SSC: ") == 4
        assert "layer 3, sine of 8 s" in out

    @pytest.mark.slow
    def test_a_controller_from_a_file_is_named_after_it(self, capsys, tmp_path):
        (tmp_path / "soft.toml").write_text('mode = "ssc"\n[control]\nK_p = "0.08 1/m"\n', encoding="utf-8")
        data = answer(capsys, "--controllers", f"ns,{tmp_path / 'soft.toml'}")
        assert list(data["controllers"]) == ["ns", "soft", "best classic"]

    @pytest.mark.thorough
    def test_out_writes_series_numbers_and_pictures_together(self, capsys, tmp_path):
        import xarray

        assert run([*SMALL, "--out", str(tmp_path / "maps"), "--verbose"]) == 0
        names = {p.name for p in (tmp_path / "maps").iterdir()}
        assert {"map.nc", "map.json", "e_c_pp.png", "p_max.png", "change.png"} <= names
        with xarray.open_dataset(tmp_path / "maps" / "map.nc", engine="h5netcdf") as data:
            assert data["e_c_pp"].dims == ("controller", "load", "speed")
            assert str(data["cause"].sel(controller="hs")[1, 0].values) == "load above limit of mode"
        assert "written: " in capsys.readouterr().out

    @pytest.mark.slow
    def test_no_controller_anywhere_is_a_no(self, capsys):
        assert run(["map", "nov-250t", "--controllers", "ns", "--loads", "50 t", "--speeds", "120 m/min"]) == 1


class TestRefusals:
    def test_a_missing_cluster_library_says_what_to_install(self, capsys, monkeypatch, tmp_path):
        monkeypatch.setitem(sys.modules, "distributed", None)
        case = case_file(tmp_path, settings='scheduler = "tcp://127.0.0.1:8786"')
        assert run(["map", case, "--loads", "50 t", "--speeds", "40 m/min"]) == 2
        assert 'pip install "stillhook[dask]"' in capsys.readouterr().err


@pytest.mark.thorough
def test_the_table_loads_no_heavy_library():
    code = (
        "import sys; from stillhook.cli import run; run(['map', 'nov-250t', '--loads', '50 t', '--speeds', '40 m/min']); "
        "print([m for m in ('matplotlib', 'xarray', 'pandas', 'control', 'distributed') if m in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip().splitlines()[-1] == "[]"
