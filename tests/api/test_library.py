"""The library: every number has a source and a kind, tables are tables, and the sheet shows all of it."""

import json
import math
import tomllib
from types import SimpleNamespace
from typing import Any

import pytest

from stillhook import library
from stillhook.cli.library import show_crane
from stillhook.engine.pack.winch import drum_record, inertia_record
from stillhook.errors import SpecError
from stillhook.library import LeakTable, changed, cranes, frictions, leak_table, leak_tables, load_crane, motor, motors
from stillhook.library.toml.kinds import LIBRARY
from stillhook.library.toml.tree import tree
from stillhook.library.write import items, sheet, sheet_json
from stillhook.physics.hydraulics.pump import LEAK_KNOTS, PumpLeak, pump_leakage
from stillhook.physics.load_path.drum import shaft_inertia
from stillhook.spec.crane import Crane, Plant, Source, SourceKind, effective_inertia
from stillhook.units import in_display, parse

SHELVES = {"cranes": cranes(), "motors": motors(), "friction": frictions(), "pumps": leak_tables()}
LIBRARY_FILES = [(shelf, name) for shelf, names in SHELVES.items() for name in names]
LABELS = {"name", "title"}
LEAK_ROUNDING = 1e-5  # relative; C_1 and C_2 are written with six digits
INERTIA_ROUNDING = 1e-4  # relative; J_drum is written with five digits

leaf_keys = {"value", "kind", "source"}


def leaves(table: dict[str, Any], path: str = "") -> list[tuple[str, Any]]:
    """Dotted path and content of everything in a file that is not a table of fields."""
    out: list[tuple[str, Any]] = []
    for key, item in table.items():
        place = f"{path}.{key}" if path else key
        out += leaves(item, place) if isinstance(item, dict) and "value" not in item else [(place, item)]
    return out


@pytest.mark.parametrize(("shelf", "name"), LIBRARY_FILES)
def test_every_number_of_a_library_file_has_a_kind_and_a_source(shelf: str, name: str) -> None:
    (file,) = (LIBRARY / shelf).rglob(f"{name}.toml")
    text = file.read_text(encoding="utf-8")
    for path, leaf in leaves(tomllib.loads(text)):
        if path in LABELS:
            assert isinstance(leaf, str), path
            continue
        assert isinstance(leaf, dict), f"{name}.toml: {path} has no source"
        assert set(leaf) == leaf_keys, f"{name}.toml: {path} has no kind or no source"
        assert leaf["kind"] in {kind.value for kind in SourceKind} - {"user"}, path
        assert len(leaf["source"]) > 4, path


def test_a_library_file_with_an_unsourced_number_is_refused() -> None:
    """The test above would find it, and so does the reader: plain values are for users' own files."""
    plain = {"active": {"line": {"V": "80 L"}}}
    assert tree(plain, "mine.toml", user=True)
    with pytest.raises(
        SpecError, match=r"nov-250t\.toml: active\.line\.V: a number of the library needs its kind and source"
    ):
        tree(plain, "nov-250t.toml", user=False)


CLOSED = [name for name in cranes() if load_crane(name).circuits]
"""Cranes with a closed circuit."""


@pytest.mark.parametrize("name", cranes())
def test_every_field_of_a_loaded_crane_has_its_source(name: str) -> None:
    crane = load_crane(name)
    held = {item.path for item in items(crane)} - LABELS
    assert held == set(crane.sources)
    assert all(source.kind is not SourceKind.USER for source in crane.sources.values())


@pytest.mark.parametrize("name", cranes())
def test_assumed_numbers_say_so_in_their_source(name: str) -> None:
    """Nothing assumed cites a table as if it were printed there, without saying what was made of it."""
    for path, source in load_crane(name).sources.items():
        if source.kind is SourceKind.PUBLISHED:
            assert "unpublished" not in source.text, path
            assert any(word in source.text for word in ("paper", "section", "table", "fig")), path


@pytest.mark.parametrize("name", CLOSED)
def test_leaks_of_pumps_and_motors_add_up_to_the_total(name: str) -> None:
    """At full stroke and 1800 rev/min, active motors at 1000 rev/min, the parts give the total of the linear analysis."""
    crane = load_crane(name)
    pump, motors_ = crane.active.pump, crane.active.motor
    table = leak_table(pump.leak)
    (n_1, n_2), (C_1, C_2) = table.omega, (row[-1] for row in table.C)
    C_pump = (C_1 + (C_2 - C_1) * (pump.omega_p - n_1) / (n_2 - n_1)) * pump.D_total / table.D_ref
    n_m = parse("1000 rev/min", "rotation")
    total = C_pump + motors_.count * (motors_.C_1 + motors_.C_2 * n_m)
    assert total == pytest.approx(crane.active.C_leak, rel=LEAK_ROUNDING)
    assert motors_.C_2 * n_m / (motors_.C_1 + motors_.C_2 * n_m) == pytest.approx(0.2, rel=LEAK_ROUNDING)


