"""A hindcast of one's own in a plan: read as the plan says, refused in one line where it cannot be."""

import numpy as np
import pytest

from stillhook.errors import StillhookError
from stillhook.plan.file import copy_plan, load_plan, plans
from stillhook.plan.weather.records import weather_used

OWN = 'file = "site.csv"\nsense = "going-to"\ntime = "when"\ndate_order = "dmy"\ncolumns = { Hs = "height (cm)", come_from = "heading of waves" }\n'
TABLE = "when;height (cm);heading of waves;Tp\n1/2/2013 0:00;150;90;8\n1/2/2013 1:00;160;90;8\n"


@pytest.fixture
def plan(tmp_path):
    def of(weather):
        folder = tmp_path / "plan"
        copy_plan("template-to-1500m", folder)
        file = next(f for f in folder.glob("*.toml") if "[[phase]]" in f.read_text())
        head, rest = file.read_text().split("[weather]\n", 1)
        file.write_text(head + "[weather]\n" + weather + rest.split("\n", 1)[1])
        (folder / "site.csv").write_text(TABLE)
        return str(file)

    return of


def test_headings_times_and_sense_are_those_that_the_plan_names(plan):
    found = weather_used(load_plan(plan(OWN)).weather)
    assert found.columns["H_m0"].tolist() == [1.5, 1.6]
    np.testing.assert_allclose(np.degrees(found.columns["come_from"]), 270.0)
    assert found.time[0] == np.datetime64("2013-02-01T00:00:00")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("Hs = ", "waves = ", 'weather.columns "waves": is not one of Hs, Tp'),
        (
            'columns = { Hs = "height (cm)", come_from = "heading of waves" }',
            'columns = "Hs"',
            'weather.columns = "Hs": it must be a table',
        ),
        ('"dmy"', '"dym"', "date_order"),
        ('"height (cm)"', "1", "write a heading of the file"),
        ("sense", "sence", 'did you mean "sense"'),
    ],
)
def test_what_cannot_be_meant_is_refused_as_the_plan_is_read(plan, old, new, says):
    assert old in OWN
    with pytest.raises(StillhookError) as caught:
        load_plan(plan(OWN.replace(old, new)))
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.long
def test_every_example_plan_finds_its_weather():
    for name in plans():
        use = load_plan(name).weather
        assert use is None or len(weather_used(use)) > 0


def test_weather_without_a_height_is_refused_and_one_without_a_period_goes_by_what_there_is(plan, tmp_path):
    use = load_plan(plan(OWN)).weather
    site = tmp_path / "plan" / "site.csv"
    site.write_text(TABLE.replace("150", "NaN").replace("160", "inf"))
    with pytest.raises(
        StillhookError, match=r"site.csv: no record of wave height: all 2 are missing. Give weather that has them."
    ):
        weather_used(use)
    site.write_text(TABLE.replace(";8", ";0"))
    found = weather_used(use)
    assert "T_p" not in found.columns
    assert any("Tp: 2 of 2 missing, 2 of them 0, first in site.csv: line 2" in note for note in found.notes)
