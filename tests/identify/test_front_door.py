"""Every reader of a table takes the same corrections, shows what it understood, and says every mistake with its cure."""

from pathlib import Path

import numpy as np
import pytest

from stillhook.cli import run
from stillhook.errors import StillhookError
from stillhook.formats.motion.open import read_ship_motion, read_tip_motion
from stillhook.formats.table.corrections import corrections, corrections_of, text_row
from stillhook.formats.weather.description import weather_of_file
from stillhook.identify.motor.map import read_map
from stillhook.logs.log import read_log
from stillhook.logs.mapping import mapping_from
from stillhook.logs.understood import signals_of, understood_log
from stillhook.plan.definition.lift_plan import Environment
from stillhook.plan.definition.load_chart import read_load_chart

EXACT = 1e-12
G = 9.80665  # m/s^2, standard gravity
ROWS = 240


def written(folder: Path, name: str, *lines: str) -> Path:
    path = folder / name
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def comma(x: float) -> str:
    return f"{x:.3f}".replace(".", ",")


def wave(i: int) -> float:
    return float(np.sin(2.0 * np.pi * i / 80.0))


@pytest.fixture
def ship(tmp_path: Path) -> Path:
    """A ship's log with names of its own, decimal commas, and times without a unit."""
    rows = (f"{comma(0.1 * i)};{comma(wave(i))};{comma(0.5)};{comma(0.1 * wave(i))}" for i in range(ROWS))
    return written(tmp_path, "ship log.csv", "Timestamp;MRU_Heave_m;MRU_Roll_deg;MRU_Pitch_deg", *rows)


@pytest.fixture
def crane(tmp_path: Path) -> Path:
    """The first seconds of a PLC in German: a title, units in a row, stamps with decimal commas, lowering positive."""
    rows = []
    for i in range(ROWS):
        speed = 20.0 * wave(i)  # 1/min, lowering positive
        wire = 100.0 + 20.0 * (1.0 - np.cos(2.0 * np.pi * i / 80.0)) * 0.01
        stamp = f"20.11.2026 06:00:{0.1 * i:06.3f}".replace(".", ",").replace("20,11,2026", "20.11.2026")
        rows.append(
            f"{stamp};{comma(30.0 + wave(7 * i))};{comma(25.0 + wave(9 * i))};{comma(speed)};{comma(3.0)};{comma(wire)}"
        )
    names = "Zeitstempel;Druck A;Druck B;Drehzahl;Hakenlast;Seil aus"
    return written(tmp_path, "plc.csv", "Kranprotokoll;;;;;", names, "dd.mm.yyyy;bar;bar;1/min;t;m", *rows)


HINDCAST = (
    "Date/Time (UTC);Hm0 [m];Tp [s];MWD [deg];U10 [m/s]",
    *(f"2020-01-01 {hour:02d}:00;{comma(1.0 + 0.1 * hour)};8,0;300;7,5" for hour in range(12)),
)
LONG = ("Radius [m];Hs [m];SWL [t]", "10;1,0;240", "20;1,0;220", "10;1,5;225", "20;1,5;200")
MATRIX = ("Radius (m);SWL harbour (t);SWL Hs 1,0 m (t);SWL Hs 1,5 m (t)", "10;250;240;225", "20;250;220;200")
TRANSPOSED = ("Hs [m];Capacity 10 m [t];Capacity 20 m [t]", "1,0;240;220", "1,5;225;200")


def test_a_ship_s_own_names_are_read_and_said(ship: Path) -> None:
    motion = read_ship_motion(ship)
    assert motion.heave.max() == pytest.approx(1.0, abs=1e-3)
    said = motion.report.describe()
    assert 'time from "Timestamp" (no unit in the file: taken as s, by its spacing)' in said
    assert 'heave from "MRU_Heave_m"' in said


def test_down_turns_a_column_and_nothing_else(ship: Path) -> None:
    up, down = (read_ship_motion(ship, columns=corrections_of([f"heave=MRU_Heave_m [m]{w}"])) for w in ("", " down"))
    np.testing.assert_array_equal(up.heave, -down.heave)
    np.testing.assert_array_equal(up.pitch, down.pitch)


