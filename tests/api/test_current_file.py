"""Current and wind in lift files: lists and tables, what `lower` prints of them, and mistakes in one line."""

import json
import math
from pathlib import Path

import pytest
from tests.plan.test_load_chart import HEAD, PLAN, ROWS
from tests.plan.test_sideways import CURRENT, DOWN, WIND

from stillhook.cli import run
from stillhook.formats.lift_file import load_lift
from stillhook.plan.file import load_plan

LIFT = (
    'crane = "nov-250t"\npayload = "manifold-60t"\nstart_depth = "20 m"\nduration = "90 s"\n[water]\ndepth = "300 m"\n'
    '[tip]\nheight = "36 m"\nmotion = "sine 0.5 m 9 s"\n'
    '[[phase]]\nmode = "manual"\nspeed = "24 m/min"\ndepth = "45 m"\n'
)
FLOW = '[environment.current]\nfile = "current.csv"\nsense = "coming-from"\nreference = "bow"\n'
TABLE = "# ADCP, mean of June\ndepth [m];speed [kn];direction [deg]\n0;2,0;350\n100;1,0;10\n300;0,5;30\n"


def written(folder: Path, flow: str = FLOW, table: str = TABLE, lift: str = LIFT) -> str:
    (folder / "current.csv").write_text(table, encoding="utf-8")
    path = folder / "lift.toml"
    path.write_text(lift + flow, encoding="utf-8")
    return str(path)


def test_a_profile_from_a_table_is_that_of_lists_in_its_units(tmp_path):
    lists = '[environment.current]\ndepth = ["0 m", "100 m", "300 m"]\nspeed = ["2 kn", "1 kn", "0.5 kn"]\n'
    lists += 'direction = ["350 deg", "10 deg", "30 deg"]\nsense = "coming-from"\n'
    given = load_lift(written(tmp_path)).lift.current
    wanted = load_lift(written(tmp_path, lists)).lift.current
    assert given.velocity(-50.0) == pytest.approx(wanted.velocity(-50.0))
    assert given.velocity(-50.0) == pytest.approx((-1.5 * 1852.0 / 3600.0, 0.0))  # from ahead: 350 to 10 deg


