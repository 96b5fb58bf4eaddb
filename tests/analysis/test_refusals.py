"""What a hurried or careless person types into the commands of the analyses: one line that says what is wrong, and exit
code 2."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from stillhook.cli import run

CASE = 'crane = "nov-250t"\n[scenario]\nload = "100 t"\ns_w = "100 m"'

REFUSED = {
    "stability nov-250t": (
        ("--alpha-m 1.2", "alpha_m = 1.2: the displacement over its maximum must be above 0 and at most 1"),
        ("--delay '-1 s'", "delay = -1 s: allowed is 0 up to 10 s"),
        ("--full", "--full needs --v-tip"),
        ("--v-tip '200 m/min' --full", "beyond the stop"),
        ("--v-tip '200 m/min'", "the winch comes to none of the places that were looked at"),
        ("--v-tip '0 m/min'", "a winch at rest sticks"),
        ("--controller scc", "scc"),
        ("--controller manual", "the operator moves the winch"),
        ("--controller position", "is for another kind of drive"),
        ("--out /dev/null", "/dev/null"),
        ("--load '300 t'", "exceeds the SWL"),
        ("--s-w nonsense", '--s-w = "nonsense": not a number, a space and a unit'),
        ("--full --v-tip '60 m/min' --load ''", '--load = "": empty'),
    ),
    "envelope nov-100t-pure-active": (
        ("--loads '400 t'", "exceeds the SWL"),
        ("--loads 40", "unit"),
        ("--layer 99", "layers 1 to 10"),
        ("--controllers nss", "did you mean"),
        ("--controllers ns,ns", "named twice"),
    ),
    "map nov-250t": (
        ("--controllers foo", "Unknown controller"),
        ("--controllers ,", "name at least one"),
        ("--speeds '10 s'", "is not one of m/s"),
        ("--loads '300 t'", "exceeds the SWL"),
        ("--loads ''", "empty"),
        ("--loads '-5 %'", "below 0"),
        ("--loads '20 % to 100 %'", "a range needs its step"),
        ("--loads '20 % to 100 % by 0.0001 %'", "at most 1000"),
        ("--layer 13", "layers 1 to 12"),
        ("--metric x", "not one of e_c_pp"),
        ("--periods '25 s'", "a complete wave"),
        ("--periods '-12 s'", "must be above 0"),
        ("--metric settling --periods '8 s'", "--periods: a settling test"),
        ("--s-w '9000 m'", "can pay out"),
    ),
    "map CASE": (
        ("--loads '100 t' | tip = 'still'", "is stationary"),
        ("--loads '100 t' | duration = '5 s'", "warm_up"),
        ("--metric settling |", "scenario.tip: a settling test"),
    ),
    "tune nov-250t": (
        ("--controllers scc", 'did you mean "ssc"?'),
        ("--controllers ns,ns", "named twice"),
        ("--free K_q", "K_q"),
        ("--free ''", "name at least one setting"),
        ("--controllers ns --free u_thr", "u_thr"),
        ("--objective speed", "worst-error"),
        ("--limit 'p_max < 3 bar'", "p_max <= ..."),
        ("--limit 'p_max <= 300'", "no unit"),
        ("--loads '400 t'", "exceeds the SWL"),
        ("--loads '-1 t'", "below 0"),
        ("--speeds '3 knots'", "knots"),
    ),
    "tune CASE": (("--controllers strong-ssc | sensors = { delay = '3 s' }", "0 up to 1 s"),),
    "uncertainty": (
        ("--draws 0", "draws = 0"),
        ("--draws 1.5", "as an integer. See --help."),
        ("--limit 'e_c_pp < 1 m'", "write a name, <= or >="),
        ("--limit 'foo <= 1 m'", "there are "),
        ("--controllers sss", 'did you mean "ssc"'),
        ("--controllers ssc,ssc", "named twice"),
        ("--factors nowhere.toml", "no such file"),
        ("--load '300 t' --draws 4", "exceeds the SWL"),
        ("--motion nowhere.csv", "no such file"),
        ("case.toml", "no such file"),
        ("--attribute", "Give it as --limit"),
    ),
    "uncertainty CASE": (
        ("| [settings] scheduler = 'nowhere:1'", "nowhere"),
        ("| [settings] sed = 2", 'did you mean "seed"?'),
    ),
    "compare": (
        ("--drives hydraulic", 'unknown drive "hydraulic". Choose active-passive'),
        ("--drives pure-active,pure-active", '"pure-active" is named twice'),
        ("--drives ,", "name at least one. Choose active-passive"),
        ("--drives pure-active --controllers ns", "Leave one of them out."),
        ("--drives pure-active --load '300 t'", "exceeds the SWL"),
        ("--plan template-to-1500m", "belongs to --drives"),
        ("--drives pure-active --plan no-such-plan", "no-such-plan"),
    ),
    "compare CASE": (  # which uses none of these without --drives
        *(
            (f"| [settings] top_speed = '{v}'", "settings.top_speed")
            for v in ("1.4 s", "1.4", "1e6 m/min", "0 m/s", "-1 m/s", "nan m/s")
        ),
        ("| [settings] draws = -1", "settings.draws = -1: it must be greater than or equal to 0"),
        ("| [settings] draws = 5000", "settings.draws = 5000: it must be less than or equal to 4096"),
        ("| [settings] budget = 3", "settings.budget = 3: it must be greater than or equal to 20"),
        ("| [settings] seed = -1", "settings.seed = -1: it must be greater than or equal to 0"),
        ("| [settings] at_most = 2", "settings.at_most = 2"),
        ("| [settings] full_plan = 1", "settings.full_plan = 1: it must be true or false"),
        ("| [settings] store = ''", 'settings.store = ""'),
        ("| [settings] scheduler = 'garbage'", 'such as "tls://10.0.0.1:8786"'),
    ),
}
"""Command -> what is added to it, and words of the line in which it is refused; behind a bar fields of the scenario, or
of the settings, of the case file."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "line"), [(f"{command} {more}", line) for command, rows in REFUSED.items() for more, line in rows]
)
def test_bad_input_is_one_line_and_exit_code_2(
    words: str, line: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    words, _, rows = words.partition("|")
    scenario, mark, settings = rows.partition("[settings]")
    file = tmp_path / "case.toml"
    file.write_text("\n".join([CASE, scenario.strip() or "tip = 'sine 1 m 10 s'", mark, settings]), encoding="utf-8")
    assert run([str(file) if word == "CASE" else word for word in shlex.split(words)]) == 2
    said = capfd.readouterr()
    errors = [text for text in said.err.splitlines() if not text.startswith("compiling the winch model")]
    assert len(errors) == 1, said.err
    assert line in errors[0]
    assert "factor" not in errors[0] or "factors" in words  # what is wrong with nothing drawn is no factor's fault
    assert said.out == ""
