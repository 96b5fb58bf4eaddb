"""Operability maps: every cell is a run of its own, causes are what a run alone would say, and the comparison is
fair."""

import numpy as np
import pytest

from stillhook import Scenario, Sine, load_crane, simulate
from stillhook.analysis.axes import axes_of, quantities
from stillhook.analysis.controllers import Controller
from stillhook.analysis.maps.operability import NUMBERS, map_of, operability_map
from stillhook.analysis.maps.result import BEST_CLASSIC, MARKS, RULES, SATURATION_SHARE, Map, cause_of
from stillhook.analysis.steady.steady_state import wire_out_on
from stillhook.engine.tasks import Task
from stillhook.errors import ScenarioError, StillhookError
from stillhook.library import changed
from stillhook.physics.load_path.drum import layers_filled
from stillhook.sea.motion.motion import Profile, Still, Sum
from stillhook.sea.motion.recorded import Recorded
from stillhook.sea.motion.text import scaled, scaled_to, speed_peak
from stillhook.spec.scenario import Mode
from stillhook.winches.registry import WINCH_TYPES

PEAK_TOLERANCE = 1e-4  # of the speed: peaks are looked for among samples every 10 ms
CRANE = load_crane("nov-250t")
LOADS = "50 t, 150 t, 175 t, 250 t"
SPEEDS = "30 m/min, 80 m/min, 100 m/min, 120 m/min"


@pytest.fixture(scope="module")
def found() -> Map:
    return map_of(CRANE, loads=LOADS, speeds=SPEEDS)


def alone(load: str, speed: float, mode: str, period: float = 12.0) -> Scenario:
    """One cell of the map as a person would write it; speed in m/min."""
    tip = Sine.from_si(speed / 60.0 * period / (2.0 * np.pi), period)
    return Scenario(load=load, s_w=f"{wire_out_on(CRANE, 12)!r} m", tip=tip, mode=mode, duration="30 s", warm_up="10 s")


def cell(found: Map, name: str, label: str, load: int, speed: int) -> float:
    return float(found.values[name][found.labels.index(label), load, speed, 0, 0])


class TestCells:
    @pytest.mark.slow
    def test_every_cell_is_what_a_run_of_its_own_gives_bit_for_bit(self, found):
        cases = [
            alone(f"{m:g} kg", 60.0 * v, mode)
            for mode in ("ns", "hs", "ssc")
            for m in found.axes.loads
            for v in found.axes.speeds
        ]
        runs = simulate(CRANE, cases, on_failure="mark")
        for name in NUMBERS:
            np.testing.assert_array_equal(found.values[name][:3].ravel(), runs[name].values)
        assert list(found.status[:3].ravel()) == list(runs["status"].values)

    @pytest.mark.slow
    def test_a_user_s_controller_runs_with_its_own_settings(self):
        soft = Controller("soft", Mode.SSC, {"control": {"K_p": "0.08 1/m"}})
        m = map_of(CRANE, ["ssc", soft], loads="100 t", speeds="60 m/min")
        assert m.labels == ("ssc", "soft")
        single = simulate(soft.on(CRANE), [alone("100 t", 60.0, "ssc")])
        assert cell(m, "e_c_pp", "soft", 0, 0) == float(single["e_c_pp"][0])
        assert cell(m, "e_c_pp", "soft", 0, 0) != cell(m, "e_c_pp", "ssc", 0, 0)

    @pytest.mark.slow
    def test_layers_and_periods_are_dimensions_of_their_own(self):
        data = operability_map(
            CRANE, ["ssc"], loads="100 t", speeds="20 m/min, 60 m/min", layers=[12, 3], periods="8 s, 12 s"
        )
        assert data["e_c_pp"].dims == ("controller", "load", "speed", "layer", "period")
        assert dict(data.sizes) == {"controller": 1, "load": 1, "speed": 2, "layer": 2, "period": 2}
        one = map_of(CRANE, ["ssc"], loads="100 t", speeds="60 m/min", layers=3, period="8 s")
        assert float(data["e_c_pp"].sel(controller="ssc", layer=3, period=8.0)[0, 1]) == cell(
            one, "e_c_pp", "ssc", 0, 0
        )

    def test_wire_lies_in_the_middle_of_the_layer(self):
        from stillhook.engine.pack.winch import drum_record

        drum = drum_record(CRANE)
        for layer in (1, 6, 12):
            assert layer - 1 < layers_filled(drum.L_full - wire_out_on(CRANE, layer), drum) < layer

    def test_finished_cells_are_kept_and_found_again(self, tmp_path, monkeypatch):
        first = map_of(CRANE, ["ssc"], loads="50 t", speeds=SPEEDS, store=tmp_path)
        assert list(tmp_path.iterdir())
        monkeypatch.setattr(Task, "run", lambda *_: pytest.fail("ran again"))
        again = map_of(CRANE, ["ssc"], loads="50 t", speeds=SPEEDS, store=tmp_path)
        np.testing.assert_array_equal(first.values["e_c_pp"], again.values["e_c_pp"])