@pytest.mark.parametrize("name", cranes())
def test_the_parts_of_the_inertia_add_up_as_the_plant_adds_them(name: str) -> None:
    crane = load_crane(name)
    drum = drum_record(crane)
    plant = shaft_inertia(drum.L_full, float(crane.drum.layers), drum, inertia_record(crane))
    assert effective_inertia(crane) == pytest.approx(plant, rel=1e-12)
    assert plant == pytest.approx(crane.inertia.J_m_eff, rel=INERTIA_ROUNDING)


@pytest.mark.parametrize("name", CLOSED)
def test_the_motors_reach_full_wire_speed_within_their_limit(name: str) -> None:
    """Full pump flow through the motors at alpha_min is the fastest that the winch can turn."""
    active = load_crane(name).active
    n_m = active.pump.D_total * active.pump.omega_p / (active.motor.D_total * active.motor.alpha_min)
    assert n_m < active.motor.n_max


@pytest.mark.parametrize("name", CLOSED)
def test_the_winch_holds_its_safe_working_load(name: str) -> None:
    """On the full drum with all motors at full displacement, below the relief valves, hook included."""
    crane = load_crane(name)
    torque = (crane.SWL + crane.hook_mass) * 9.81 * crane.drum.d_max / 2 / crane.i_hD
    circuit = crane.passive or crane.active
    low = crane.passive.p_lp if crane.passive else crane.active.boost.p
    high = crane.passive.accumulator.gas.p_0 if crane.passive else crane.active.relief.p
    assert torque / circuit.motor.D_total < high - low


def test_names_on_the_shelves() -> None:
    assert cranes() == (
        "deep-250t",
        "nov-100t-cylinder",
        "nov-100t-electric",
        "nov-100t-pure-active",
        "nov-150t",
        "nov-165t",
        "nov-165t-12-motors",
        "nov-250t",
        "nov-250t-digital",
        "nov-250t-f1799",
        "nov-250t-secondary",
        "nov-50t-pure-active",
        "nov-58t-pure-active",
        "nov-70t-pure-active",
        "utility-20t-open-circuit",
    )
    assert motors() == ("A6VM170", "A6VM215", "A6VM215-crane-2-second-loop", "A6VM280")
    assert frictions() == ("L4593", "crane-1", "crane-2", "crane-2-second-loop", "nov-250t")
    assert leak_tables() == ("A4VSG355",)


@pytest.mark.parametrize(
    ("read", "says"),
    [
        (lambda: motor("A6VM300"), 'motor = "A6VM300": not in the library, which has A6VM170'),
        (
            lambda: leak_table("A4VSG"),
            'leak table = "A4VSG": not in the library, which has A4VSG355; did you mean "A4VSG355"?',
        ),
        (lambda: library.system_friction("crane"), 'system friction = "crane": not in the library, which has L4593'),
        (lambda: motor("../cranes/nov-250t"), 'motor = "../cranes/nov-250t": not in the library'),
        (lambda: motor(""), 'motor = "": not in the library'),
    ],
)
def test_unknown_names_list_the_known_ones(read: Any, says: str) -> None:
    with pytest.raises(SpecError) as error:
        read()
    assert says in str(error.value)


@pytest.mark.parametrize("name", motors())
def test_every_motor_can_stand_in_for_the_library_cranes(name: str) -> None:
    """Its numbers pass the same checks as a crane's own; inertia is made to fit."""
    base = load_crane("nov-250t")
    J = base.inertia.J_m_eff + 5 * (motor(name).J - base.active.motor.J)
    changes = {"active": {"motor": {"type": name}}, "inertia": {"J_m_eff": f"{J!r} kg m^2"}}
    assert changed(base, changes).active.motor.D_max == motor(name).D_max


def test_the_leak_table_is_read_at_its_own_points() -> None:
    """The plant's interpolation gives each row back at the displacements of the table, scaled to any pump size."""
    table = leak_table("A4VSG355")
    assert isinstance(table, LeakTable)
    assert [D / table.D_ref for D in table.D] == pytest.approx(LEAK_KNOTS)
    for row in table.C:
        assert [pump_leakage(knot, PumpLeak(*row)) for knot in LEAK_KNOTS] == pytest.approx(row)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"D": ["2 cm^3/rev", "1 cm^3/rev"]}, "D must rise from entry to entry."),
        ({"omega": ["1 rev/min", "1 rev/min"]}, "omega must rise from entry to entry."),
        ({"C": [["1 L/min/bar"]]}, "C needs 2 rows of 2 values."),
    ],
)
def test_a_leak_table_must_be_a_table(change: dict[str, Any], says: str) -> None:
    row = ["1 L/min/bar", "2 L/min/bar"]
    good = {
        "D_ref": "2 cm^3/rev",
        "D": ["1 cm^3/rev", "2 cm^3/rev"],
        "omega": ["1 rev/min", "2 rev/min"],
        "C": [row, row],
    }
    assert LeakTable.model_validate(good).C[1][1] == pytest.approx(parse("2 L/min/bar", "leakage"))
    with pytest.raises(ValueError, match=says):
        LeakTable.model_validate(good | change)


