"""Wind sea and swell together: every tier has both, tables are of the wind sea, and weather is held against both."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.plan.manifold import loaded, manifold

from stillhook.cli import run
from stillhook.errors import StillhookError
from stillhook.formats.weather.file import SENSES, read_weather
from stillhook.plan.definition.lift_plan import Swell
from stillhook.plan.definition.rules import Alternative, Seas
from stillhook.plan.file import load_plan
from stillhook.plan.limits import limits_in
from stillhook.plan.planning import plan as planned
from stillhook.plan.report.document import brief
from stillhook.plan.report.words import sentence
from stillhook.plan.result import PlanResult
from stillhook.plan.table import Axes, Governed
from stillhook.plan.tiers.closed_form import closed_form
from stillhook.plan.tiers.frequency import frequency
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Execution
from stillhook.plan.tiers.time_domain.lowering import SeaState, Winch
from stillhook.plan.weather.forecast import plan_forecast
from stillhook.plan.weather.records import FAINT, seas_of, swell_forecast, systems
from stillhook.plan.weather.spectral import spectral_persistence
from stillhook.plan.weather.value import forecast_limits, weather_value
from stillhook.response import Waves
from stillhook.sea.spectra.measured import SeaStates
from stillhook.weather.alpha import load_alpha_table
from stillhook.weather.series import Weather

PLAN = (
    manifold("none", "cap-80", start_depth="-7 m")
    + """\
[environment]
Hs = "0.5 m to 4 m by 0.5 m"
Tp = ["6 s", "9 s"]
headings = ["165 deg", "180 deg", "195 deg"]
gamma = 2.0

[environment.swell]
Hs = "1.2 m"
Tp = "9 s"
heading = "180 deg"
gamma = 2.0

[operation]
T_POP = "4 h"

[[phase]]
name = "over the side"
kind = "in-air"

[[phase]]
name = "splash"
kind = "splash-zone"

