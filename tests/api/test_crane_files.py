"""A crane file of one's own: what it may leave out, what it may change, and what each mistake says on its one line."""

import copy
import math
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stillhook.errors import SpecError, StillhookError, UnitError
from stillhook.library import changed, crane_toml, cranes, load_crane, motor, system_friction
from stillhook.spec.crane import Crane, Plant, SourceKind

BASE = 'base = "nov-250t"\n'


def written(folder: Path, text: str | bytes, name: str = "mine.toml") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def refusal(path: Any) -> str:
    """The one line that a bad file is refused with."""
    with pytest.raises((SpecError, UnitError)) as error:
        load_crane(path)
    message = str(error.value)
    assert len(message.splitlines()) == 1
    return message


def test_a_file_on_a_base_changes_only_what_it_says(tmp_path: Path) -> None:
    path = written(tmp_path, BASE + '[active.line]\nV = "100 L"\n[control]\nK_1 = "0.68 s/m"\n')
    mine, base = load_crane(path), load_crane("nov-250t")
    assert pytest.approx(0.1) == mine.active.line.V
    assert mine.control.K_1 == 0.68
    assert mine.name == "mine"
    assert mine.active.line.bulk_modulus == base.active.line.bulk_modulus
    assert mine.passive == base.passive


def test_a_users_plain_value_is_marked_as_the_users(tmp_path: Path) -> None:
    mine = load_crane(written(tmp_path, BASE + '[active.line]\nV = "100 L"\n'))
    assert mine.sources["active.line.V"].kind is SourceKind.USER
    assert mine.sources["active.line.V"].text == "given in mine.toml"
    assert mine.sources["active.boost.p"].kind is SourceKind.PUBLISHED


def test_a_user_may_state_kind_and_source(tmp_path: Path) -> None:
    leaf = '{ value = "100 L", kind = "datasheet", source = "drawing 17" }'
    mine = load_crane(written(tmp_path, BASE + f"[active.line]\nV = {leaf}\n"))
    assert (mine.sources["active.line.V"].kind, mine.sources["active.line.V"].text) == ("datasheet", "drawing 17")


def test_a_base_may_be_another_relative_file_this_one(tmp_path: Path) -> None:
    written(tmp_path, BASE + 'SWL = "200 t"\n', "below.toml")
    mine = load_crane(str(written(tmp_path, 'base = "below.toml"\nhook_mass = "4 t"\n')))
    assert (mine.SWL, mine.hook_mass, mine.name) == (200e3, 4e3, "mine")


@pytest.mark.parametrize("name", cranes())
def test_a_crane_written_to_a_file_reads_back_the_same_with_its_sources(name: str, tmp_path: Path) -> None:
    crane = load_crane(name)
    again = load_crane(written(tmp_path, crane_toml(crane)))
    assert again == crane
    assert again.sources == crane.sources


def test_texts_with_quotes_and_signs_of_every_language_survive_the_round_trip(tmp_path: Path) -> None:
    source = 'a "quoted" \\ path\té³\n吊机'
    leaf = {"value": "100 L", "kind": "assumed", "source": source}
    crane = changed(load_crane("nov-250t"), {"title": 'x "y" \\', "active": {"line": {"V": leaf}}})
    again = load_crane(written(tmp_path, crane_toml(crane)))
    assert again == crane
    assert again.sources["active.line.V"].text == source


def test_naming_another_motor_takes_all_its_numbers(tmp_path: Path) -> None:
    """The leak of the base's motors was made for them; it does not stay behind."""
    text = BASE + '[passive.motor]\ntype = "A6VM280"\n[inertia]\nJ_m_eff = "4.4 kg m^2"\n'
    mine, library = load_crane(written(tmp_path, text)), motor("A6VM280")
    assert mine.passive is not None
    for field in type(library).model_fields:
        assert getattr(mine.passive.motor, field) == getattr(library, field), field
    assert mine.active.motor.D_max == motor("A6VM215").D_max


def test_naming_another_friction_takes_all_its_numbers_and_own_ones_win(tmp_path: Path) -> None:
    text = BASE + '[friction]\nlibrary = "crane-1"\n[friction.system]\nY_3 = "5 N m"\n'
    system = load_crane(written(tmp_path, text)).friction.system
    assert system.Y_3 == 5.0
    assert system.Y_1 == system_friction("crane-1").Y_1