class TestCauses:
    @pytest.mark.slow
    def test_normal_speed_ends_where_its_pumps_are_full(self, found):
        assert found.cause[0, 0, 1, 0, 0] == ""
        assert found.cause[0, 0, 2, 0, 0] == "pumps saturated"
        run = simulate(CRANE, alone("50 t", 100.0, "ns"))
        assert float((np.abs(run["u_raw"]) > 1.0).mean()) > SATURATION_SHARE

    @pytest.mark.slow
    def test_high_speed_mode_stops_at_its_share_of_the_safe_working_load(self, found):
        assert found.axes.loads[1] == Mode("hs").law.swl_share * CRANE.SWL
        assert found.cause[1, 1, 0, 0, 0] == ""
        assert found.cause[1, 2, 0, 0, 0] == "load above limit of mode"
        assert "relief" not in found.status[1, 2, 0, 0, 0]

    def test_open_relief_valves_are_worse_than_the_rule(self, found):
        """With a boost pump that keeps the low line filled; one that does not is worse still."""
        filled = changed(CRANE, {"active": {"boost": {"Q_max": "1e6 L/min"}}}).model_copy(update={"hpu": None})
        cell = map_of(filled, ["hs"], loads="250 t", speeds="100 m/min")
        assert cell.cause[0, 0, 0, 0, 0] == "relief valves"
        run = simulate(filled, alone("250 t", 100.0, "hs"))
        assert float(run["p_a"].max()) > CRANE.active.relief.p
        worse = [r.cause for r in RULES[: [r.cause for r in RULES].index("relief valves") + 1]]
        assert found.cause[1, 3, 2, 0, 0] in worse

    def test_a_share_of_saturation_below_the_tolerated_one_is_no_cause(self):
        summary = {"status": "saturated", "saturation_time": 1.99, "counted_time": 20.0}
        assert cause_of(CRANE, summary, Mode.SSC, 0.5 * CRANE.SWL) == ""
        over = {**summary, "saturation_time": 2.01}
        assert cause_of(CRANE, over, Mode.SSC, 0.5 * CRANE.SWL) == "pumps saturated"
        drive = load_crane("nov-100t-electric")  # has no pumps
        assert cause_of(drive, over, Mode.POSITION, 0.5 * drive.SWL) == "command saturated"

    WORST_FIRST = (
        *("diverged", "audit", "unstable", "slack", "wire", "accumulator", "overspeed", "cavitation", "relief"),
        *("power", "boost", "saturated", "uncompensated"),
    )
    """Limits of closed circuits; those of other winch types have rules behind them."""

    @pytest.mark.parametrize("worst", range(len(WORST_FIRST)))
    def test_the_worst_cause_is_named_first(self, worst):
        words = self.WORST_FIRST[worst:]
        saturated = 20.0 if "saturated" in words else 0.0
        summary = {"status": ", ".join(words), "saturation_time": saturated, "counted_time": 20.0}
        assert cause_of(CRANE, summary, Mode.HS, CRANE.SWL) == {r.limit: r.cause for r in RULES}[words[0]]

    def test_every_limit_of_every_winch_type_has_a_rule(self):
        known = {r.limit for r in RULES}
        assert all(set(winch.causes.values()) <= known for winch in WINCH_TYPES.values())

    @pytest.mark.parametrize(("status", "time", "cause"), [("diverged", np.nan, "diverged"), ("offset", 0.0, "")])
    def test_a_run_without_numbers_is_diverged_and_a_standing_offset_is_no_cause(self, status, time, cause):
        summary = {"status": status, "saturation_time": time, "counted_time": time + 20.0}
        assert cause_of(CRANE, summary, Mode.SSC, 0.5 * CRANE.SWL) == cause

    def test_every_mark_stands_for_one_cause(self):
        assert len(set(MARKS.values())) == len(RULES)  # a command's end has that of the pumps'


