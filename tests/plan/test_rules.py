"""Rule files: sets of the library are sourced, a user's file changes one openly, and what cannot be is refused in one line."""

from pathlib import Path

import pytest

from stillhook.errors import PlanError, StillhookError, UnitError
from stillhook.plan.definition.capacities import CAPACITIES
from stillhook.plan.definition.rules import QUANTITIES, Level, Sense
from stillhook.plan.definition.rules_file import load_rules, rule_sets, rules_of
from stillhook.spec.lift.phase import Phase, PhaseKind
from stillhook.variables import BY_NAME

BASE = 'base = "offshore-lift"\nversion = "2"\n'
OWN = """
[[rule]]
key = "slack-chance"
title = "Chance of slack slings"
quantity = "slack_chance"
at_most = "1 %"
phases = ["splash-zone"]
standard = "Company rule 7"
"""

ERROR = """
[[rule]]
key = "landing-error"
title = "Error of the wire at touch-down"
quantity = "e_c_pp"
at_most = "0.3 m"
level = "mpm"
phases = ["landing"]
standard = "Company rule 8"
"""


def rules(folder: Path, text: str):
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return load_rules(path)


def of(found, key):
    return next(r for r in found.rules if r.key == key)


@pytest.mark.parametrize("name", rule_sets())
def test_every_rule_of_the_library_says_where_it_is_from(name):
    found = load_rules(name)
    assert 12 <= len(found.rules) <= 28
    for rule in found.rules:
        assert rule.title
        assert rule.note
        assert rule.standard
        assert not rule.standard.startswith(("DNV", "EN ")) or (rule.clause and rule.edition == "edition not entered")
        assert rule.quantity in QUANTITIES
        assert rule.phases


def test_quantities_and_capacities_have_a_row_among_the_variables_and_a_unit_of_the_same_kind():
    for quantity in QUANTITIES:
        assert quantity in BY_NAME
    for rule in load_rules("offshore-lift").rules:
        if isinstance(rule.limit, str):
            assert CAPACITIES[rule.limit].kind == BY_NAME[rule.quantity].kind


def test_every_kind_of_phase_has_a_rule_for_static_and_for_dynamic_load():
    found = load_rules("offshore-lift")
    for kind in PhaseKind:
        quantities = {r.quantity for r in found.of(kind).values()}
        assert {"F_top_static", "F_top_max", "DAF"} <= quantities
    static, dynamic = of(found, "static-load"), of(found, "dynamic-load")
    assert (static.limit, dynamic.limit) == ("SWL_tip", "SWL_dynamic")
    assert static.factor == dynamic.factor == 1.0


def test_the_slack_criterion_is_nine_tenths_of_the_static_force():
    rule = of(load_rules("offshore-lift"), "slack-sling")
    assert (rule.sense, rule.limit) == (Sense.AT_LEAST, pytest.approx(0.1))


def test_a_file_enters_the_editions_of_its_project(tmp_path):
    entered = 'entered_by = "N. N., Company"\n[editions]\n"DNV-RP-N103" = "2021-09"\n'
    found = rules(tmp_path, BASE + entered)
    assert found.entered_by == "N. N., Company"
    assert of(found, "slack-sling").edition == "2021-09"
    assert of(found, "off-lead").edition == "edition not entered"
    assert found.changes == ()
    assert found.digest != rules(tmp_path, BASE).digest


@pytest.mark.parametrize(
    ("entered", "refused"),
    [
        ('[editions]\n"DNV-RP-N103" = "2021-09"\n', 'Write entered_by = "name, company"'),
        ('entered_by = "N. N."\n[editions]\n"DNV-RP-N104" = "2021"\n', "no rule is from it; did you mean"),
        ('entered_by = "N. N."\n[editions]\n"DNV-RP-N103" = ""\n', "DNV-RP-N103"),
    ],
)
def test_editions_of_nobody_or_of_no_standard_are_refused(tmp_path, entered, refused):
    with pytest.raises(StillhookError) as e:
        rules(tmp_path, BASE + entered)
    assert refused in str(e.value)
    assert "\n" not in str(e.value)


def test_a_clause_is_named_where_its_text_was_seen_and_assumed_elsewhere():
    for rule in load_rules("offshore-lift").rules:
        if rule.standard.startswith(("DNV-ST", "DNV-RP", "EN ")):
            assert "public text seen" in rule.clause or rule.clause.startswith("assumed: ")