def test_a_file_may_turn_its_base_into_a_pure_active_winch(tmp_path: Path) -> None:
    text = BASE + 'plant = "pure-active"\n[inertia]\nJ_m_eff = "3.524 kg m^2"\n'
    mine = load_crane(written(tmp_path, text))
    assert mine.plant is Plant.PURE_ACTIVE
    assert mine.passive is None
    assert not [field for field in mine.sources if field.startswith("passive")]


def test_gear_ratios_are_read_as_the_data_sheet_prints_them(tmp_path: Path) -> None:
    assert (
        load_crane(written(tmp_path, BASE + 'gear_ratios = ["35.4 : 1", "i = 14.17"]\ni_hD = "501.618:1"\n')).i_hD
        == 501.618
    )


def test_a_complete_file_needs_no_base_and_derives_the_gear_ratio(tmp_path: Path) -> None:
    text = "\n".join(line for line in crane_toml(load_crane("nov-150t")).splitlines() if not line.startswith("i_hD"))
    mine = load_crane(written(tmp_path, text))
    assert mine.i_hD == pytest.approx(31.76 * 14.17)
    assert mine.sources["i_hD"].kind is SourceKind.DERIVED


def test_a_byte_order_mark_and_windows_line_ends_are_read(tmp_path: Path) -> None:
    path = written(tmp_path, b"\xef\xbb\xbf" + (BASE + 'SWL = "200 t"\n').replace("\n", "\r\n").encode())
    assert load_crane(path).SWL == 200e3


def test_a_changed_crane_leaves_the_first_one_as_it_was() -> None:
    base = load_crane("nov-250t")
    before = copy.deepcopy(base)
    new = changed(base, {"wire": {"L_0": "80 m"}, "friction": {"system": {"Y_1": 1e-5}}})
    assert (new.wire.L_0, new.friction.system.Y_1) == (80.0, 1e-5)
    assert base == before
    assert new.sources["wire.L_0"].text == "given in changes to nov-250t"


def test_a_crane_cannot_be_changed_in_place() -> None:
    with pytest.raises(ValueError, match="frozen"):
        load_crane("nov-250t").drum.layers = 3  # type: ignore[misc]