class TestBestClassic:
    def test_it_is_never_worse_than_an_applicable_mode(self, found):
        best, usable = found.labels.index(BEST_CLASSIC), found.applicable
        for i in (0, 1):
            both = usable[i] & usable[best]
            assert both.any()
            assert (found.values["e_c_pp"][best][both] <= found.values["e_c_pp"][i][both]).all()

    def test_it_is_applicable_where_a_classic_mode_is(self, found):
        best = found.labels.index(BEST_CLASSIC)
        np.testing.assert_array_equal(found.applicable[best], found.applicable[0] | found.applicable[1])

    def test_every_number_of_a_cell_is_from_the_same_mode(self, found):
        best = found.labels.index(BEST_CLASSIC)
        for place in np.ndindex(found.cause[best].shape):
            row = [found.values[n][(best, *place)] for n in NUMBERS] + [found.cause[(best, *place)]]
            assert row in [[found.values[n][(i, *place)] for n in NUMBERS] + [found.cause[(i, *place)]] for i in (0, 1)]

    def test_high_speed_mode_takes_over_where_normal_speed_ends(self, found):
        best = found.labels.index(BEST_CLASSIC)
        assert found.values["alpha_m_min"][best, 0, 1, 0, 0] == pytest.approx(CRANE.control.alpha_ns, abs=1e-3)
        assert found.values["alpha_m_min"][best, 0, 2, 0, 0] == pytest.approx(CRANE.control.alpha_hs, abs=1e-3)

    def test_change_exists_only_where_both_are_applicable(self, found):
        change, best = found.change("e_c_pp"), found.labels.index(BEST_CLASSIC)
        np.testing.assert_array_equal(np.isfinite(change), found.applicable & found.applicable[best])
        assert (
            change[2, 0, 0, 0, 0]
            == cell(found, "e_c_pp", "ssc", 0, 0) / cell(found, "e_c_pp", BEST_CLASSIC, 0, 0) - 1.0
        )

    def test_without_a_classic_mode_nothing_is_compared(self):
        m = map_of(CRANE, ["ssc", "ssc-cubic"], loads="100 t", speeds="60 m/min")
        assert m.labels == ("ssc", "ssc-cubic")
        assert m.changes() == {}

    def test_semi_secondary_control_beats_the_best_classic_mode_on_error_and_pressure(self, found):
        for name in ("e_c_pp", "p_max"):
            change = found.change(name)[2]
            assert (change[np.isfinite(change)] < 0.0).all()


class TestMotion:
    def test_another_motion_has_the_speed_of_the_cell_in_the_part_that_counts(self):
        waves = Sum([Sine(amplitude="2 m", period="13 s"), Sine(amplitude="0.5 m", period="6 s")])
        m = map_of(CRANE, ["ssc"], loads="100 t", speeds="30 m/min, 60 m/min", motion=waves)
        larger = scaled_to(waves, 1.0, 10.0, 30.0)
        assert speed_peak(larger, 10.0, 30.0) == pytest.approx(1.0, rel=1e-12)
        single = simulate(
            CRANE, [alone("100 t", 60.0, "ssc").model_copy(update={"tip": scaled_to(waves, 1.0, 10.0, 30.0)})]
        )
        assert cell(m, "e_c_pp", "ssc", 0, 1) == pytest.approx(float(single["e_c_pp"][0]), rel=1e-9)

    def test_a_sine_scaled_to_its_speed_is_the_default_sine(self):
        wave = scaled_to(Sine(amplitude="1 m", period="12 s"), 1.0, 10.0, 30.0)
        assert wave.amplitude == pytest.approx(12.0 / (2.0 * np.pi), rel=PEAK_TOLERANCE)

    def test_scaling_keeps_the_times_of_every_kind_of_motion(self):
        t = np.linspace(0.0, 20.0, 41)
        record = Recorded(t, np.sin(t))
        steps = Profile(points=[("0 s", "0 m/min"), ("5 s", "40 m/min"), ("20 s", "0 m/min")])
        for motion in (record, steps, Sine(amplitude="1 m", period="7 s", phase="30 deg")):
            for before, after in zip(motion.sample(t), scaled(motion, 2.5).sample(t), strict=True):
                np.testing.assert_allclose(after, 2.5 * before, rtol=1e-9, atol=1e-9)

    def test_a_tip_that_stands_still_cannot_be_brought_to_a_speed(self):
        with pytest.raises(StillhookError, match="is stationary"):
            map_of(CRANE, ["ssc"], loads="100 t", speeds="60 m/min", motion=Still())