[[phase]]
name = "deep"
kind = "deep"
"""
)
SUM = 1e-9  # sums of spectra of one shape, but for rounding
BETWEEN = 0.02  # limits between heights 0.5 m apart
H = 3600.0

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def lift(tmp_path_factory):
    return loaded(tmp_path_factory.mktemp("plan"), PLAN)


def alone(lift):
    """The same plan without the swell."""
    return replace(lift, environment=lift.environment.model_copy(update={"swell": None}))


def with_swell(lift, **changes):
    swell = lift.environment.swell.model_copy(update=changes)
    return replace(lift, environment=lift.environment.model_copy(update={"swell": swell}))


def ahead(heights, Tp=9.0):
    n = len(heights)
    return Seas(np.asarray(heights, float), np.full(n, Tp), np.full(n, math.pi))


class TestTiers:
    """A swell of the period, direction and shape of the wind sea is one sea with it, of the energy of both."""

    HEIGHTS = np.array([0.0, 0.5, 1.5, 3.0])

    def together(self, lift):
        return np.hypot(self.HEIGHTS, lift.environment.swell.Hs)

    def test_in_closed_form_both_are_one_sea_of_their_energy(self, lift):
        for phase in lift.phases:
            both = closed_form(lift, phase, ahead(self.HEIGHTS)).values
            one = closed_form(alone(lift), phase, ahead(self.together(lift))).values
            for name in one:
                assert both[name] == pytest.approx(one[name], rel=SUM, nan_ok=True), (phase.name, name)

    def test_by_the_frequency_domain_method_both_are_one_sea_of_their_energy(self, lift):
        both = frequency(lift, [Alternative.CAP], ahead(self.HEIGHTS))
        one = frequency(alone(lift), [Alternative.CAP], ahead(self.together(lift)))
        for a, b in zip(both, one, strict=True):
            for name in b.values:
                assert a.values[name] == pytest.approx(b.values[name], rel=SUM, nan_ok=True), (a.phase, name)

    def test_runs_of_the_twin_have_the_waves_of_both_and_begin_with_the_swell_alone(self, lift):
        cells = Cells(lift, Execution(threads=1))
        seeds, winch = 6, Winch()
        spots = [SeaState(0.0, 9.0, math.pi), SeaState(0.0, 6.0, math.pi), SeaState(2.0, 9.0, math.pi)]
        cells.request([CellRequest("over the side", winch, spot, seeds) for spot in spots])
        motion = [cells.runs["over the side", winch, spot]["s_tip_pp"][:seeds].mean() for spot in spots]
        assert motion[0] > 0.05
        assert motion[1] == motion[0]  # the same runs: the swell does not know of the column
        assert motion[2] == pytest.approx(math.hypot(2.0, 1.2) / 1.2 * motion[0], rel=0.3)  # other random waves
        assert cells.n_runs < len(spots) * seeds + 16  # two columns share the swell alone; blocks are filled

    def test_the_limit_is_that_of_the_wind_sea(self, lift):
        phase, seas = lift.phases[1], lift.environment.table()
        both = limits_in(lift, closed_form(lift, phase, seas))
        one = limits_in(alone(lift), closed_form(alone(lift), phase, alone(lift).environment.table()))
        column = next(i for i, (T, b) in enumerate(zip(both.Tp, both.beta, strict=True)) if T == 9.0 and b == math.pi)
        beside, single = both.Hs["slack-sling"][column], one.Hs["slack-sling"][column]
        assert beside**2 + 1.2**2 == pytest.approx(single**2, rel=2.0 * BETWEEN)

    def test_a_swell_that_is_beyond_by_itself_leaves_no_wind_sea(self, lift):
        rough = with_swell(lift, Hs=4.0)
        found = limits_in(rough, closed_form(rough, lift.phases[1], rough.environment.table()))
        assert (found.Hs["slack-sling"] == 0.0).all()

    def test_a_swell_from_the_side_moves_the_tip_more_than_one_from_ahead(self, lift):
        seas, phase = ahead(np.array([1.0])), lift.phases[0]
        from_side = with_swell(lift, Tp=12.0, heading=math.radians(90.0))
        from_ahead = with_swell(lift, Tp=12.0)
        rolls, heads = (closed_form(p, phase, seas).values["s_tip_pp"][0] for p in (from_side, from_ahead))
        assert rolls > heads

    def test_answer_report_and_facts_say_what_the_limits_are_of(self, lift):
        result = planned(lift, tier="closed-form")
        assert result.facts["settings"]["swell"]["Hs"] == 1.2
        assert any(
            "every limiting Hs is that of the wind sea" in line for line in map(sentence, result.facts["remarks"])
        )
        titles = [str(getattr(part, "title", "")) for part in brief(result).front]
        assert any("of the wind sea with a swell of Hs 1.2 m" in title for title in titles), titles
        assert result.facts["operation"]["swell_wf"] < 1.2


@pytest.mark.parametrize(
    ("line", "new", "texts"),
    [
        ('heading = "180 deg"\n', "", ["environment", "swell", "heading", "missing"]),
        ('Hs = "1.2 m"\n', "", ["environment", "swell", "Hs", "missing"]),
        ('Hs = "1.2 m"\n', 'Hs = "0 m"\n', ["swell", "Hs"]),
        ('Tp = "9 s"\n', 'Tp = "9 m"\n', ["swell", "Tp", "9 m"]),
    ],
)
def test_a_swell_that_cannot_be_is_refused_in_one_line(tmp_path: Path, line: str, new: str, texts: list[str]) -> None:
    (tmp_path / "plan.toml").write_text(PLAN.replace(line, new, 1), encoding="utf-8")
    with pytest.raises(StillhookError) as refusal:
        load_plan(tmp_path / "plan.toml")
    assert "\n" not in str(refusal.value)
    for text in ("plan.toml", *texts):
        assert text in str(refusal.value)


def test_check_names_the_swell(tmp_path, capsys):
    (tmp_path / "plan.toml").write_text(PLAN, encoding="utf-8")
    assert run(["plan", str(tmp_path / "plan.toml"), "--check", "--verbose"]) == 0
    assert "each with a swell of Hs 1.2 m, Tp 9 s, travelling 180 deg" in " ".join(capsys.readouterr().out.split())


def series(n=48, **columns):
    """Hourly weather; columns of one number each or n."""
    time = np.datetime64("2020-01-01T00:00:00") + np.arange(n) * np.timedelta64(3600, "s")
    return Weather(time, {name: np.broadcast_to(np.asarray(x, float), n).copy() for name, x in columns.items()}, H)


def apart(wind_sea=0.5, swell=0.5, Tp_swell=9.0, come_from=0.0, swell_from=0.0):
    """Weather with the two systems apart; heights [m], directions [deg]."""
    return series(
        H_m0=math.hypot(0.5, 0.5),
        T_p=9.0,
        come_from=np.radians(come_from),
        H_m0_wind_sea=wind_sea,
        T_p_wind_sea=8.0,
        come_from_wind_sea=np.radians(come_from),
        H_m0_swell=swell,
        T_p_swell=Tp_swell,
        come_from_swell=np.radians(swell_from),
    )


def operability(lift, weather, limit=2.0):
    """Share of workable records, and notes, where the limit of the wind sea is the same in every cell."""
    axes = Axes.of(lift)
    shape = (len(axes.alternatives), *axes.columns)
    nan, none = np.full(shape, np.nan), np.full(shape, -1)
    of = Governed(axes, np.full(shape, limit), nan, nan, none, none, none)
    forecast = forecast_limits(lift, load_alpha_table(), {"twin": of, "credited": of})
    value = weather_value(lift, axes, forecast, weather)
    return value.persistence_of["twin", Alternative.NONE].operability, value.notes


def test_records_of_spectra_have_their_own_swell_and_not_the_plans(lift):
    n, unknown = 6, np.full(6, math.nan)
    time = np.datetime64("2020-01-01T00:00:00") + np.arange(n) * np.timedelta64(3600, "s")
    Hs = np.array([0.4, 0.4, 5.0, 0.4, 0.4, 0.4])
    waves = Waves(SeaStates(time, np.ones(n, dtype=bool), Hs, np.full(n, 8.0), unknown, unknown), beta="180 deg")
    short = replace(lift, T_POP=2 * H, T_C=0.0, alternatives=(Alternative.CAP,))
    beside, single = (spectral_persistence(p, waves, load_alpha_table()) for p in (short, alone(short)))
    assert beside["alternatives"] == single["alternatives"]
    assert "the plan's swell is left out: records hold their own" in beside["notes"]


class TestWeather:
    """The plan's swell is 1.2 m of 9 s from ahead; the vessel is free to turn."""

    def test_a_record_with_both_within_is_workable(self, lift):
        assert operability(lift, apart())[0] == 1.0

    @pytest.mark.parametrize(
        "change",
        [
            {"swell": 1.1},  # below the plan's 1.2 m, above alpha times it
            {"Tp_swell": 14.0},
            {"swell_from": 60.0},
            {"wind_sea": 1.9},
            {"swell": np.nan},
        ],
    )
    def test_a_record_with_one_of_them_beyond_is_not(self, lift, change):
        share = operability(lift, apart(**change))[0]
        assert not share > 0.0

    def test_a_faint_swell_may_be_any(self, lift):
        faint = 0.9 * FAINT * lift.environment.swell.Hs
        assert operability(lift, apart(swell=faint, Tp_swell=16.0, swell_from=90.0))[0] == 1.0

    def test_one_heading_is_kept_for_both(self, lift):
        assert operability(lift, apart(come_from=0.0, swell_from=25.0))[0] == 1.0  # the bow between the two
        assert operability(lift, apart(come_from=0.0, swell_from=60.0))[0] == 0.0

    def test_the_height_of_the_wind_sea_counts_and_not_that_of_both(self, lift):
        weather = apart(wind_sea=0.5)
        weather.columns["H_m0"][:] = 5.0
        assert operability(lift, weather)[0] == 1.0

    def test_without_the_two_apart_the_whole_height_counts_and_a_note_says_so(self, lift):
        one = series(H_m0=1.0, T_p=8.0, come_from=0.0)
        share, notes = operability(lift, one)
        assert share == 1.0
        assert any("does not give wind sea and swell apart" in note for note in notes)
        assert operability(lift, series(H_m0=1.9, T_p=8.0, come_from=0.0))[0] == 0.0

    def test_what_the_weather_does_not_know_of_the_swell_is_said(self, lift):
        weather = apart(Tp_swell=14.0)
        del weather.columns["T_p_swell"], weather.columns["come_from_swell"]
        share, notes = operability(lift, weather)
        assert share == 1.0
        assert any("no peak period and no direction of the swell: not held (upper bound)" in note for note in notes)

    def test_a_plan_without_a_swell_reads_weather_as_before(self, lift):
        weather = apart(wind_sea=0.1)
        assert systems(weather, None).weather is weather
        assert seas_of(alone(lift), weather)[0].Hs is weather.columns["H_m0"]

    def test_a_forecast_is_held_against_both(self, lift):
        result = planned(lift, tier="closed-form")
        made = PlanResult(
            result.data.assign(Hs_limit=result.data["Hs_limit"].copy(data=np.full(result.data["Hs_limit"].shape, 2.1))),
            result.facts,
        )
        go = [plan_forecast(made, weather)["alternatives"][0]["go"] for weather in (apart(), apart(swell=1.1))]
        assert go == [True, False]