# Text after the base line, and what the refusal says.
MISTAKES = [
    ('[active.motor]\nD_max = "215 cm^3"', 'D_max = "215 cm^3": unit "cm^3" is not one of m^3/rad, cm^3/rev, cc/rev.'),
    ("[active.line]\nV = 80", 'active.line.V = 80: a bare number; write it as text with its unit, "80 L"'),
    ('[active.line]\nV = "-80 L"', 'active.line.V = "-80 L": it must be greater than 0.'),
    ("i_hD = 1e300", "i_hD = 1e+300: it must be less than or equal to 1000000."),
    ("[active.motor]\nalpha_min = 1.5", "active.motor.alpha_min = 1.5: it must be less than or equal to 1."),
    ("[control]\nu_thr = nan", "control.u_thr = nan: it must be a finite number."),
    ('[control]\nu_thr = "0.6"', 'control.u_thr = "0.6": it must be a number (feedforward at which SSC starts to'),
    ("[control]\nu_thr = true", "control.u_thr = true: it must be a number (feedforward at which"),
    ("[control]\nalpha_hs = 0.9", "active.motor.alpha_min 0.6, control.alpha_hs 0.9 and control.alpha_ns 0.8 must not"),
    ("[active.motor]\ncount = 0", "active.motor.count = 0: it must be greater than or equal to 1."),
    ("[active.motor]\ncount = 5.0", "active.motor.count = 5.0: it must be a whole number (number of motors)."),
    ("[active.motor]\nalpha_min = 0", "active: motor.alpha_min = 0 leaves the winch without torque"),
    ('[active.motor]\nD_mx = "215 cm^3/rev"', 'active.motor.D_mx: unknown field; did you mean "D_max"? Allowed:'),
    ('[activ.motor]\nD_max = "215 cm^3/rev"', 'activ: unknown field; did you mean "active"?'),
    ("zzz = 1", "zzz: unknown field. Allowed: name, title, plant"),
    ("[active.motor]\ntype = 5", "active.motor.type = 5: it must be a text (motor type in the library)."),
    ('[active.motor]\ntype = "A6VM-215"', 'active.motor.type = "A6VM-215": not in the library, which has A6VM170,'),
    ('[active.pump]\nleak = "A4VSG"', 'active.pump.leak = "A4VSG": not in the library, which has A4VSG355; did'),
    ('[friction]\nlibrary = "crane-3"', 'friction.library = "crane-3": not in the library, which has L4593, crane-1'),
    ('[active.motor]\nvariant = "open"', "active.motor.variant = \"open\": it must be 'closed-loop', 'open-"),
    ('[drum]\npacking = "hexagonal"', "drum.packing = \"hexagonal\": it must be 'square'."),
    ('plant = "passive"', "plant = \"passive\": it must be 'active-passive', 'cylinder', 'digital', 'electric',"),
    ("active = 5", "active = 5: must be a table, with C_leak, leak, motor, pump, line"),
    ("SWL = { t = 5 }", 'SWL: must be one value, not a table. Write SWL = "250 t".'),
    ("SWL = 1979-05-27", "SWL = datetime.date(1979, 5, 27): neither a number, a text nor a list of them."),
    ("gear_ratios = [[35.4]]", "gear_ratios[0] = [35.4]: a list holds numbers or texts only."),
    ("gear_ratios = []", "gear_ratios = []: "),
    ('gear_ratios = ["1:35.4", 14.17]', 'gear_ratios[0] = "1:35.4": not a gear ratio; write the turns of the motor'),
    ("gear_ratios = [35.4, -1.0]", "gear_ratios[1] = -1.0: it must be greater than 0."),
    ("gear_ratios = [35.4, 14.2]", "i_hD 501.6 is not the product 502.68 of gear_ratios. Set i_hD = 502.68."),
    ('[active.pump]\nD = ["355 cm^3/rev", 500]', "active.pump.D[1] = 500: a bare number"),
    ('[active.pump]\nD = "1355 cm^3/rev"', 'active.pump.D = "1355 cm^3/rev": it must be a list (full displacement of'),
    ("[drum]\nturns = 20", "drum.turns 20 x wire.d 96 mm = 1.92 m is more than drum.width 1.9 m."),
    ("[drum]\nlayers = 11", "drum.d_max 5.1 m is not drum.d + 2 x 11 layers x wire.d = 4.912 m."),
    ('[inertia]\nJ_drum = "1000 kg m^2"', "inertia.J_m_eff 4.1 kg m^2 is not the sum 3.526 kg m^2 of motors, J_gear,"),
    ('[active.motor]\nn_max = "100 rev/min"', "active.motor: n_max 100 rev/min is below n_max_full 2900 rev/min"),
    ('[active.relief]\np = "27 bar"', "active: relief.p 27 bar is not above boost.p + flushing.dp_open 27 bar."),
    ('[passive]\np_lp = "300 bar"', "passive: p_lp 300 bar, accumulator.gas.p_0 280 bar and relief.p 350 bar"),
    ('plant = "pure-active"\n[passive]\np_lp = "10 bar"', 'plant "pure-active" has no table [passive]. Change plant,'),
    ('plant = "electric"\n[electric.motor]\ncount = 2', "electric.motor.J: missing (inertia of one; in kg m^2, t"),
    ('SWL = { value = "5 t", knd = "assumed" }', "SWL.knd: a value has only value, kind and source; did you"),
    ('SWL = { value = "5 t", kind = "guess", source = "x" }', 'SWL.kind = "guess": not one of published, da'),
    ('SWL = { value = "5 t", kind = "assumed" }', "SWL.source = nothing: must state the source of the number"),
    ('SWL = { value = "5 t", source = "x" }', "SWL.kind = nothing: not one of published, datasheet, fitted,"),
    ('SWL = { value = "5 t", kind = "assumed", source = " " }', 'SWL.source = " ": must state the source'),
    ("SWL = { value = { t = 5 } }", "SWL = {'t': 5}: neither a number, a text nor a list of them."),
    ('[sources]\nSWL = "x"', "sources: unknown field; write the source next to its value."),
    ('name = ""', 'name = "": it must be a text'),
    ("SWL = 1\nSWL = 2", "not valid TOML: Cannot overwrite a value (at line 3, column 8). Correct that line."),
    ("SWL = 5 t", "not valid TOML: Expected newline or end of document after a statement (at line 2, col"),
    (f"[control]\nu_thr = {'9' * 400}", "mine.toml: control.u_thr = 9"),
    (f"gear_ratios = [{'9' * 400}]", "mine.toml: gear_ratios[0] = 9"),
    (f"[active.motor]\ncount = {'9' * 400}", "mine.toml: active.motor.count = 9"),
    (f"[active.motor]\ncount = {'9' * 5000}", "mine.toml: not valid TOML: "),
    (f"x = {'[' * 100_000}", "mine.toml: not valid TOML: "),
    ('"a\\u001bb" = 1', 'mine.toml: not valid TOML: "a\\x1bb" has a sign that is not for print, U+001B.'),
    (f"{'k' * 101} = 1", "mine.toml: top: key "),
]