def test_a_unit_that_is_stated_counts_where_the_file_has_none(tmp_path: Path) -> None:
    path = written(tmp_path, "a.csv", "Zeit;Hub", *(f"{100 * i};{100 * wave(i):.3f}" for i in range(ROWS)))
    motion = read_tip_motion(path, columns=corrections_of(["time=Zeit [ms]", "tip=Hub [cm]"]))
    assert motion.duration == pytest.approx(0.1 * (ROWS - 1))
    assert np.abs(motion.heights).max() == pytest.approx(1.0, abs=1e-2)


@pytest.mark.parametrize(
    ("text", "row"),
    [
        ("MRU_Heave_m [m] down", {"column": "MRU_Heave_m [m]", "sign": -1}),
        ("Drehzahl [1/min] lowering", {"column": "Drehzahl [1/min]", "sign": -1}),
        ("PT101", {"column": "PT101"}),
        ("Seil up", {"column": "Seil", "sign": 1}),
    ],
)
def test_a_text_is_a_heading_with_its_unit_and_its_sense(text: str, row: dict[str, object]) -> None:
    assert text_row(text) == row


def test_a_load_cell_in_tonnes_is_a_force_by_its_weight(crane: Path) -> None:
    log = read_log(crane, mapping_from({"time": "Zeitstempel", "F_w": "Hakenlast"}, "rows"))
    assert np.nanmax(log.signals["F_w"]) == pytest.approx(3.0 * 1000.0 * G, rel=EXACT)


def test_a_plc_in_german_is_understood_and_what_turns_the_other_way_is_found(crane: Path) -> None:
    found = understood_log(crane)
    rows = {row.name: row for row in found.rows}
    assert found.problem == ""
    assert {name: row.heading for name, row in rows.items()} == {
        "time": "Zeitstempel",
        "p_a": "Druck A",
        "p_b": "Druck B",
        "omega_m": "Drehzahl",
        "F_w": "Hakenlast",
        "s_w": "Seil aus",
    }
    assert rows["omega_m"].sign == -1
    assert rows["s_w"].sign == 1
    assert "turned round" in rows["omega_m"].remark


def test_what_is_proposed_for_a_log_is_read_only_when_it_is_given_back(crane: Path, tmp_path: Path) -> None:
    with pytest.raises(StillhookError, match="no heading names a signal"):
        read_log(crane)
    mapping = tmp_path / "mapping.toml"
    assert run(["inspect", str(crane), "--save", str(mapping)]) == 0
    log = read_log(crane, signals_of(crane, mapping))
    assert list(log.signals) == ["p_a", "p_b", "omega_m", "F_w", "s_w"]
    turned = read_log(crane, signals_of(crane, mapping, ["s_w=Seil aus [cm]"]))
    assert np.nanmax(turned.signals["s_w"]) == pytest.approx(np.nanmax(log.signals["s_w"]) / 100.0)


def test_every_reader_takes_back_the_mapping_file_that_is_suggested(ship: Path, tmp_path: Path) -> None:
    mapping = tmp_path / "m.toml"
    chart, weather = written(tmp_path, "chart.csv", *LONG), written(tmp_path, "hindcast.csv", *HINDCAST)
    assert run(["inspect", str(ship), "--column", "heave=MRU_Heave_m [m] down", "--save", str(mapping)]) == 0
    same = read_ship_motion(ship, columns=corrections(mapping))
    np.testing.assert_array_equal(same.heave, -read_ship_motion(ship).heave)
    assert run(["inspect", str(chart), "--save", str(mapping)]) == 0
    assert read_load_chart(chart, mapping).digest == read_load_chart(chart).digest
    assert run(["inspect", str(weather), "--save", str(mapping)]) == 0
    text = mapping.read_text(encoding="utf-8")
    assert '# sense = "coming-from"' in text
    mapping.write_text(text.replace("# sense", "sense"), encoding="utf-8")
    by_mapping, plain = weather_of_file(str(weather), mapping), weather_of_file(str(weather))
    np.testing.assert_array_equal(by_mapping.columns["H_m0"], plain.columns["H_m0"])
    np.testing.assert_allclose(by_mapping.columns["come_from"], np.radians(300.0))
    assert "come_from" not in plain.columns


@pytest.mark.parametrize("lines", [MATRIX, TRANSPOSED])
def test_a_matrix_is_the_same_chart_as_its_rows(tmp_path: Path, lines: tuple[str, ...]) -> None:
    rows, matrix = (read_load_chart(written(tmp_path, f"{i}.csv", *each)) for i, each in enumerate((LONG, lines)))
    assert matrix.rows == rows.rows
    assert any("matrix of 2" in note for note in matrix.notes)
    assert ("harbour" in str(matrix.notes)) == (lines is MATRIX)