def test_columns_of_the_two_systems_are_read_by_their_usual_names(tmp_path):
    rows = "".join(f"2020-01-01T{h:02d}:00Z,1.5,1.2,7,0.9,13,200\n" for h in range(5))
    heads = {
        "nora3": "time,hs [m],hs_sea [m],tp_sea [s],hs_swell [m],tp_swell [s],thq_swell [deg]\n",
        "era5": "time,swh [m],shww [m],tp_sea [s],shts [m],tp_swell [s],mdts [deg]\n",
    }
    for name, head in heads.items():
        (tmp_path / f"{name}.csv").write_text(head + rows)
        weather = read_weather(str(tmp_path / f"{name}.csv"), sense=SENSES["coming-from"])
        assert weather.columns["H_m0"][0] == 1.5
        assert weather.columns["H_m0_wind_sea"][0] == 1.2
        assert weather.columns["H_m0_swell"][0] == 0.9
        assert weather.columns["T_p_swell"][0] == 13.0
        assert math.degrees(weather.columns["come_from_swell"][0]) == pytest.approx(200.0)


def test_a_swell_is_described_in_units():
    swell = Swell(Hs="1.5 m", Tp="14 s", heading="-150 deg")
    assert swell.describe() == "swell of Hs 1.5 m, Tp 14 s, travelling 210 deg from the bow"


def test_a_swell_below_the_table_of_factors_has_none_and_no_window():
    assert math.isnan(swell_forecast(load_alpha_table(), 0.8, 8 * 3600.0))
    assert swell_forecast(load_alpha_table(), 1.5, 8 * 3600.0) == pytest.approx(0.705 * 1.5)
    swell = {"Hs": 0.8, "Tp": 9.0, "Tp_tolerance": 1.0, "heading": math.pi, "heading_tolerance": 0.3, "text": "swell"}
    held = systems(apart(), swell)
    assert held.within(0.0, 1, 0.7).all()
    assert not held.within(0.0, 1, math.nan).any()
    assert "no record is workable" in held.outside(math.nan)[0]