@pytest.mark.slow
@pytest.mark.parametrize(("text", "says"), MISTAKES, ids=[text.replace("\n", " ")[:50] for text, _ in MISTAKES])
def test_each_mistake_is_refused_with_what_to_do(text: str, says: str, tmp_path: Path) -> None:
    message = refusal(written(tmp_path, BASE + text + "\n"))
    assert says in message
    assert message.startswith("mine.toml: ")
    assert len(message) < 1000
    assert message.isprintable()


def test_a_wrong_unit_is_a_unit_error(tmp_path: Path) -> None:
    with pytest.raises(UnitError):
        load_crane(written(tmp_path, BASE + '[active.line]\nV = "80 kg"\n'))


def test_several_mistakes_are_counted_and_the_misspelling_comes_first(tmp_path: Path) -> None:
    text = crane_toml(load_crane("nov-100t-pure-active")).replace("D_max", "D_mx").replace('"80 L"', '"80 kg"')
    message = refusal(written(tmp_path, text))
    assert message.startswith('mine.toml: active.motor.D_mx: unknown field; did you mean "D_max"?')
    assert message.endswith("(and 1 more)")


def test_a_missing_field_says_what_it_is_and_its_units(tmp_path: Path) -> None:
    lines = crane_toml(load_crane("nov-150t")).splitlines()
    text = "\n".join(line for line in lines if not line.startswith("layers"))
    assert "mine.toml: drum.layers: missing (layers of wire on the full drum). Add it" in refusal(
        written(tmp_path, text)
    )
    text = "\n".join(line for line in lines if not line.startswith("hook_mass"))
    assert "mine.toml: hook_mass: missing (hook block; in kg, t, te). Add it" in refusal(written(tmp_path, text))


def test_a_pure_active_crane_with_a_passive_circuit_is_refused(tmp_path: Path) -> None:
    text = crane_toml(load_crane("nov-250t")).replace('"active-passive"', '"pure-active"')
    assert 'plant "pure-active" has no table [passive]. Change plant, or remove' in refusal(written(tmp_path, text))
    text = 'base = "nov-100t-pure-active"\nplant = "active-passive"\n'
    assert 'plant "active-passive" needs table [passive]. Change plant, or add' in refusal(written(tmp_path, text))


def test_files_that_are_no_crane_files_say_why(tmp_path: Path) -> None:
    assert "mine.toml: empty. Start it with base" in refusal(written(tmp_path, ""))
    assert "mine.toml: empty. Start it with base" in refusal(written(tmp_path, " \n\n"))
    assert "mine.toml: not UTF-8 text (byte 0). Save it as UTF-8." in refusal(written(tmp_path, b"\xff\xfe[\x00a\x00"))
    assert "mine.toml: not valid TOML" in refusal(written(tmp_path, b"a = 1\x00"))
    assert "holds more than 1 MB. Give a smaller TOML file." in refusal(written(tmp_path, b"#" * 1_000_001))
    assert "is a folder. Give one TOML file in it." in refusal(tmp_path)
    assert "no such file. Check the path." in refusal(tmp_path / "none.toml")
    assert "cannot be read" in refusal("a\0.toml")
    assert "cannot be read" in refusal("a" * 5000 + ".toml")


