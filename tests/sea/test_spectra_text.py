"""Seas as text, and directions between compass and ship."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillhook.errors import SeaError, UnitError
from stillhook.sea.spectra.directions import DirectionSense, coming_from, relative
from stillhook.sea.spectra.measured import Measured
from stillhook.sea.spectra.parametric import Jonswap, Torsethaugen
from stillhook.sea.spectra.spectrum import Sea, Train
from stillhook.sea.spectra.text import parse_sea, parse_wave, sea_text, spectrum_from_dict

ROUNDING = 1e-12
angles = st.floats(0.0, 2.0 * math.pi, exclude_max=True)


class TestPeriods:
    @pytest.mark.parametrize(
        "text",
        ["pm Hs=2 m Tz=6 s", "jonswap Hs=2 m Tz=6 s gamma=3.3", "jonswap Hs=2 m Tz=6 s", "jonswap Hs=5 m Tz=6 s"],
    )
    def test_a_zero_crossing_period_that_is_given_comes_out(self, text):
        assert parse_wave(text).T_m02 == pytest.approx(6.0, rel=1e-9)

    def test_both_periods_are_one_too_many(self):
        with pytest.raises(SeaError, match="Tp and Tz are both given"):
            parse_wave("pm Hs=2 m Tp=8 s Tz=6 s")

    def test_a_sea_of_neither_is_refused(self):
        with pytest.raises(SeaError, match="pm has no Tp"):
            parse_wave("pm Hs=2 m")


class TestSeas:
    def test_each_train_may_have_its_own_side_and_spread(self):
        sea = parse_sea("jonswap Hs=2 m Tp=8 s heading=150 deg spread=4 + pm Hs=1 m Tp=14 s", heading="180 deg")
        wind, swell = sea.trains
        assert math.degrees(wind.beta) == pytest.approx(150.0)
        assert (wind.spread, swell.spread, swell.beta) == (4.0, None, math.pi)
        assert [spectrum_from_dict(t.spectrum.to_dict()) for t in sea.trains] == [t.spectrum for t in sea.trains]

    @given(
        st.floats(0.1, 12.0),
        st.floats(7.1, 20.0),
        angles,
        st.none() | st.floats(1.0, 7.0),
        st.none() | st.floats(1.0, 9.0),
    )
    def test_a_sea_as_text_is_the_same_sea_to_the_last_digit(self, Hs, Tp, beta, gamma, spread):
        trains = [Train(Jonswap(Hs, Tp, gamma), beta, spread), Train(Torsethaugen(Hs, Tp), beta)]
        assert parse_sea(sea_text(Sea(tuple(trains)))) == Sea(tuple(trains))

    def test_spectra_that_no_text_names_are_refused(self):
        measured = Measured([0.5, 0.6], [0.1, 0.1], [1.0, 1.0], "buoy")
        with pytest.raises(SeaError, match="has no text"):
            sea_text(Sea((Train(measured, 0.0),)))

    def test_a_sea_without_a_side_is_refused(self):
        with pytest.raises(SeaError, match="no heading"):
            parse_sea("pm Hs=1 m Tp=8 s")

    def test_a_spread_that_is_none_is_refused(self):
        with pytest.raises(SeaError, match="spread 0: is not between 1 and 200"):
            parse_sea("pm Hs=1 m Tp=8 s heading=0 deg spread=0")
        with pytest.raises(UnitError, match="not a plain number"):
            parse_sea("pm Hs=1 m Tp=8 s heading=0 deg spread=wide")

    def test_the_place_stands_first_in_every_error(self):
        with pytest.raises(SeaError, match=r'^lift.toml: sea.waves: "pm": pm has no Hs'):
            parse_wave("pm", "lift.toml: sea.waves")

    @pytest.mark.parametrize("text", [None, 3, "pm Hs=1 m Tp=8 s +", "+ pm Hs=1 m Tp=8 s"])
    def test_what_is_no_wave_is_refused(self, text):
        with pytest.raises(SeaError):
            parse_wave(text)

    @pytest.mark.parametrize("data", [{"type": "sine"}, {"type": "jonswap"}, {}, {"type": "measured", "omega": [1.0]}])
    def test_stored_waves_that_are_none_are_refused(self, data):
        with pytest.raises(SeaError, match="stored waves"):
            spectrum_from_dict(data)


class TestDirections:
    @pytest.mark.parametrize(
        ("heading", "come_from", "beta"),
        [
            (0.0, 0.0, 180.0),  # bow north, waves from north: head sea
            (0.0, 180.0, 0.0),  # from astern: following
            (0.0, 90.0, 90.0),  # bow north, waves from east, which is starboard
            (0.0, 270.0, 270.0),  # from west: port
            (270.0, 0.0, 90.0),  # bow west, waves from north: starboard
            (45.0, 90.0, 135.0),  # from 45 deg off the starboard bow
        ],
    )
    def test_a_ship_meets_waves_where_its_crew_would_point(self, heading, come_from, beta):
        found = relative(math.radians(come_from), math.radians(heading))
        assert math.degrees(found) == pytest.approx(beta, abs=1e-9)

    @given(angles, angles)
    def test_to_the_ship_and_back(self, come_from, heading):
        back = relative(relative(come_from, heading), heading)
        assert math.cos(back - come_from) == pytest.approx(1.0, abs=ROUNDING)

    @pytest.mark.parametrize(
        ("sense", "number"),
        [
            (DirectionSense.FROM_NORTH, 270.0),
            (DirectionSense.TO_NORTH, 90.0),
            (DirectionSense.FROM_EAST, 180.0),
            (DirectionSense.TO_EAST, 0.0),
        ],
    )
    def test_a_westerly_is_a_westerly_in_every_sense(self, sense, number):
        assert math.degrees(coming_from(math.radians(number), sense)) == pytest.approx(270.0, abs=1e-9)

    @given(angles, angles)
    def test_turning_the_ship_to_starboard_turns_the_waves_to_port(self, come_from, heading):
        turned = relative(come_from, heading + 0.1) - relative(come_from, heading)
        assert math.cos(turned - 0.1) == pytest.approx(1.0, abs=ROUNDING)

    def test_arrays_turn_as_numbers_do(self):
        come_from = np.radians([0.0, 90.0, 200.0])
        assert relative(come_from, 0.3) == pytest.approx([relative(float(x), 0.3) for x in come_from])
