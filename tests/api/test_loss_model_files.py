"""The table of a loss model in a crane file, and the table of a map: each fault is one line that says what to do."""

import pytest

from stillhook import load_crane
from stillhook.errors import SpecError, UnitError
from stillhook.library import crane_from_toml
from stillhook.library.toml.loss_map import map_csv, read_loss_map
from stillhook.library.write import crane_toml, sheet

HEAD = "D_m [cm^3/rev],n [rev/min],dp [bar],T_f [N m]"
CELLS = ["100,400,100,5", "100,400,200,6", "100,800,100,7", "100,800,200,8"]


def crane_of(folder, table, rows=(HEAD, *CELLS)):
    (folder / "m.csv").write_text("\n".join(rows) + "\n")
    (folder / "my.toml").write_text(f'base = "nov-150t"\n[active.motor.loss_model]\n{table}\n')
    return load_crane(folder / "my.toml")


@pytest.mark.parametrize(
    ("table", "part"),
    [
        ('law = "wilson"', 'law = "wilson": this model does not vary with displacement. Choose thoma, pacey'),
        ('law = "mj7"', "it must be 'thoma', 'pacey', 'huhtala-28'"),
        ("C = [1.0]", "active.motor.loss_model.law: missing"),
        ('law = "mj6"', 'C: "mj6" takes 6 numbers, C_e, C_f, C_g, C_m, C_i, C_k; here are 0.'),
        ('law = "mj6"\nC = [1.0, 2.0]', "here are 2."),
        ('law = "mj3"\nC = [1.0, 2.0, -3.0, 1.0]', "a loss never drives the shaft. Give 0 or more."),
        ('law = "mj3"\nC = [1.0, 2.0, "x", 1.0]', 'active.motor.loss_model.C[2] = "x": it must be a number'),
        ('law = "mj4"\nC = [1.0]', 'C: "mj4" takes none: its numbers are those of loss; here are 1.'),
        ('law = "mj3"\nC = [1.0, 2.0, 3.0, 1.0]\nmap = "m.csv"', 'choose law = "map", or remove the map.'),
        ('law = "mj3"\nC = [1.0, 2.0, 3.0, 1.0]\nscale = -1.0', "scale = -1.0: it must be greater than or equal to 0"),
        ('law = "map"', 'law = "map": it needs map, the name of a CSV file.'),
        ('law = "map"\nmap = 3', "give the path of a CSV file, or a map of the library."),
        ('law = "map"\nmap = "motor-mep"', 'no map of the library, which has motor-map; did you mean "motor-map"?'),
        ('law = "map"\nmap = "none.csv"', 'none.csv": no such file. Check the path.'),
        ('law = "map"\nmap = "m.csv"\nT_f = ["1 N m"]', 'law = "map": it needs map'),
    ],
)
def test_a_fault_in_the_table_is_one_line(table, part, tmp_path):
    with pytest.raises(SpecError) as problem:
        crane_of(tmp_path, table)
    line = str(problem.value)
    assert part in line
    assert line.startswith("my.toml: active.motor.loss_model")
    assert "\n" not in line


def test_a_wrong_unit_is_named(tmp_path):
    with pytest.raises(UnitError, match='n_low = "400 bar": unit "bar" is not one of rad/s'):
        crane_of(tmp_path, 'law = "mj3"\nC = [1.0, 2.0, 3.0, 1.0]\nn_low = "400 bar"')


@pytest.mark.parametrize(
    ("rows", "part"),
    [
        ([], "empty. Give a row for every combination of levels."),
        (
            [HEAD, *CELLS[:3]],
            "3 of 4 combinations; none for 100 cm^3/rev, 800 rev/min, 200 bar. Give every combination",
        ),
        ([HEAD, *CELLS, CELLS[0]], "line 6: this combination is given twice. Leave one of them."),
        ([HEAD, "100,400,100,x"], 'line 2: T_f = "x": it must be a number.'),
        ([HEAD, "100,400,100,nan"], "line 2: T_f is not a finite number. Give one."),
        ([HEAD, "100,400,100"], "line 2: T_f = nothing: it must be a number."),
        ([HEAD, "100,400,100,-5"], "line 2: a negative number, or no displacement. Leave no such row."),
        ([HEAD.replace("N m", "bar"), *CELLS], 'unit "bar" is not one of N m'),
        (["D_m [cm^3/rev],n [rev/min],dp [bar]", "100,400,100"], "no column T_f or eta_hm."),
        ([HEAD.replace("dp", "pressure"), *CELLS], "no column dp."),
    ],
)
def test_a_fault_in_the_table_of_a_map_is_one_line(rows, part, tmp_path):
    with pytest.raises(SpecError) as problem:
        crane_of(tmp_path, 'law = "map"\nmap = "m.csv"', rows)
    line = str(problem.value)
    assert part in line
    assert line.startswith('my.toml: active.motor.loss_model.map = "m.csv": ')
    assert "\n" not in line


def test_a_crane_with_a_map_is_written_complete_and_needs_its_table_no_more(tmp_path):
    crane = crane_of(tmp_path, 'law = "map"\nmap = "m.csv"')
    again = crane_from_toml(crane_toml(crane), "again")
    assert again.active.motor == crane.active.motor
    assert crane.active.motor.loss_model.T_f == (5.0, 6.0, 7.0, 8.0)
    assert crane.active.motor.n_loss_max == pytest.approx(800 * 3.14159265 / 30)
    rows = {row.field: row for section in sheet(crane) for row in section.rows}
    assert rows["active.motor.loss_model.dp_m"].source == "map m.csv"


def test_a_file_on_a_crane_with_a_model_replaces_the_model_as_one(tmp_path):
    crane_of(tmp_path, 'law = "map"\nmap = "m.csv"')
    (tmp_path / "next.toml").write_text(
        'base = "my.toml"\n[active.motor.loss_model]\nlaw = "mj3"\nC = [1.0, 2.0, 3.0, 1.0]\n'
    )
    model = load_crane(tmp_path / "next.toml").active.motor.loss_model
    assert (model.law, model.map, model.T_f) == ("mj3", None, None)


def test_the_table_of_a_map_reads_back_as_it_was_written(tmp_path):
    (tmp_path / "m.csv").write_text("\n".join([HEAD, *CELLS]))
    table = read_loss_map(tmp_path / "m.csv", "map")
    (tmp_path / "n.csv").write_text(map_csv(table, "again"))
    again = read_loss_map(tmp_path / "n.csv", "map")
    assert {name: pytest.approx(values) for name, values in table.items()} == again
