"""Numbers as servers describe them: each has a unit that its kind of quantity has."""

import pytest

from stillhook.live.servers.served import about, kind_of
from stillhook.sea.vessel.vessel_tip import VESSEL
from stillhook.units import KINDS
from stillhook.variables import BY_NAME


@pytest.mark.parametrize("name", [*VESSEL, *(name for name, v in BY_NAME.items() if v.kind)])
def test_the_unit_of_a_number_is_that_of_its_kind(name):
    unit, meaning = about(name)
    assert unit == KINDS[kind_of(name)].si
    assert meaning


def test_a_number_as_the_plc_reads_it_has_the_kind_of_what_it_reads():
    assert kind_of("sensed_s_w") == kind_of("s_w") == "length"
    assert about("age.s_w") == ("s", f"age: {about('s_w')[1]}")
    assert about("alarm.s_w")[0] == "1"
    assert about("deviation.s_w")[0] == about("s_w")[0]
