"""`stillhook response` as a user meets it, and what it does with waves that were measured."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
import xarray

from stillhook.cli import run
from stillhook.errors import LiftError
from stillhook.formats.lift_file import load_lift
from stillhook.formats.waves.wavespectra import read_sea
from stillhook.response import lift as of_lift
from stillhook.response.forcing import forcing_of_directional, forcing_of_seas, forcing_of_series, forcing_of_states
from stillhook.response.lift import Waves, compensated_depth, lift_response, saturation, saturation_share
from stillhook.response.winch.linear_form import Residual
from stillhook.sea.spectra.directions import Directional, relative
from stillhook.sea.spectra.measured import SeaStates, SpectrumSeries
from stillhook.sea.spectra.parametric import Jonswap
from stillhook.sea.spectra.spectrum import Sea, Train
from stillhook.spec.lift.phase import Phase, moves
from stillhook.variables import BY_NAME

LIFT = """
name = "frame to 800 m"
crane = "deep-250t"
vessel = "supply-vessel-82m"
payload = "manifold-60t"
start_depth = "-3 m"
[sea]
wave = "jonswap Hs=1.5 m Tp=8 s gamma=2"
heading = "165 deg"
[tip]
at = "x=-20 m, y=-18 m, z=25 m"
[water]
depth = "800 m"
[[phase]]
mode = "splash"
speed = "12 m/min"
depth = "30 m"
[[phase]]
mode = "ahc"
speed = "30 m/min"
depth = "700 m"
"""
BANDS = "  .050   .060   .070   .080   .090   .100   .110   .120   .130   .140"
RECORDS = (
    f"YY MM DD hh {BANDS}\n"
    "96 01 01 00    .10   1.00   4.00   6.00   4.00   2.00   1.00    .50    .20    .10\n"
    "96 01 01 01  999.0  999.0  999.0  999.0  999.0  999.0  999.0  999.0  999.0  999.0\n"
    "96 01 01 02    .00    .00    .00    .00    .00    .00    .00    .00    .00    .00\n"
    "96 01 01 03    .20   2.00   8.00  12.00   8.00   4.00   2.00   1.00    .40    .20\n"
)
WEATHER = (
    "#YY  MM DD hh mm WDIR WSPD GST  WVHT   DPD   APD MWD   PRES  ATMP  WTMP  DEWP  VIS  TIDE\n"
    "#yr  mo dy hr mn degT m/s  m/s     m   sec   sec degT   hPa  degC  degC  degC  nmi    ft\n"
    "2019 08 01 00 00 300  5.0  6.0 99.00 99.00 99.00 999 1015.0  14.0  15.0  13.0 99.0 99.00\n"
    "2019 08 01 01 00 300  5.0  6.0  1.50  9.00  7.00  99 1015.0  14.0  15.0  13.0 99.0 99.00\n"
    "2019 08 01 02 00 300  5.0  6.0  1.50  9.00  7.00 189 1015.0  14.0  15.0  13.0 99.0 99.00\n"
)
LEFT = 0.2


@pytest.fixture
def lift(tmp_path):
    path = tmp_path / "frame.toml"
    path.write_text(LIFT)
    return str(path)


@pytest.fixture
def plain(monkeypatch):
    """A winch that leaves a fifth of every motion, with no twin to ask."""
    monkeypatch.setattr(of_lift, "identify_residual", lambda *_, **__: Residual.constant(LEFT))


@pytest.fixture(scope="module")
def ship(tmp_path_factory):
    path = tmp_path_factory.mktemp("lift") / "frame.toml"
    path.write_text(LIFT)
    return load_lift(path, duration="60 s", moving=False)


@pytest.fixture
def records(tmp_path):
    path = tmp_path / "waves.txt"
    path.write_text(RECORDS)
    return str(path)


def answer(capsys, *arguments, code=0):
    assert run(["response", *arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out)


def names_of(told):
    """Keys of an answer and of its tables of numbers."""
    yield from told
    for key in ("braked", "records"):
        yield from names_of(told[key]) if key in told else ()


class TestOneSea:
    @pytest.mark.slow
    def test_a_winch_that_leaves_a_fifth_leaves_a_fifth(self, capsys, lift, plain):
        told = answer(capsys, lift)
        assert told["eta_sigma_wire"] == pytest.approx(1.0 - LEFT, rel=1e-9)
        assert told["sigma_u"] == pytest.approx(LEFT * told["sigma_z"], rel=1e-9)
        assert told["u_mpm"] == pytest.approx(LEFT * told["z_mpm"], rel=1e-9)
        assert told["status"] == "ok"

    @pytest.mark.thorough
    def test_the_load_is_told_apart_from_the_wire(self, capsys, lift, plain):
        told = answer(capsys, lift)
        # the wire lets the load move more than its upper end does, with the winch and without it
        assert told["eta_sigma_load"] < told["eta_sigma_wire"]
        assert told["braked"]["sigma_load"] > told["sigma_z"]

    @pytest.mark.slow
    def test_every_key_is_a_name_of_the_registry(self, capsys, lift, plain, records):
        for more in ((), ("--wave", records, "--heading", "150 deg")):
            told = answer(capsys, lift, *more)
            unknown = {key for key in names_of(told) if key not in BY_NAME}
            assert unknown <= {"time", "valid"}  # of records, as in `stillhook sea`

    @pytest.mark.slow
    def test_the_tip_moves_as_stillhook_tip_says(self, capsys, lift, plain):
        told = answer(capsys, lift)
        place = ["supply-vessel-82m", "--at", "x=-20 m, y=-18 m"]
        assert run(["tip", *place, "--wave", "jonswap Hs=1.5 m Tp=8 s gamma=2", "--heading", "165 deg", "--json"]) == 0
        tip = json.loads(capsys.readouterr().out)
        for name in ("sigma_z", "sigma_v", "T_z", "z_mpm", "v_mpm"):
            assert told[name] == pytest.approx(tip[name], rel=2e-3), name  # two grids, and waves beyond 3 rad/s

    @pytest.mark.slow
    def test_other_waves_and_another_heading_go_before_those_of_the_file(self, capsys, lift, plain):
        as_it_is = answer(capsys, lift)
        same = answer(capsys, lift, "--wave", "jonswap Hs=1.5 m Tp=8 s gamma=2", "--heading", "165 deg")
        turned, stated = (
            answer(capsys, lift, "--heading", "90 deg"),
            answer(capsys, lift, "--wave", "jonswap Hs=3 m Tp=8 s gamma=2 heading=165 deg"),
        )
        assert same["sigma_load"] == as_it_is["sigma_load"]
        assert turned["sigma_z"] > 1.3 * as_it_is["sigma_z"]  # beam sea on the side of the crane
        assert stated["sigma_z"] == pytest.approx(2.0 * as_it_is["sigma_z"], rel=1e-9)

    @pytest.mark.slow
    def test_a_longer_wire_rings_slower(self, capsys, lift, plain):
        shallow, deep = (answer(capsys, lift, "--depth", depth) for depth in ("100 m", "700 m"))
        assert 1.5 * shallow["T_wire"][0] < deep["T_wire"][0]
        assert answer(capsys, lift)["z_load"] == -700.0

    def test_slack_and_overload_end_with_code_1(self, capsys, lift, monkeypatch):
        monkeypatch.setattr(of_lift, "identify_residual", lambda *_, **__: Residual.constant(1.0))
        told = answer(capsys, lift, "--wave", "jonswap Hs=6 m Tp=9 s", "--heading", "90 deg", code=1)
        assert "slack" in told["status"]
        assert told["slack_chance"] > 0.1
        assert told["sigma_load"] == told["braked"]["sigma_load"]

    @pytest.mark.slow
    def test_the_table_names_both_compensations_and_the_periods(self, capsys, lift, plain):
        assert run(["response", lift, "--verbose"]) == 0
        text = capsys.readouterr().out
        assert "80 % at the wire" in text
        assert "natural periods with the top held" in text
        assert "Status: ok" in text

    @pytest.mark.slow
    def test_nothing_moves_in_a_calm(self, capsys, lift, plain):
        told = answer(capsys, lift, "--wave", "jonswap Hs=0 m Tp=8 s", "--heading", "0 deg")
        assert (told["sigma_load"], told["load_mpm"], told["slack_chance"]) == (0.0, 0.0, 0.0)
        assert run(["response", lift, "--wave", "jonswap Hs=0 m Tp=8 s", "--heading", "0 deg"]) == 0

    @pytest.mark.thorough
    def test_the_winch_is_asked_once_and_what_is_kept_is_the_same_to_the_bit(self, ship, tmp_path, monkeypatch):
        monkeypatch.setattr("stillhook.response.winch.identify.cache_root", lambda: tmp_path)
        calls = []
        first = lift_response(ship, Waves(ship.sea), depth="700 m", progress=calls.append)
        number = len(calls)
        found = lift_response(ship, Waves(ship.sea), depth="700 m", progress=calls.append)
        assert len(calls) == number
        assert found.data.identical(first.data)
        assert np.array_equal(found.residual.C, first.residual.C, equal_nan=True)
        assert found.residual.C.strides == first.residual.C.strides
        assert 0.5 < float(found.data["eta_sigma_wire"][0]) < 1.0
        assert all(0.0 <= share <= 1.0 for share in calls)
        assert calls == sorted(calls)


class TestRecords:
    @pytest.mark.slow
    def test_missing_records_are_counted_and_calm_ones_are_calm(self, capsys, lift, plain, records):
        told = answer(capsys, lift, "--wave", records, "--heading", "150 deg")
        assert (told["n_records"], told["n_valid"], told["n_missing"]) == (4, 3, 1)
        assert told["records"]["valid"] == [True, False, True, True]
        one, missing, calm, four = told["records"]["sigma_z"]
        assert missing is None
        assert calm == 0.0
        assert four == pytest.approx(math.sqrt(2.0) * one, rel=1e-9)
        assert told["sigma_z"]["first"] == one
        assert told["sigma_z"]["max"] == four
        assert told["sigma_z"]["worst"] == "1996-01-01T03:00:00Z"
        assert told["sigma_z"]["mean"] == pytest.approx((one + four) / 3.0, rel=1e-9)

    @pytest.mark.slow
    def test_one_record_alone_is_the_same(self, capsys, lift, plain, records):
        whole = answer(capsys, lift, "--wave", records, "--heading", "150 deg")["records"]
        alone = answer(capsys, lift, "--wave", records, "--heading", "150 deg", "--record", "3")
        for name in ("sigma_z", "sigma_v", "sigma_load", "sigma_F_top"):
            assert alone[name] == pytest.approx(whole[name][3], rel=5e-3), (
                name
            )  # steps of 0.0075 rad/s cut the bands otherwise

    @pytest.mark.thorough
    def test_the_folder_holds_every_hour_picture_and_summary(self, capsys, lift, plain, records, tmp_path):
        out = tmp_path / "year"
        told = answer(capsys, lift, "--wave", records, "--heading", "150 deg", "--out", str(out))
        assert sorted(p.name for p in out.iterdir()) == [
            "response.nc",
            "response.png",
            "stillhook-manifest.json",
            "summary.json",
        ]
        with xarray.open_dataset(out / "response.nc", engine="h5netcdf") as data:
            assert data["sigma_load"].values[[0, 3]] == pytest.approx(
                [told["records"]["sigma_load"][i] for i in (0, 3)], rel=1e-12
            )
            assert str(data["time"].values[3])[:13] == "1996-01-01T03"
            assert data["sigma_load_braked"].attrs["units"] == "m"
        summary = json.loads((out / "summary.json").read_text())
        assert summary == {key: value for key, value in told.items() if key != "records"}
        assert (out / "response.png").stat().st_size > 20_000

    @pytest.mark.slow
    def test_a_picture_of_one_sea(self, lift, plain, tmp_path, capsys):
        assert run(["response", lift, "--out", str(tmp_path / "one"), "--verbose"]) == 0
        assert "response.png" in capsys.readouterr().out
        assert (tmp_path / "one" / "response.png").stat().st_size > 20_000

    @pytest.mark.slow
    def test_a_weather_table_with_directions(self, capsys, lift, plain, tmp_path):
        path = tmp_path / "weather.txt"
        path.write_text(WEATHER)
        told = answer(capsys, lift, "--wave", str(path), "--ship", "9 deg")
        assert told["n_valid"] == 2
        off, ahead = told["records"]["sigma_z"][1:]
        head = answer(capsys, lift, "--wave", "jonswap Hs=1.5 m Tp=9 s", "--heading", "0 deg")
        assert ahead == pytest.approx(
            head["sigma_z"], rel=1e-3
        )  # from 189 deg on a ship that heads 9 deg: following; gamma in hundredths
        assert off > 1.2 * ahead

    @pytest.mark.thorough
    def test_a_year_in_a_few_seconds_is_that_of_plain_sums(self, capsys, lift, plain, shared_data):
        path = shared_data / "sea_ndbc_46042" / "46042w1996.txt.gz"
        told = answer(capsys, lift, "--wave", str(path), "--heading", "180 deg")
        assert (told["n_records"], told["n_valid"]) == (8712, 8600)
        file, series = load_lift(lift, duration="60 s", moving=False), read_sea(path)
        fine = (np.arange(20) + 0.5) / 20 - 0.5
        w = (series.omega[:, None] + fine * series.width[:, None]).ravel()
        R = np.abs(file.vessel.vertical(w, np.array([math.pi]), -20.0, -18.0)[0]) ** 2
        first = math.sqrt(float((np.repeat(series.S[0] * series.width, 20) / 20.0) @ R))
        assert told["sigma_z"]["first"] == pytest.approx(first, rel=2e-3)  # bands in 8 parts and in 20


class TestDirections:
    def series(self, share, theta):
        omega = np.linspace(0.4, 1.2, 9)
        S = np.vstack([np.exp(-((omega - 0.7) ** 2) / 0.02), np.zeros(9)])
        time = np.datetime64("2020-01-01T00", "s") + np.arange(2) * np.timedelta64(3600, "s")
        directional = Directional(theta, np.broadcast_to(share, (2, 9, len(theta))))
        return SpectrumSeries(omega, np.full(9, 0.1), S, time, np.ones(2, dtype=bool), directional=directional)

    def test_waves_from_one_direction_are_long_crested_ones(self, ship):
        theta = np.radians(np.arange(0.0, 360.0, 10.0))
        share = np.zeros(36)
        share[12] = 1.0
        found = self.series(share, theta)
        heading = math.radians(75.0)
        a = forcing_of_directional(found, ship.vessel, -20.0, -18.0, heading)
        b = forcing_of_series(found, ship.vessel, -20.0, -18.0, relative(math.radians(120.0), heading))
        for name in ("tip", "wave", "cross"):
            assert getattr(a, name) == pytest.approx(getattr(b, name), rel=1e-9, abs=1e-15), name
        assert a.deviation()[1] == 0.0

    def test_two_directions_add_up_their_variances(self, ship):
        theta = np.radians(np.arange(0.0, 360.0, 10.0))
        shares = np.zeros((2, 36))
        shares[0, 3], shares[1, 20] = 1.0, 1.0
        one, two, both = (
            forcing_of_directional(self.series(s, theta), ship.vessel, -20.0, -18.0, 1.0).deviation()[0]
            for s in (*shares, 0.3 * shares[0] + 0.7 * shares[1])
        )
        assert both**2 == pytest.approx(0.3 * one**2 + 0.7 * two**2, rel=1e-9)

    def test_unknown_directions_of_waves_are_missing(self, ship):
        share = np.full(36, np.nan)
        found = forcing_of_directional(
            self.series(share, np.radians(np.arange(0.0, 360.0, 10.0))), ship.vessel, 0.0, 0.0, 0.0
        )
        assert np.isnan(found.deviation()[0])
        assert found.deviation()[1] == 0.0  # a calm has none to know

    def test_states_are_the_seas_that_they_name(self, ship):
        H, T = np.array([2.0, 0.0, np.nan, 1.0]), np.array([9.0, np.nan, 8.0, 0.2])
        nothing = np.full(4, np.nan)
        time = np.datetime64("2020-01-01T00", "s") + np.arange(4) * np.timedelta64(3600, "s")
        states = SeaStates(time, np.isfinite(H), H, T, nothing, nothing)
        found = forcing_of_states(states, ship.vessel, -20.0, -18.0, beta=2.0, spread=4.0)
        stated = forcing_of_seas(Sea((Train(Jonswap(2.0, 9.0, 1.0), 2.0, 4.0),)), ship.vessel, -20.0, -18.0)
        sigma = found.deviation()
        assert sigma[0] == pytest.approx(stated.deviation()[0], rel=1e-9)  # so long that gamma is 1
        assert sigma[1] == 0.0
        assert np.isnan(sigma[2:]).all()  # no height; a period that no sea has

    @pytest.mark.slow
    def test_short_crested_states_from_all_round_are_those_seas_about_the_ship(self, ship):
        come_from = np.radians([0.0, 77.0, 200.0, 359.0])
        time = np.datetime64("2020-01-01T00", "s") + np.arange(4) * np.timedelta64(3600, "s")
        states = SeaStates(
            time, np.ones(4, dtype=bool), np.full(4, 2.0), np.full(4, 9.0), np.full(4, np.nan), come_from
        )
        heading = math.radians(33.3)
        found = forcing_of_states(states, ship.vessel, -20.0, -18.0, ship=heading, spread=4.0)
        seas = [Sea((Train(Jonswap(2.0, 9.0, 1.0), relative(float(c), heading), 4.0),)) for c in come_from]
        stated = forcing_of_seas(seas, ship.vessel, -20.0, -18.0)
        for name in ("tip", "wave", "cross"):
            assert getattr(found, name) == pytest.approx(getattr(stated, name), rel=1e-8, abs=1e-14), name

    def test_a_zero_crossing_period_stands_for_the_peak_that_has_it(self, ship):
        time = np.datetime64("2020-01-01T00", "s") + np.arange(60) * np.timedelta64(3600, "s")
        H, T = np.tile([0.5, 2.0, 6.0], 20), np.repeat(np.linspace(5.0, 15.0, 20), 3)
        crossing = np.array([Jonswap(h, t).T_m02 for h, t in zip(H, T, strict=True)])
        nothing = np.full(60, np.nan)
        by_peak, by_crossing = (
            forcing_of_states(
                SeaStates(time, np.isfinite(H), H, *periods, nothing), ship.vessel, -20.0, -18.0, beta=2.0
            )
            for periods in ((T, nothing), (nothing, crossing))
        )
        assert by_crossing.deviation(1) == pytest.approx(by_peak.deviation(1), rel=2e-3)  # gamma is taken to hundredths


class TestSaturation:
    stop = Residual(
        np.array([0.5, 2.0]),
        np.array([0.999, 1.0, 9.0]),
        np.ones((2, 3)),
        np.zeros((4, 2, 3)),
        np.tile([0.0, 1.0, 1.0], (2, 1)),
    )

    def test_waves_above_a_speed_are_as_frequent_as_rayleigh_has_them(self):
        sigma = np.array([0.2, 0.5, 1.0, 3.0])
        found = saturation_share(self.stop, sigma, np.full(4, 8.0))
        assert found == pytest.approx(np.exp(-0.5 / sigma**2), abs=0.02)  # 120 deviations, straight between them

    def test_a_sine_below_and_above_the_speed(self):
        assert saturation(self.stop, np.array([0.9, 1.5, np.nan]), np.full(3, 8.0))[:2].tolist() == [0.0, 1.0]
        assert np.isnan(saturation(self.stop, np.array([1.0]), np.array([np.nan]))).all()


class TestDepth:
    def at(self, *phases):
        programme = tuple(Phase(**each) for each in phases)
        return compensated_depth(SimpleNamespace(depth=300.0, programme=programme, moves=moves(programme, -5.0, 300.0)))

    def test_the_deepest_place_at_which_a_stage_compensates(self):
        down, stop = {"mode": "ahc", "speed": "30 m/min", "depth": "250 m"}, {"mode": "ahc", "time": "60 s"}
        assert self.at(down, stop) == 250.0
        assert self.at({"mode": "manual", "speed": "6 m/min", "time": "600 s"}, stop) == pytest.approx(55.0)

    def test_else_twenty_metres_above_the_seabed(self):
        assert self.at({"mode": "splash", "speed": "6 m/min", "depth": "50 m"}) == 280.0
        assert self.at({"mode": "ahc", "speed": "6 m/min", "landed": True}) == 280.0


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--depth", "5 m"], "it pierces the surface"),
        (["--depth", "900 m"], "the water is 800 m deep"),
        (["--depth", "30"], "no unit"),
        (["--controller", "foo"], "is not one of"),
        (["--controller", "manual"], "does not compensate"),
        (["--wave", "jonswap Hs=1 m Tp=8 s"], "no heading"),
        (["--wave", "nowhere.txt"], "no such file"),
        (["--ship", "30 deg"], "Give it as --wave"),
        (["--record", "3"], "Give it as --wave"),
        (["--duration", "-1 h"], "must be longer than 0 s"),
        (["--duration", "1 s"], "Give ten wave periods or more"),
        (["--spread", "-1"], "not between 1 and 200"),
        (["--out", "/dev/null/x"], "cannot be written"),
    ],
)
def test_bad_input_ends_in_one_line(capsys, lift, plain, more, said):
    assert run(["response", lift, *more]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert said in told.err
    assert told.err.count("\n") == 1


@pytest.mark.slow
def test_measured_waves_need_one_direction_and_no_more(capsys, lift, plain, records):
    for more, said in (
        ([], "has no directions. Give --heading"),
        (["--ship", "30 deg"], "has no directions. Give --heading"),
        (["--ship", "30 deg", "--heading", "30 deg"], "conflicts with --heading"),
        (["--heading", "30 deg", "--record", "1"], "is missing"),
    ):
        assert run(["response", lift, "--wave", records, *more]) == 2
        assert said in capsys.readouterr().err


def test_a_lift_without_vessel_is_told_so(capsys, tmp_path, plain):
    path = tmp_path / "frame.toml"
    path.write_text(LIFT.replace('vessel = "supply-vessel-82m"\n', ""))
    assert run(["response", str(path)]) == 2
    assert "vessel: missing" in capsys.readouterr().err
    path.write_text(
        LIFT.replace('vessel = "supply-vessel-82m"\n', "").split("[sea]")[0]
        + '[tip]\nmotion = "sine 1 m 9 s"\nheight = "25 m"\n[water]'
        + LIFT.split("[water]")[1]
    )
    assert run(["response", str(path), "--wave", "pm Hs=1 m Tp=8 s", "--heading", "0 deg"]) == 2
    assert "simulated in time only" in capsys.readouterr().err


@pytest.mark.slow
def test_a_lift_without_a_sea_takes_another_one(capsys, tmp_path, plain):
    path = tmp_path / "frame.toml"
    start, rest = LIFT.split("[sea]")
    path.write_text(start + "[tip]" + rest.split("[tip]")[1])
    assert run(["response", str(path)]) == 2
    assert "the lift file has none" in capsys.readouterr().err
    assert answer(capsys, str(path), "--wave", "pm Hs=1 m Tp=8 s", "--heading", "180 deg")["sigma_z"] > 0.0
    with pytest.raises(LiftError, match="vessel is given"):
        load_lift(path)