def test_of_sectors_the_least_swl_counts(tmp_path: Path) -> None:
    lines = ("Outreach [m];SWL over side 90 deg (t);SWL over stern 180 deg (t)", "10;200;180", "20;90;150")
    chart = read_load_chart(written(tmp_path, "a.csv", *lines))
    assert [(radius, point.SWL) for radius, point in chart.rows[0]] == [(10.0, 180e3), (20.0, 90e3)]
    assert "the least SWL of 2 sectors counts" in chart.notes[0]


@pytest.mark.parametrize(
    "heading", ["Radius (m);Capacity [t]", "radius [m];SWL [te]", "Working radius (m);Rated capacity (t)"]
)
def test_headings_of_charts_are_read_as_people_write_them(tmp_path: Path, heading: str) -> None:
    assert read_load_chart(written(tmp_path, "a.csv", heading, "10;240", "20;220")).reach == (10.0, 20.0)


def test_a_chart_with_names_of_its_own_takes_columns(tmp_path: Path) -> None:
    path = written(tmp_path, "a.csv", "Ausladung;Last", "10;240", "20;220")
    chart = read_load_chart(path, columns={"radius": "Ausladung [m]", "SWL": "Last [t]"})
    assert chart.rows[0][1][1].SWL == pytest.approx(220e3)


def test_a_map_of_a_motor_takes_columns(tmp_path: Path) -> None:
    rows = [f"{D},{n},{dp},{5 + dp / 100}" for D in (100, 200) for n in (500, 1500, 2000) for dp in (100, 200)]
    path = written(tmp_path, "a.csv", "Vg,Drehzahl (1/min),Druck [bar],Verlust [Nm]", *rows)
    texts = ["D_m=Vg [cm^3/rev]", "omega_m=Drehzahl", "dp_m=Druck", "T_f=Verlust"]
    assert len(read_map(path, columns=corrections_of(texts))) == len(rows)


MISTAKES = {
    "motion": [
        (["--column", "heave"], "is not a name, =, and a heading"),
        (["--column", "heave="], "is not a name, =, and a heading"),
        (["--column", "heav=MRU_Heave_m [m]"], 'did you mean "heave"?'),
        (["--column", "heave=Heave"], 'no column "Heave" for heave'),
        (["--column", "heave=MRU_Heave_m [bar]"], "not one of m, cm, mm, km"),
        (["--column", "heave=MRU_Heave_m [m]", "--column", "heave=MRU_Roll_deg"], "heave is given twice"),
        (["--column", "heave=9"], 'no column "9" for heave'),
        (["--column", "roll=MRU_Roll_deg [m]"], "not one of rad, deg, rev"),
        (["--mapping", "gone.toml"], '"gone.toml": no such file'),
        (["--column", "time=Timestamp [bar]"], "not one of s, ms, min, h, d, UTC"),
    ],
    "log": [
        (["--column", "p_a=Druck"], 'no column "Druck"'),
        (["--column", "p_a=Druck A [m]"], "p_a"),
        (["--column", "pa=Druck A [bar]"], '"pa" is not a signal of Stillhook'),
        (["--column", "F_w=Hakenlast [bar]"], "is not one of N, kN, MN"),
        (["--column", "=Druck A"], "is not a name, =, and a heading"),
        (["--column", "p_a=Druck A", "--column", "p_b=Druck A"], "is that of p_a already"),
        (["--column", "p_a=0"], 'no column "0"'),
        (["--column", "p_a=7 [bar]"], 'no column "7"'),
        (["--mapping", "gone.toml"], '"gone.toml": no such file'),
        (["--column", "omega_m=Drehzahl [m/s]"], "is not one of rad/s, rev/min"),
    ],
    "weather": [
        (["--column", "Hs=Height"], "no column, or several"),
        (["--column", "Hz=Hm0 [m]"], "is not one of Hs, Tp"),
        (["--column", "Hs=Hm0 [bar]"], "is not one of m, cm, ft"),
        (["--column", "Hs=Hm0 [m] down"], "not counted the other way"),
        (["--column", "time=Datum"], "no such column"),
        (["--column", "Hs"], "is not a name, =, and a heading"),
        (["--column", "Hs=Hm0", "--column", "Hs=Tp"], "Hs is given twice"),
        (["--column", "wind=U10 [m]"], "is not one of"),
        (["--mapping", "gone.toml"], '"gone.toml": no such file'),
        (["--column", "Tp=Tp [min]"], "is not one of s, sec"),
    ],
    "chart": [
        (["--column", "SWL=Last"], 'no column "Last" for SWL'),
        (["--column", "SWLL=SWL [t]"], 'did you mean "SWL"?'),
        (["--column", "SWL=SWL [kN]"], "not one of kg, t, te"),
        (["--column", "radius=Radius [t]"], "not one of m, cm, mm, km"),
        (["--column", "SWL="], "is not a name, =, and a heading"),
        (["--column", "Hs=Hs [m]", "--column", "Hs=Radius"], "Hs is given twice"),
        (["--column", "DAF=Dyn"], 'no column "Dyn" for DAF'),
        (["--column", "speed=Hs"], "unknown column"),
        (["--mapping", "gone.toml"], '"gone.toml": no such file'),
        (["--column", "Hs=Hs [s]"], "not one of m, cm, mm, km"),
    ],
    "vessel": [(["--column", "heave=RAO"], "a vessel file declares its conventions itself")],
}