def test_a_name_that_is_no_crane_lists_the_cranes() -> None:
    assert refusal("nov-250") == (
        'No crane "nov-250": the library has deep-250t, nov-100t-cylinder, nov-100t-electric, nov-100t-pure-active, '
        "nov-150t, nov-165t, nov-165t-12-motors, nov-250t, nov-250t-digital, nov-250t-f1799, nov-250t-secondary, "
        "nov-50t-pure-active, nov-58t-pure-active, nov-70t-pure-active, utility-20t-open-circuit; did you mean "
        '"nov-250t"? '
        "A file's name ends in .toml."
    )
    assert "the library has deep-250t, nov-100t-cylinder" in refusal("")
    assert "Crane = 5: give a name (deep-250t" in refusal(5)
    assert "Crane = nothing: give a name" in refusal(None)
    assert refusal("../cranes/nov-250t")


def test_a_base_that_is_not_found_is_named(tmp_path: Path) -> None:
    says = refusal(written(tmp_path, 'base = "nov-25t"\n'))
    assert 'mine.toml: base = "nov-25t": no such crane; the library has' in says
    assert 'did you mean "nov-250t"?' in says
    assert "mine.toml: base = 5: not the name of a crane" in refusal(written(tmp_path, "base = 5\n"))
    assert "mine.toml: base = nothing: not the name" in refusal(written(tmp_path, "[base]\nx = 1\n"))
    assert "no such file. Check the path." in refusal(written(tmp_path, 'base = "none.toml"\n'))


def test_files_that_build_on_each_other_in_a_circle_are_refused(tmp_path: Path) -> None:
    written(tmp_path, 'base = "b.toml"\n', "a.toml")
    assert "build on each other in a circle" in refusal(written(tmp_path, 'base = "a.toml"\n', "b.toml"))
    assert "build on each other in a circle" in refusal(written(tmp_path, 'base = "mine.toml"\n'))


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (
            {"wire": {"L_0": 80}},
            'changes to nov-250t: wire.L_0 = 80: a bare number; write it as text with its unit, "80 m"',
        ),
        ({"wire": {"L0": "80 m"}}, 'changes to nov-250t: wire.L0: unknown field; did you mean "L_0"?'),
        ({"base": "nov-150t"}, "changes to nov-250t: base: unknown field"),
        ({5: "x"}, "changes to nov-250t: top: key 5 is not a field. Write the name of a field."),
        ([], "Changes = []: give nested tables"),
    ],
)
def test_wrong_changes_are_refused(changes: Any, says: str) -> None:
    with pytest.raises(StillhookError) as error:
        changed(load_crane("nov-250t"), changes)
    assert says in str(error.value)


toml_values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=12)
    | st.sampled_from(
        ["1 m", "215 cm^3/rev", "A6VM280", "nov-250t", "1e308 m", "1e25 t", "1e-300 m", "-1 t", 1e300, 5e-324]
    ),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["value", "kind", "source", "motor", "D_max", "library", "system", "p_0", "gas", "x"]),
            inner,
            max_size=3,
        )
    ),
    max_leaves=6,
)


@pytest.mark.thorough
@given(st.dictionaries(st.sampled_from(list(Crane.model_fields)), toml_values, max_size=3))
@settings(deadline=None, max_examples=200, suppress_health_check=[HealthCheck.too_slow])
def test_no_change_gets_past_the_checks_or_crashes(changes: dict[str, Any]) -> None:
    """Whatever is laid over a crane, the outcome is a crane with finite numbers or a one-line error."""
    message, crane = "", None
    try:
        crane = changed(load_crane("nov-250t"), changes)
    except StillhookError as error:
        message = str(error)
    assert len(message.splitlines()) <= 1
    assert crane is None or math.isfinite(crane.active.motor.D_total * crane.inertia.J_m_eff * crane.SWL)


@pytest.mark.thorough
@given(st.floats(1e-3, 1e3), st.floats(1e-9, 1e-2))
@settings(deadline=None, max_examples=30)
def test_every_digit_of_a_changed_value_survives_the_file(V: float, Y_1: float) -> None:
    crane = changed(
        load_crane("nov-150t"), {"active": {"line": {"V": f"{V!r} L"}}, "friction": {"system": {"Y_1": Y_1}}}
    )
    again = tomllib.loads(crane_toml(crane))
    assert changed(crane, {"active": {"line": again["active"]["line"]}, "friction": again["friction"]}) == crane
