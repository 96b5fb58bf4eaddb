"""Every number of a crane, payload or lift has a range: the impossible is refused, what was never built is never "ok"."""

import enum
import typing
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import BaseModel

import stillhook
import stillhook.library.catalogue
from stillhook.cli import run
from stillhook.engine.simulate import simulate
from stillhook.errors import LiftError, ScenarioError, SpecError
from stillhook.formats.lift_file import load_lift
from stillhook.library import changed, cranes, load_crane, motor, motors
from stillhook.library.catalogue import payloads, read_payload
from stillhook.library.write import COMPANIONS
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.shapes import Shape
from stillhook.spec.scenario import Scenario
from stillhook.tables.plausible import RANGES, implausible_values, marked, ranges_of
from stillhook.units import KINDS, show
from stillhook.winches.load_path.registry import UNITS

COUNTS = {"Sensors.seed", "PowerLoss.unit"}
"""Whole numbers that choose and do not measure."""
CASE = {"load": "100 t", "s_w": "100 m", "tip": "sine 1 m 10 s", "duration": "20 s", "warm_up": "5 s"}


def inside(annotation: typing.Any) -> typing.Iterator[typing.Any]:
    """A type and all types within it."""
    yield annotation
    for part in typing.get_args(annotation):
        yield from inside(part)


def numbers_of(model: type[BaseModel], seen: set[type[BaseModel]]) -> typing.Iterator[tuple[type[BaseModel], str, int]]:
    """Numeric fields of a model and of all models within it, with how many numbers each row of the field has."""
    if model in seen:
        return
    seen.add(model)
    for name, field in model.model_fields.items():
        if name in COMPANIONS:
            continue
        types = list(inside(field.annotation))
        for each in types:
            if isinstance(each, type) and issubclass(each, BaseModel):
                yield from numbers_of(each, seen)
        count = sum(
            each in (int, float) for each in types if not (isinstance(each, type) and issubclass(each, enum.Enum))
        )
        if count:
            yield model, name, count


UNITS_OF_LIFTS = [module.Unit for module in UNITS.values()]


def every_number() -> list[tuple[type[BaseModel], str, int]]:
    seen: set[type[BaseModel]] = set()
    return [row for model in (Crane, Scenario, Payload, Lowering, *UNITS_OF_LIFTS) for row in numbers_of(model, seen)]


@pytest.mark.slow
def test_every_number_of_crane_scenario_payload_and_lowering_has_a_range():
    """A field without one is found here: add its line to `stillhook/tables/plausible.toml`."""
    for model, name, count in every_number():
        field = f"{model.__name__}.{name}"
        assert field in COUNTS or len(ranges_of(model, name)) == count, field


def test_no_range_is_of_a_field_that_is_gone():
    models = {m for m, _, _ in every_number()}
    for key in RANGES:
        owner, name = key.split(".")
        assert any(name in m.model_fields and owner in (c.__name__ for c in m.__mro__) for m in models), key


@pytest.mark.slow
def test_what_was_built_lies_within_what_is_possible():
    for bounds in [bounds for model, name, _ in every_number() for bounds in ranges_of(model, name)]:
        rises = bounds.least <= bounds.low < bounds.high <= bounds.most
        assert rises or bounds.least == bounds.low <= bounds.high == bounds.most, bounds
        assert bounds.built
        assert bounds.kind in {*KINDS, ""}


@pytest.mark.parametrize(
    ("read", "names"),
    [
        (load_crane, cranes()),
        (motor, motors()),
        (read_payload, payloads()),
        (lambda name: load_lift(name, moving=False).lift, ("anchor-to-3000m", "template-through-the-surface")),
    ],
    ids=("cranes", "motors", "payloads", "lifts"),
)
def test_the_library_is_plausible(read, names):
    for name in names:
        assert implausible_values(read(name)) == (), name