@pytest.mark.parametrize(("form", "options", "says"), [(f, o, s) for f, rows in MISTAKES.items() for o, s in rows])
def test_a_mistake_is_one_line_that_names_it(
    ship: Path,
    crane: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    form: str,
    options: list[str],
    says: str,
) -> None:
    files = {"motion": ship, "log": crane, "vessel": ship}
    files |= {"chart": written(tmp_path, "c.csv", *LONG), "weather": written(tmp_path, "w.csv", *HINDCAST)}
    assert run(["inspect", str(files[form]), "--format", form, *options]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert err.startswith("error: ")
    assert says in err


def test_every_wrong_cell_of_a_file_has_its_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "a.csv", "time [s],heave [m],roll [deg]", "0,a,1", "1,2,b", "c,2,3", "3,4,5")
    assert run(["tip", "--log", str(path), "--at", "x=-20 m, y=12 m, z=35 m"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(" = ")[0] for line in lines] == [
        "error: a.csv: line 4: time [s]",
        "error: a.csv: line 2: heave [m]",
        "error: a.csv: line 3: roll [deg]",
    ]


def test_a_log_without_pitch_is_refused_with_the_option_that_is_typed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, "a.csv", "time [s],heave [m],roll [deg]", *(f"{t},{t % 2},0" for t in range(8)))
    assert run(["tip", "--log", str(path), "--at", "x=-20 m, y=12 m, z=35 m"]) == 2
    err = capsys.readouterr().err
    assert err.endswith('Log roll and pitch, or give --at "x=0 m, y=0 m, z=0 m" for the heave alone.\n')