class TestAxes:
    def test_defaults_are_those_of_paper_e(self):
        axes = axes_of(CRANE)
        assert [m / CRANE.SWL for m in axes.loads] == pytest.approx(np.arange(2, 11) / 10)
        assert [60.0 * v for v in axes.speeds] == pytest.approx(np.arange(10, 121, 10))

    def test_a_range_holds_both_ends_and_even_steps(self):
        assert quantities("10 m/min to 30 m/min by 10 m/min", "speed", "speeds") == pytest.approx(
            (10 / 60, 20 / 60, 30 / 60)
        )

    @pytest.mark.parametrize(
        ("asked", "words"),
        [
            ({"loads": "120 %"}, r"300 t exceeds the SWL"),
            ({"speeds": []}, r"speeds: empty"),
            ({"speeds": "0 m/min"}, r"must be above 0"),
            ({"loads": "100 t, 50 t"}, r"50 t comes after 100 t"),
            ({"speeds": "10 m/min to 50 m/min by 7 m/min"}, r"not a multiple of the step"),
            ({"layers": []}, r"layers: empty"),
            ({"layers": [3, 3]}, r"named twice"),
            ({"layers": 3, "s_w": "10 m"}, r"both define the wire paid out"),
            ({"motion": Sine(amplitude="1 m", period="6 s"), "periods": "8 s"}, r"a motion has its own periods"),
        ],
    )
    def test_bad_input_is_one_line(self, asked, words):
        with pytest.raises(StillhookError, match=words) as problem:
            map_of(CRANE, **asked)
        assert "\n" not in str(problem.value)

    def test_a_record_shorter_than_the_runs_is_refused(self):
        t = np.linspace(0.0, 20.0, 41)
        with pytest.raises(ScenarioError, match="do not fill runs"):
            map_of(CRANE, ["ssc"], motion=Recorded(t, np.sin(t)))


class TestDataset:
    def test_it_says_what_its_numbers_are(self, found):
        data = found.dataset()
        assert data["e_c_pp"].attrs["units"] == "m"
        assert data["load"].attrs["units"] == "kg"
        assert all(data[name].attrs.get("long_name") for name in data.data_vars)
        assert data["applicable"].dtype == bool
        assert float(data["e_c_pp"].sel(controller="ssc")[0, 0]) == cell(found, "e_c_pp", "ssc", 0, 0)

    def test_a_picture_is_of_the_first_layer_and_period_unless_another_is_named(self, found):
        """Of a map with one period there is no other."""
        from stillhook.analysis.maps.figures import value_figure

        assert len(found.axes.periods) == 1
        assert value_figure(found, "e_c_pp").get_suptitle().endswith("m of wire out, sine of 12 s")

    @pytest.mark.thorough
    def test_pictures_show_every_value_and_name_every_cause(self, found):
        from stillhook.analysis.maps.figures import figures

        pictures = figures(found)
        assert {"e_c_pp", "p_max", "alpha_m_min", "change"} <= set(pictures)
        legend = [t.get_text() for t in pictures["e_c_pp"].legends[0].get_texts()]
        assert set(legend) == {c for c in found.cause.ravel() if c}
        meshes = [ax.collections[0] for ax in pictures["e_c_pp"].axes if ax.get_title()]
        assert len({m.get_clim() for m in meshes}) == 1
