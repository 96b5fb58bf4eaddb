"""Booms: where the crane tip is, and what a crane cannot reach."""

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from stillhook.errors import SeaError, UnitError
from stillhook.sea.vessel.boom import Boom

PEDESTAL = ("-10 m", "-6 m", "15 m")


def knuckle_boom(**changes: object) -> Boom:
    given = {
        "pedestal": PEDESTAL,
        "slew": "270 deg",
        "main": ("25 m", "60 deg"),
        "knuckle": ("15 m", "60 deg"),
        **changes,
    }
    return Boom(**given)  # type: ignore[arg-type]


def test_a_level_boom_over_starboard_reaches_out_by_its_length():
    x, y, z = Boom(pedestal=PEDESTAL, slew="270 deg", main=("20 m", "0 deg")).tip
    assert (x, y, z) == pytest.approx((-10.0, -26.0, 15.0))


def test_slew_counts_from_the_bow_to_port():
    places = {"0 deg": (10.0, -6.0), "90 deg": (-10.0, 14.0), "180 deg": (-30.0, -6.0), "270 deg": (-10.0, -26.0)}
    for slew, (x, y) in places.items():
        assert Boom(pedestal=PEDESTAL, slew=slew, main=("20 m", "0 deg")).tip[:2] == pytest.approx((x, y))


def test_a_knuckle_folded_by_the_main_booms_angle_is_level():
    boom = knuckle_boom()
    assert boom.radius == pytest.approx(12.5 + 15.0)
    assert boom.tip[2] == pytest.approx(15.0 + 25.0 * math.sqrt(3.0) / 2.0)


def test_a_knuckle_at_a_right_angle_makes_a_right_triangle():
    """3-4-5: main boom 20 m, knuckle 15 m, tip 25 m from the heel."""
    boom = knuckle_boom(main=("20 m", "80 deg"), knuckle=("15 m", "90 deg"))
    assert math.hypot(boom.radius, boom.tip[2] - 15.0) == pytest.approx(25.0)


def test_the_offset_moves_the_tip_out():
    assert knuckle_boom(offset="2 m").radius == pytest.approx(knuckle_boom().radius + 2.0)


@pytest.mark.slow
@given(
    slew=st.floats(0.0, 359.0),
    main=st.floats(5.0, 85.0),
    knuckle=st.floats(1.0, 120.0),
)
def test_a_boom_told_to_reach_its_own_tip_stands_as_it_stood(slew, main, knuckle):
    assume(math.cos(math.radians(main)) + math.cos(math.radians(main - knuckle)) > 0.0)
    boom = Boom(
        pedestal=PEDESTAL,
        slew=f"{slew} deg",
        main=("25 m", f"{main} deg"),
        knuckle=("25 m", f"{knuckle} deg"),
        offset="1 m",
    )
    back = boom.reaching(*boom.tip)
    assert back.tip == pytest.approx(boom.tip, abs=1e-6)
    assert math.degrees(back.main_angle) == pytest.approx(main, abs=1e-5)
    assert math.degrees(back.knuckle_angle) == pytest.approx(knuckle, abs=1e-5)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: knuckle_boom().reaching(-10.0, -60.0, 20.0), "54.23 m from the heel pin: the boom reaches 40 m"),
        (lambda: knuckle_boom().reaching(-10.0, -9.0, 16.0), "fold to 10 m"),
        (lambda: knuckle_boom(main=("25 m", "95 deg")), "main angle 95 deg is not between 0 deg (level)"),
        (lambda: knuckle_boom(knuckle=("15 m", "-5 deg")), "knuckle angle -5 deg is not between 0 deg (straight on)"),
        (lambda: knuckle_boom(main=("5 m", "30 deg"), knuckle=("25 m", "170 deg")), "folded back over the pedestal"),
        (lambda: knuckle_boom(main=("25 km", "60 deg")), "main length 25000 m is not between 1 m and 200 m"),
        (lambda: knuckle_boom(pedestal=("-10 m", "-6 m")), "pedestal = ('-10 m', '-6 m') is not 3 texts"),
        (lambda: knuckle_boom(pedestal=("-1 km", "-6 m", "15 m")), "more than 300 m off the reference point"),
        (lambda: knuckle_boom(offset="-1 m"), "offset -1 m is not between"),
    ],
)
def test_what_no_crane_does_is_one_line(make, text):
    with pytest.raises(SeaError) as refused:
        make()
    assert text in str(refused.value)
    assert "\n" not in str(refused.value)


def test_numbers_without_units_are_refused():
    with pytest.raises(UnitError, match="boom: main length"):
        knuckle_boom(main=("25", "60 deg"))


def test_the_crane_is_said_in_words():
    assert knuckle_boom().describe() == (
        "slew 270 deg, main boom 25 m 60 deg up, knuckle boom 15 m 60 deg down: radius 27.5 m, "
        "tip x -10 m, y -33.5 m, 36.65 m above still water"
    )