@pytest.mark.parametrize("name", cranes())
def test_the_sheet_shows_every_field_once_with_its_source(name: str) -> None:
    crane = load_crane(name)
    sections = sheet(crane)
    rows = [row for section in sections if section.title != "derived" for row in section.rows]
    assert len(rows) == len({row.field for row in rows})
    assert {row.field for row in rows} == set(crane.sources)
    for row in rows:
        assert crane.sources[row.field] == Source(text=row.source, kind=SourceKind(row.kind)), row.field
        assert row.meaning != row.field.rpartition(".")[2], f"{row.field} has no description"


def test_the_sheet_prints_in_the_units_of_the_trade() -> None:
    rows = {row.field: row.value for section in sheet(load_crane("nov-250t")) for row in section.rows}
    assert rows["SWL"] == "250 t"
    assert rows["active.motor.D_total"] == "1075 cm^3/rev"
    assert rows["active.pump.D"] == "355 cm^3/rev + 500 cm^3/rev + 500 cm^3/rev"
    assert rows["active.line.bulk_modulus"] == "17500 bar"
    assert rows["wire.d"] == "96 mm"
    assert rows["friction.system.Y_4"] == "229 rev/min"
    assert rows["passive.accumulator.gas.T_0"] == "20 degC"
    assert rows["v_w"] == "72.47 m/min"
    assert rows["gear_ratios"] == "35.4 x 14.17"


def test_the_sheet_of_a_pure_active_crane_has_no_passive_rows() -> None:
    crane = load_crane("nov-100t-pure-active")
    assert crane.plant is Plant.PURE_ACTIVE
    assert not [row for section in sheet(crane) for row in section.rows if row.field.startswith("passive")]


def test_the_json_sheet_holds_si_values_with_units() -> None:
    crane = load_crane("nov-250t")
    out = json.loads(json.dumps(sheet_json(crane)))
    assert (out["name"], out["title"]) == (crane.name, crane.title)
    V = out["fields"]["active.line.V"]
    assert V == {"value": 0.08, "unit": "m^3", "kind": "published", "source": "paper E table 2"}
    assert out["fields"]["control.u_thr"]["unit"] is None
    assert out["fields"]["active.motor.count"]["value"] == 5
    assert len(out["fields"]["active.pump.D"]["value"]) == 3
    assert set(out["fields"]) == set(crane.sources)


def test_a_crane_built_without_sources_says_that_they_are_not_stated() -> None:
    bare = load_crane("nov-250t").model_copy(update={"sources": {}})
    row = sheet(bare)[0].rows[0]
    assert (row.kind, row.source) == ("user", "not stated")


def test_the_optional_gains_appear_on_the_sheet_once_given() -> None:
    def gains(crane: Crane) -> list[str]:
        return [row.value for s in sheet(crane) for row in s.rows if row.field == "control.K_1"]

    crane = load_crane("nov-250t")
    assert gains(crane) == []
    assert gains(changed(crane, {"control": {"K_1": "0.68 s/m"}})) == ["0.68 s/m"]


def test_public_names_exist_and_are_documented() -> None:
    for name in library.__all__:
        assert getattr(library, name).__doc__, name


def test_displayed_speed_is_the_published_one() -> None:
    """v_w on the sheet follows the published convention: outer diameter, no leakage (72.47127 m/min)."""
    crane = load_crane("nov-250t")
    active = crane.active
    v_w = active.pump.D_total * active.pump.omega_p / active.motor.D_total / crane.i_hD * crane.drum.d_max / 2
    assert in_display(v_w, "speed") == pytest.approx(72.47127, abs=5e-6)
    assert math.isclose(crane.i_hD, math.prod(crane.gear_ratios), rel_tol=1e-3)


@pytest.mark.parametrize(("against", "level"), [((), 2), (("the crane was changed",), 1)])
def test_a_sheet_shows_the_levels_of_a_certificate_that_holds_and_of_no_other(
    monkeypatch, capsys, against, level
) -> None:
    crane = load_crane("nov-250t")
    certified = SimpleNamespace(sub_models={"friction": 2}, short="0" * 12)
    monkeypatch.setattr("stillhook.library.load_crane", lambda name: crane.model_copy(update={"certified": certified}))
    monkeypatch.setattr("stillhook.engine.certificate.objections", lambda crane: against)
    monkeypatch.setattr("stillhook.engine.certificate.twin_line", lambda crane: "a twin")
    monkeypatch.setattr("stillhook.cli.library.twin_lines", lambda crane: ["a twin"])
    show_crane("nov-250t", json=True)
    levels = json.loads(capsys.readouterr().out)["sub_models"]
    assert levels["friction"] == level
    assert {value for name, value in levels.items() if name != "friction"} == {1}