def test_of_many_problems_ten_are_printed_and_the_others_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, "w.csv", "time,Hs,Tp", *(f"2020-01-{day:02d},x,8" for day in range(1, 29)))
    assert run(["weather", "show", str(path)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 11
    assert lines[9].startswith("error: w.csv: line 11: Hs")
    assert lines[10] == "error: 18 more problems. Correct these first."


def test_every_field_of_a_lift_that_is_wrong_has_its_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lift = (
        'crane = "nov-250t"\npayload = "template-120t"\nvessel = "construction-vessel-130m"\nstart_depth = "-5"\n'
        '[tip]\nat = "x=-15 m, y=-24 m, z=36 m"\n[slings]\nlegs = 2\n[water]\ndepth = 1500\n'
        '[environment]\nHs = "0.5-4 m"\nTp = "5-14"\nheadings = ["180 deg"]\n[[phase]]\nname = "a"\nkind = "lift-off"\n'
    )
    path = written(tmp_path, "lift.toml", lift)
    assert run(["plan", str(path), "--check"]) == 2
    lines = capsys.readouterr().err.splitlines()
    says = [
        "slings: unknown field. Slings are one spring in [rigging]",
        'start_depth = "-5": no unit; write "-5 m"',
        "water.depth = 1500",
        'environment.Hs = "0.5-4 m": a range needs its step: write "0.5 m to 4 m by 0.5 m".',
        'environment.Tp = "5-14": a range needs its step: write "5 s to 14 s by 1 s".',
    ]
    assert len(lines) == len(says)
    for say in says:
        assert sum(say in line for line in lines) == 1, say


@pytest.mark.parametrize(
    "text",
    [
        "0.5 m to 2 m by 0.5 m",
        "0.5 to 2 m by 0.5 m",
        "0,5-2 m step 0,5",
        "0.5..2 m in steps of 0.5 m",
        "0.5, 1, 1.5 and 2 m",
        "0.5 m; 1 m; 1.5 m; 2 m",
        ["0,5 m", "1 m", "1.5 m", "2 m"],
    ],
)
def test_heights_are_read_in_the_ways_that_people_write_them(text: object) -> None:
    assert Environment(Hs=text, Tp="8 s", headings=["180 deg"]).Hs == pytest.approx((0.5, 1.0, 1.5, 2.0))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("0.5-4 m", 'write "0.5 m to 4 m by 0.5 m"'),
        ("1 to 3", 'write "1 m to 3 m by 0.25 m"'),
        ("1 to 3 by 1", "no unit: write it behind the numbers"),
        ("4 m to 1 m by 1 m", "the range must increase"),
        ("1 m to 2 m by 0.3 m", "do not meet 2 m"),
        ("1,2,3 m", 'Hs[0] = "1,2,3 m"'),
        ("1 m to 2 s by 1 m", 'unit "s" is not one of'),
        ("some", "not a number, a space and a unit"),
        ("", "empty"),
        (["1 m", "1 m"], "a value is given twice"),
    ],
)
def test_heights_that_may_mean_two_things_name_what_to_write(text: object, says: str) -> None:
    with pytest.raises(StillhookError) as caught:
        Environment(Hs=text, Tp="8 s", headings=["180 deg"])
    assert says in str(caught.value)


def test_two_columns_with_decimal_commas_are_two_columns(tmp_path: Path) -> None:
    path = written(
        tmp_path, "a.csv", "Protokoll", "Zeit;Hub", *(f"{comma(0.1 * i)};{comma(wave(i))}" for i in range(99))
    )
    motion = read_tip_motion(path, columns=corrections_of(["time=Zeit [s]", "tip=Hub [m]"]))
    assert motion.duration == pytest.approx(9.8)


@pytest.mark.parametrize(
    ("name", "lines", "says"),
    [
        ("lift.toml", ('crane = "nov-250t"', "[[phase]]"), "lift.toml is a lift file"),
        ("a.toml", ("a = 1",), "a.toml: is TOML. Give inspect a table"),
        ("a.csv", ("Radius (m);1,0 m (t);1,5 m (t)", "10;240;225"), "does not say for which wave height it is"),
        ("a.csv", ("Radius (m);Capacity (kN)", "10;240"), 'unit "kN" is not one of kg, t, te'),
        ("a.csv", ("",), "is empty"),
        ("a.csv", ("no table here",), "holds no table"),
        ("a.csv", ("<html>", "</html>"), "is a web page file"),
        ("a.csv", ("time [s];heave [m]", "0,0;1,5"), "1 samples. A motion needs 6"),
        ("a.csv", ("time [s];heave [m]", "1;2;3"), "3 fields where the header has 2"),
        ("a.csv", ("Radius [m];SWL [t]", "10;240", "5;250"), "radii must rise"),
    ],
)
def test_what_is_no_table_of_ours_is_refused_or_shown_with_its_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, lines: tuple[str, ...], says: str
) -> None:
    assert run(["inspect", str(written(tmp_path, name, *lines))]) in (1, 2)
    shown = capsys.readouterr()
    assert says in " ".join((shown.out + shown.err).split())


def test_a_matrix_takes_no_mapping_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "m.csv", *MATRIX)
    assert run(["inspect", str(path), "--save", str(tmp_path / "m.toml")]) == 2
    assert "takes no mapping file" in capsys.readouterr().err
    assert not (tmp_path / "m.toml").exists()


def test_what_would_be_refused_is_shown_with_its_reason(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "t.csv", "time;PT101;PT102", *(f"{0.1 * i};{i};{i}" for i in range(30)))
    assert run(["inspect", str(path)]) == 1
    out = capsys.readouterr().out
    assert "Not read: PT101, PT102" in out
    assert "Refused as it is:" in out