def test_a_file_changes_adds_and_drops_and_tells_each(tmp_path):
    found = rules(
        tmp_path, BASE + 'drop = ["load-motion"]\n[[rule]]\nkey = "landing-speed"\nat_most = "18 m/min"\n' + OWN
    )
    assert of(found, "landing-speed").limit == pytest.approx(0.3)
    assert of(found, "slack-chance").limit == pytest.approx(0.01)
    assert "load-motion" not in {r.key for r in found.rules}
    assert [line.split(" ")[0] for line in found.changes] == ["load-motion", "slack-chance", "landing-speed:"]
    assert found.changes[2] == "landing-speed: at most 18 m/min in place of at most 0.5 m/s"
    assert found.source == "mine.toml, on offshore-lift version 4"


def test_a_changed_rule_does_not_go_on_bearing_the_standard_of_what_it_was(tmp_path):
    rule = of(rules(tmp_path, BASE + '[[rule]]\nkey = "slack-sling"\nat_least = 0.0\n'), "slack-sling")
    assert rule.standard == "changed in mine.toml"
    assert rule.clause == ""
    assert "Was at least 0.1, p90, in DNV-RP-N103" in rule.note
    named = of(
        rules(tmp_path, BASE + '[[rule]]\nkey = "slack-sling"\nat_least = 0.0\nstandard = "Client"\n'), "slack-sling"
    )
    assert (named.standard, named.edition, named.clause) == ("Client", "", "")


def test_a_rule_that_says_what_the_base_says_is_no_change(tmp_path):
    found = rules(tmp_path, BASE + '[[rule]]\nkey = "slack-sling"\nat_least = "10 %"\n')
    assert found.changes == ()
    assert of(found, "slack-sling").standard == "DNV-RP-N103"


def test_limits_may_be_capacities_with_a_factor(tmp_path):
    rule = of(rules(tmp_path, BASE + '[[rule]]\nkey = "dynamic-load"\nat_most = "1.15 x SWL_tip"\n'), "dynamic-load")
    assert (rule.limit, rule.factor, rule.requirement) == ("SWL_tip", 1.15, "at most 1.15 x SWL_tip")


def test_the_digest_follows_from_the_content_alone(tmp_path):
    again, other = rules(tmp_path, BASE), rules(tmp_path, BASE + OWN)
    assert rules(tmp_path, "# a remark\n" + BASE).digest == again.digest
    assert len({load_rules("offshore-lift").digest, again.digest, other.digest}) == 3


def test_numbers_of_the_simplified_method_can_be_changed_and_are_told(tmp_path):
    found = rules(tmp_path, BASE + '[simplified]\nzeta_a = 0.95\nT_z_most = "15 s"\n')
    assert found.settings["zeta_a"] == 0.95
    assert found.settings["T_z_most"] == 15.0
    assert found.changes == (
        "simplified method, zeta_a: 0.95 in place of 0.9 (SI)",
        "simplified method, T_z_most: 15 in place of 13 (SI)",
    )