class TestTyposOfAUnit:
    @pytest.mark.parametrize(
        ("changes", "line"),
        [
            ({"active": {"relief": {"p": "1e6 bar"}}}, 'active.relief.p = "1e6 bar": it must be between 1 bar and'),
            ({"active": {"relief": {"p": "380 MPa"}}}, 'active.relief.p = "380 MPa": it must be between 1 bar and'),
            ({"SWL": "1e9 t"}, 'SWL = "1e9 t": it must be between 0.001 t and 50000 t'),
            ({"wire": {"E": "210 Pa"}}, 'wire.E = "210 Pa": it must be between 0.0001 GPa and 1000 GPa'),
            ({"wire": {"d": "96 m"}}, 'wire.d = "96 m": it must be between 0.1 mm and 2000 mm'),
            ({"active": {"pump": {"D": ["355 cc/rev", "1 m^3/rad"]}}}, "active.pump.D = ['355 cc/rev', '1 m^3/rad']:"),
        ],
    )
    def test_what_is_impossible_is_refused_in_one_line_that_names_the_range(self, changes, line):
        with pytest.raises(SpecError) as error:
            changed(load_crane("nov-250t"), changes)
        assert line in str(error.value)
        assert str(error.value).endswith("check its unit.")
        assert "\n" not in str(error.value)

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("changes", "note"),
        [
            ({"wire": {"E": "90 MPa"}}, "wire.E 0.09 GPa is implausible, outside 10 GPa to 250 GPa (fibre ropes to"),
            ({"control": {"t_cycle": "1 s"}}, "control.t_cycle 1 s is implausible, outside 0.0001 s to 0.2 s"),
            ({"control": {"K_p": "0 1/m"}}, "control.K_p 0 1/m is implausible, outside 0.005 1/m to 10 1/m"),
            ({"active": {"relief": {"p": "700 bar"}}}, "active.relief.p 700 bar is implausible, outside 100 bar to"),
        ],
    )
    def test_what_was_never_built_is_a_status_and_a_note_of_every_run(self, changes, note):
        crane = changed(load_crane("nov-250t"), changes)
        assert implausible_values(crane)[0].startswith(note)
        result = simulate(crane, [Scenario(**CASE)], on_failure="mark")
        assert "implausible" in str(result.status.values[0]) or result.status.values[0] == "diverged"
        assert note in str(result.notes.values[0])

    def test_a_plausible_crane_in_a_plausible_case_stays_ok(self):
        assert simulate(load_crane("nov-250t"), [Scenario(**CASE)]).status.values[0] == "ok"

    def test_an_implausible_case_is_no_better_than_an_implausible_crane(self):
        result = simulate(
            load_crane("nov-250t"),
            [Scenario(**CASE, sensors=stillhook.spec.scenario.Sensors(noise_s_tip="2 m"))],
            on_failure="mark",
        )
        assert "implausible" in str(result.status.values[0])
        assert "sensors.noise_s_tip 2 m is implausible" in str(result.notes.values[0])

    @pytest.mark.parametrize("fields", [{"load": "1e9 t"}, {"s_w": "100 km"}])
    def test_an_impossible_case_is_refused(self, fields):
        with pytest.raises(ScenarioError, match="it must be between"):
            Scenario(**(CASE | fields))

    def test_an_impossible_payload_is_refused_with_its_file(self, tmp_path):
        path = tmp_path / "anchor.toml"
        path.write_text('mass = "80 t"\nshape = "disc"\ndiameter = "5 km"\nheight = "0.4 m"\n', encoding="utf-8")
        with pytest.raises(
            LiftError, match=r'^anchor.toml: Disc.diameter = "5 km": it must be between 0.001 m and 1000 m'
        ):
            read_payload(path)

    def test_status_names_it_beside_the_limits_and_leaves_a_lost_run_as_it_is(self):
        note = ("wire.E is implausible",)
        assert [marked(s, note) for s in ("ok", "relief", "diverged")] == [
            "implausible",
            "relief, implausible",
            "diverged",
        ]
        assert [marked(s, ()) for s in ("ok", "relief")] == ["ok", "relief"]