@pytest.mark.long
def test_a_table_of_excel_with_headings_of_its_maker_is_read_by_columns(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in (["Bin", "Spd (cm/s)", "Dir (deg)"], [0, 80, 10], [300, 20, 10]):
        book.active.append(row)
    book.save(tmp_path / "current.xlsx")
    flow = '[environment.current]\nfile = "current.xlsx"\nsense = "going-to"\nreference = "north"\nship = "30 deg"\n[environment.current.columns]\n'
    flow += (
        'depth = "Bin [m]"\nspeed = { column = "Spd (cm/s)", unit = "m/s", scale = 0.01 }\ndirection = "Dir (deg)"\n'
    )
    current = load_lift(written(tmp_path, flow)).lift.current
    assert current.past(-150.0) == pytest.approx(0.5)
    turn = math.radians(20.0)  # it goes to 10 deg from north, the bow points to 30 deg: 20 deg to port of the bow
    assert current.velocity(-150.0) == pytest.approx((0.5 * math.cos(turn), 0.5 * math.sin(turn)))


def test_lower_names_the_current_and_its_drag_is_larger(tmp_path, capsys):
    answers = []
    for flow in ("", FLOW):
        assert run(["lower", written(tmp_path, flow), "--json"]) == 0
        answers.append(json.loads(capsys.readouterr().out))
    assert answers[1]["F_drag_max"] > 1.2 * answers[0]["F_drag_max"]
    assert "current of 1.03 m/s at the surface to 0.257 m/s at the seabed, coming from" in answers[1]["place"]
    assert "current" not in answers[0]["place"]


def test_a_lift_at_a_deck_has_no_current(tmp_path):
    lift = LIFT.replace("20 m", "-8 m").replace("45 m", "-9 m").replace('"24 m/min"', '"-24 m/min"')
    assert load_lift(written(tmp_path, FLOW + '[deck]\nheight = "4 m"\n', lift=lift)).lift.current is None


def test_a_plan_has_current_and_wind_from_tables_and_its_runs_the_current(tmp_path):
    (tmp_path / "chart.csv").write_text(HEAD + ROWS, encoding="utf-8")
    (tmp_path / "current.csv").write_text(TABLE, encoding="utf-8")
    (tmp_path / "wind.csv").write_text("height [m],speed [m/s]\n10,12\n60,15\n", encoding="utf-8")
    wind = WIND.replace('speed = "12 m/s"', 'file = "wind.csv"')
    flow = FLOW + 'area = "40 m^2"\n' + wind
    (tmp_path / "plan.toml").write_text(PLAN.replace("[load_chart]", flow + "[load_chart]", 1) + DOWN, encoding="utf-8")
    plan = load_plan(tmp_path / "plan.toml")
    env = plan.environment
    assert env.wind.at(35.0) == pytest.approx(13.5)
    assert env.wind.at(35.0, 3.0) == pytest.approx(13.5 + 12.0 * 0.047 * math.log(200.0))
    assert plan.hanging(-50.0).current == env.current
    assert plan.hanging(-50.0).body == "current"
    assert "wind of 12 m/s (10 min, 10 m) to 15 m/s (10 min, 60 m), coming from 180 deg" in plan.notes


@pytest.mark.parametrize(
    ("flow", "table", "texts"),
    [
        (FLOW.replace('sense = "coming-from"\n', ""), TABLE, ["environment.current.sense", "missing"]),
        (
            FLOW.replace('reference = "bow"\n', ""),
            TABLE,
            ["environment.current.reference", "missing", '"north" with ship'],
        ),
        (FLOW.replace("bow", "north"), TABLE, ["environment.current", "ship is missing of reference north"]),
        (FLOW + 'ship = "20 deg"\n', TABLE, ["environment.current", "ship is given of reference bow"]),
        (FLOW.replace("bow", "stern"), TABLE, ["environment.current.reference", "bow", "north"]),
        (FLOW, TABLE.replace("speed [kn]", "speed"), ["current.csv", '"speed" has no unit', "m/s"]),
        (FLOW, TABLE.replace("[deg]", "[m]"), ["current.csv", "direction", '"m"']),
        (FLOW, TABLE.replace("depth [m]", "level"), ["current.csv", "no column", "depth [m]"]),
        (FLOW, TABLE.replace("1,0", ""), ["current.csv", "row 4", "speed [kn]", "is not a number"]),
        (FLOW, TABLE.replace("0;2,0", "5;2,0"), ["environment.current", "begin at 0 m and rise"]),
        (FLOW, TABLE.replace("300;", "200;"), ["current.depth", "ends at 200 m", "seabed is at 300 m"]),
        (FLOW, TABLE.replace("2,0", "-2,0"), ["environment.current", "negative"]),
        (FLOW.replace(".csv", ".txt"), TABLE, ["environment.current.file", "current.txt", "no such file"]),
        (FLOW.replace('"current.csv"', "3"), TABLE, ["environment.current.file", "flow.csv"]),
        (FLOW + 'speed = "1 m/s"\n', TABLE, ["environment.current.speed", "together with file"]),
        ("[environment]\ncurrent = 3\n", TABLE, ["environment.current = 3", "table"]),
    ],
)
def test_a_current_that_cannot_be_read_is_refused_in_one_line_with_exit_code_2(tmp_path, capsys, flow, table, texts):
    assert run(["lower", written(tmp_path, flow, table)]) == 2
    line = capsys.readouterr().err.strip()
    assert "\n" not in line
    for text in ("lift.toml", *texts):
        assert text in line


def test_a_plan_without_the_side_that_the_current_meets_is_refused(tmp_path, capsys):
    (tmp_path / "chart.csv").write_text(HEAD + ROWS, encoding="utf-8")
    flow = CURRENT.replace('area = "40 m^2"\n', "")
    (tmp_path / "plan.toml").write_text(PLAN.replace("[load_chart]", flow + "[load_chart]", 1) + DOWN, encoding="utf-8")
    assert run(["plan", str(tmp_path / "plan.toml"), "--check"]) == 2
    line = capsys.readouterr().err.strip()
    assert "\n" not in line
    assert "environment.current" in line
    assert "area: missing" in line