BAD = [
    ("", "empty"),
    ('base = "offshore-lift"\n', "mine.toml: version: missing (version of the set). Add it."),
    ('base = "ofshore-lift"\nversion = "1"\n', 'did you mean "offshore-lift"?'),
    ('version = "1"\n', "Write one table [[rule]] for each."),
    (BASE + 'drop = ["slack"]\n', 'the base has no rule "slack"'),
    (BASE + OWN + OWN, 'rule "slack-chance": is given twice'),
    (BASE + 'drop = ["snap-load"]\n[[rule]]\nkey = "snap-load"\nat_most = "1 kN"\n', "is dropped as well"),
    (BASE + OWN.replace("slack_chance", "slack_chanse"), 'did you mean "slack_chance"?'),
    (BASE + OWN.replace('"1 %"', "-0.5"), "no quantity of a rule is below 0"),
    (BASE + OWN.replace('at_most = "1 %"', ""), "give exactly one of at_most, at_least"),
    (
        BASE + OWN.replace('"splash-zone"', '"splash"'),
        "phases[0] = \"splash\": it must be 'lift-off', 'in-air', 'splash-zone'",
    ),
    (BASE + OWN.replace("phases", 'level = "p90"\nphases'), "slack_chance has no largest value. Leave level out."),
    (BASE + ERROR.replace('level = "mpm"\n', ""), 'rule "landing-error": level: missing'),
    (BASE + ERROR.replace('"mpm"', '"p90"'), 'rule "control-error" asks e_c_pp at "mpm". Give both the same.'),
    (BASE + OWN.replace('title = "Chance of slack slings"', ""), 'rule "slack-chance": title: missing'),
    (BASE + '[[rule]]\nkey = "landing-speed"\nat_most = 0.5\n', "0.5"),
    (BASE + '[[rule]]\nkey = "landing-speed"\nat_most = "0.5 m"\n', 'unit "m" is not one of m/s'),
    (
        BASE + '[[rule]]\nkey = "landing-speed"\nat_most = "SWL"\n',
        "SWL is a force, and v_landed is not. Capacities that fit: v_top, v_plan",
    ),
    (BASE + '[[rule]]\nkey = "dynamic-load"\nat_most = "1.3 x SWLtip"\n', 'no such capacity; did you mean "SWL_tip"?'),
    (BASE + '[[rule]]\nkey = "dynamic-load"\nat_most = "0 x SWL_tip"\n', "the factor must be more than 0"),
    (BASE + '[[rule]]\nkey = "slack-sling"\nat_least = 1.0\n', "slings at rest have 1"),
    (
        BASE + "[simplified]\nzeta = 0.9\n",
        'simplified.zeta: unknown field; did you mean "zeta_a"? Allowed: zeta_a, T_z_factor',
    ),
    (BASE + "[simplified]\nzeta_a = 0\n", "must be more than zero"),
    (OWN.replace("[[rule]]", 'version = "1"\n[[rule]]', 1), "simplified.zeta_a: missing"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("text", "said"), BAD)
def test_what_cannot_be_is_refused_in_one_line_that_names_the_file(tmp_path, text, said):
    with pytest.raises(StillhookError) as e:
        rules(tmp_path, text)
    line = str(e.value)
    assert said in line
    assert line.startswith("mine.toml: ")
    assert "\n" not in line


def test_a_name_that_is_no_set_and_a_file_that_is_not_there_are_refused(tmp_path):
    with pytest.raises(
        PlanError, match=r'No rules "offshore": the library has offshore-lift; did you mean "offshore-lift"\?'
    ):
        load_rules("offshore")
    with pytest.raises(StillhookError, match="no such file"):
        load_rules(tmp_path / "none.toml")


def test_a_set_of_its_own_needs_no_base(tmp_path):
    settings = (
        '[simplified]\nzeta_a = 0.9\nT_z_factor = 8.9\nT_z_most = "13 s"\nC_D_least = 2.5\n'
        'duration_least = "30 min"\nhold = "30 min"\nstop = "5 min"\nstand_off = "3 m"\n'
    )
    found = rules(tmp_path, 'version = "1"\n' + settings + OWN)
    assert [r.key for r in found.rules] == ["slack-chance"]
    assert found.changes == ()
    assert found.level("slack_chance") is Level.MEAN
    assert found.level("DAF") is Level.MPM


def phase(**limits):
    return Phase(name="touch-down", kind="landing", limits={k.replace("_", "-"): v for k, v in limits.items()})


def test_a_phase_may_have_limits_of_its_own_or_turn_a_rule_off():
    base = load_rules("offshore-lift")
    own = {
        r.key: r for r in rules_of(base, phase(landing_speed="0.2 m/s", load_motion="off", rigging_daf_subsea="1.5"))
    }
    assert own["landing-speed"].limit == pytest.approx(0.2)
    assert own["rigging-daf-subsea"].limit == pytest.approx(1.5)
    assert "in place of at most 0.5 m/s" in own["landing-speed"].note
    assert set(base.of(PhaseKind.LANDING)) - set(own) == {"load-motion"}


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        (
            {"landing_sped": "off"},
            'landing-sped: rule set offshore-lift version 4 has no such rule; did you mean "landing-speed"? Allowed: static-load',
        ),
        ({"slack_sling": "0.2"}, "slack-sling: the rule does not belong to landing"),
        ({"landing_speed": "0.5"}, "landing-speed"),
        ({"landing_speed": "0.5 kN"}, 'unit "kN" is not one of'),
        ({"rigging_daf_subsea": "none"}, "no such capacity"),
    ],
)
def test_limits_of_a_phase_that_cannot_be_are_refused_with_its_name(limits, said):
    with pytest.raises((PlanError, UnitError)) as e:
        rules_of(load_rules("offshore-lift"), phase(**limits))
    assert said in str(e.value)
    assert 'phase "touch-down": limits.' in str(e.value)
    assert ".." not in str(e.value)