@pytest.mark.slow
@given(st.sampled_from([(m, n) for m, n, _ in every_number() if not issubclass(m, Shape)]), st.data())
@settings(deadline=None, max_examples=200)
def test_marks_themselves_are_inside(field, data):
    """The ends of what was built are no slip: their texts are read back as plausible, in whatever unit they are shown."""
    model, name = field
    for bounds in ranges_of(model, name):
        value = data.draw(st.sampled_from([bounds.low, bounds.high]))
        shown = stillhook.units.parse(show(value, bounds.kind, 12), bounds.kind) if bounds.kind else value
        assert bounds.low - 1e-9 * abs(bounds.low) <= shown <= bounds.high + 1e-9 * abs(bounds.high)


class TestCommands:
    @pytest.fixture
    def soft(self, tmp_path: Path) -> str:
        path = tmp_path / "soft.toml"
        path.write_text('base = "nov-250t"\nname = "soft"\n[wire]\nE = "90 MPa"\n', encoding="utf-8")
        return str(path)

    @pytest.mark.slow
    def test_the_sheet_of_a_crane_says_what_is_implausible(self, soft, capsys):
        assert run(["crane", soft, "--verbose"]) == 0
        assert "wire.E 0.09 GPa is implausible" in capsys.readouterr().out
        assert run(["crane", soft, "--json"]) == 0
        out = capsys.readouterr().out
        assert '"status": "implausible"' in out
        assert "wire.E 0.09 GPa is implausible" in out

    def test_a_comparison_exits_with_1(self, soft, capsys):
        lift = ["--load", "10 t", "--motion", "sine 0.5 m 10 s", "--duration", "40 s"]
        assert run(["compare", soft, *lift, "--controllers", "ns", "--verbose"]) == 1
        out = capsys.readouterr().out
        assert "implausible" in out
        assert "wire.E 0.09 GPa is implausible" in out

    def test_an_envelope_carries_the_note(self, soft, capsys):
        assert run(["envelope", soft, "--loads", "10 t", "--controllers", "ns", "--json"]) == 0
        assert "wire.E 0.09 GPa is implausible" in capsys.readouterr().out

    def test_an_impossible_crane_exits_with_2_in_one_line(self, tmp_path, capsys):
        path = tmp_path / "typo.toml"
        path.write_text('base = "nov-250t"\nname = "typo"\n[active.relief]\np = "380 MPa"\n', encoding="utf-8")
        assert run(["crane", str(path)]) == 2
        line = capsys.readouterr().err
        assert line.startswith('error: typo.toml: active.relief.p = "380 MPa": it must be between 1 bar and 1000 bar')
        assert line.count("\n") == 1


def test_a_plan_remarks_on_its_implausible_crane(tmp_path):
    from importlib.resources import files

    text = (files("stillhook.library") / "data" / "lifts" / "template-to-1500m.toml").read_text(encoding="utf-8")
    crane = next(line.split('"')[1] for line in text.splitlines() if line.startswith("crane"))
    (tmp_path / "soft.toml").write_text(
        f'base = "{crane}"\nname = "soft"\n[control]\nt_cycle = "0.5 s"\n', encoding="utf-8"
    )
    path = tmp_path / "plan.toml"
    path.write_text(text.replace(f'crane = "{crane}"', 'crane = "soft.toml"'), encoding="utf-8")
    assert any("crane.control.t_cycle 0.5 s is implausible" in note for note in stillhook.load_plan(path).notes)


class TestVessel:
    def test_a_table_over_frequencies_that_no_wave_has_is_refused(self):
        from dataclasses import replace

        from stillhook.sea.vessel.floating_body import long_wave_test, remarks, wrong_line

        ship = stillhook.read_vessel("supply-vessel-82m")
        fast, faster = (replace(ship, omega=ship.omega * factor) for factor in (10.0, 100.0))
        assert "are not between 0.001 and 100 rad/s, those of waves. Check their unit." in str(
            wrong_line(faster, long_wave_test(faster))
        )
        assert wrong_line(fast, long_wave_test(fast)) is None
        assert any(
            "rad/s are implausible, outside 0.02 to 10 rad/s" in line for line in remarks(fast, long_wave_test(fast))
        )

    def test_the_library_has_plausible_ones(self):
        for name in stillhook.library.catalogue.vessels():
            assert not any("implausible" in note for note in stillhook.read_vessel(name).notes), name
