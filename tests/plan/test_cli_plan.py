"""`stillhook plan` and `stillhook demo` as a user meets them: answers, exit codes, and mistakes in one line."""

import json

import pytest
from tests.plan.manifold import manifold

from stillhook.cli import run
from stillhook.plan.report import document as plan_files

HEAD = 'name = "Manifold to 300 m"\n'
PLAN = (
    HEAD
    + manifold("none", "cap-80")
    + """\
[environment]
Hs = ["HIGHS"]
Tp = ["6 s", "9 s"]
headings = ["180 deg"]

[operation]
T_POP = "4 h"

[[phase]]
name = "splash"
kind = "splash-zone"
depth = "25 m"

[[phase]]
name = "deep"
kind = "deep"
"""
)


def a_plan(folder, *, Hs='1 m", "2 m", "4 m', more=""):
    path = folder / "lift.toml"
    path.write_text(PLAN.replace("HIGHS", Hs) + more, encoding="utf-8")
    return str(path)


@pytest.fixture(autouse=True)
def _a_short_report(monkeypatch):
    """The report has tests of its own: here its files stand for it."""

    def written(result, folder):
        for name in ("report.pdf", "report.html"):
            (folder / name).write_text(result.name)

    monkeypatch.setattr(plan_files, "write_report", written)


def refused(capsys, *arguments):
    """The one line in which a command is refused."""
    assert run(["plan", *arguments]) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    return err


@pytest.mark.slow
def test_a_plan_prints_limits_of_every_heading_and_leaves_report_and_numbers(tmp_path, capsys):
    out = tmp_path / "out"
    assert run(["plan", a_plan(tmp_path), "--tier", "closed-form", "--out", str(out), "--verbose"]) == 0
    text = capsys.readouterr().out
    assert "OP_LIM with 80 % cap, credited: limiting Hs [m]" in text
    assert "rules: offshore-lift 4; editions not entered" in text
    assert sorted(p.name for p in out.iterdir()) == [
        "plan.json",
        "plan.nc",
        "report.html",
        "report.pdf",
        "stillhook-manifest.json",
    ]


@pytest.mark.slow
def test_json_tells_facts_by_name_and_limits_cell_by_cell(tmp_path, capsys):
    assert run(["plan", a_plan(tmp_path), "--tier", "closed-form", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["name"] == "Manifold to 300 m"
    assert answer["operation"]["T_R"] == 8 * 3600.0
    cells = [c for c in answer["limits"] if (c["credit"], c["alternative"]) == ("credited", "cap-80")]
    assert [(c["T_p"], round(c["beta"], 4)) for c in cells] == [(6.0, 3.1416), (9.0, 3.1416)]
    assert {c["verdict"] for c in answer["limits"]} <= {"limited", "above", "never", "no result"}
    for c in cells:
        assert (c["Hs_limit"] is None) == (c["verdict"] in ("above", "no result"))


@pytest.mark.slow
def test_a_table_whose_seas_are_all_too_high_is_answered_with_no(tmp_path, capsys):
    assert run(["plan", a_plan(tmp_path, Hs='8 m", "9 m'), "--tier", "closed-form"]) == 1
    capsys.readouterr()


@pytest.mark.slow
def test_check_says_what_a_plan_asks_and_runs_nothing(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("stillhook.plan.planning.plan", None)
    assert run(["plan", a_plan(tmp_path), "--check", "--verbose"]) == 0
    assert "T_R 8 h" in capsys.readouterr().out


@pytest.mark.thorough
def test_the_example_is_copied_to_be_edited_and_planned(tmp_path, capsys):
    assert run(["example", "plan", str(tmp_path / "mine"), "--verbose"]) == 0
    assert "template-to-1500m.toml --check" in capsys.readouterr().out
    assert run(["plan", str(tmp_path / "mine" / "template-to-1500m.toml"), "--check"]) == 0


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["no-such-lift"], "the library has"),
        (["no-such-lift.toml"], "no-such-lift.toml"),
        (["template-to-1500m", "elsewhere"], "unexpected extra argument(s) (elsewhere)"),
        (["template-to-1500m", "--tier", "tmie"], 'Unknown tier "tmie". Choose closed-form, frequency or time.'),
        (
            ["template-to-1500m", "--tier", "frequency", "--forecast-factors", "nobody"],
            '--forecast-factors "nobody": no such table of alpha factors',
        ),
        (["template-to-1500m", "--workers", "0"], "--workers 0: give 1 to 256"),
        (["template-to-1500m", "--tier", "frequency", "--seed", "3"], "waves are drawn in tier time alone"),
        (["template-to-1500m", "--seed", "-1"], "--seed"),
        (["template-to-1500m", "--tier", "frequency", "--workers", "nowhere"], "scheduler"),
    ],
)
def test_mistakes_are_refused_in_one_line(arguments, said, capsys):
    assert said in refused(capsys, *arguments)


@pytest.mark.slow
def test_a_folder_that_cannot_be_written_to_is_refused_before_anything_runs(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("stillhook.plan.planning.plan", None)
    (tmp_path / "out").write_text("a file")
    assert "out" in refused(capsys, a_plan(tmp_path), "--out", str(tmp_path / "out"))


@pytest.mark.slow
def test_nothing_is_left_half_written_where_a_plan_is_stopped(tmp_path, capsys, monkeypatch):
    def stopped(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr("stillhook.plan.planning.plan", stopped)
    out = tmp_path / "out"
    assert run(["plan", a_plan(tmp_path), "--out", str(out)]) == 130
    assert not out.exists()
    assert "no file was left half-written" in capsys.readouterr().err


@pytest.mark.slow
def test_demo_plans_the_example_and_knows_what_it_can_show(capsys, monkeypatch):
    asked = {}

    def planned(lift, **options):
        asked["name"] = lift.name
        raise KeyboardInterrupt

    monkeypatch.setattr("stillhook.plan.planning.plan", planned)
    assert run(["demo"]) == 130
    assert asked["name"] == "Template of 120 t to 1,500 m"
    assert run(["demo", "motion"]) == 2
    assert "Choose plan or quick" in capsys.readouterr().err


class TestWhatAnAnswerTellsApart:
    """Equal rows are no comparison: without runs of the twin the controllers that get the same limits share one, and a line says so."""

    TWINS = 'alternatives = ["none", "cap-80", "ns", "ssc"]'

    def plan_of(self, folder, mode="ahc"):
        text = (
            PLAN.replace('alternatives = ["none", "cap-80"]', self.TWINS)
            .replace("HIGHS", '1 m", "2 m", "4 m')
            .replace('["180 deg"]', '["165 deg", "180 deg", "195 deg"]')
        )
        text = (
            text.replace('kind = "deep"\n', f'kind = "deep"\nmode = "{mode}"\n')
            + '\n[weather]\nfile = "SYNTHETIC-norwegian-sea"\n'
        )
        (folder / "lift.toml").write_text(text, encoding="utf-8")
        return str(folder / "lift.toml")

    @pytest.mark.thorough
    def test_controllers_that_closed_form_cannot_tell_apart_are_not_compared(self, tmp_path, capsys):
        assert run(["plan", self.plan_of(tmp_path), "--tier", "closed-form", "--verbose"]) in (0, 1)
        out = capsys.readouterr().out
        line = "The closed form does not distinguish controllers well enough: none is compared (ns, ssc), and limits are those"
        assert out.count(line) == 1
        assert "over best classic" not in out
        assert "│ SSC" not in out

    @pytest.mark.thorough
    def test_a_plan_whose_phases_are_all_manual_is_not_credited_by_a_certificate_that_is_not_there(
        self, tmp_path, capsys
    ):
        assert run(["plan", self.plan_of(tmp_path, "manual"), "--tier", "closed-form", "--json"]) in (0, 1)
        told = json.loads(capsys.readouterr().out)
        assert "no certificate" in told["crane"]["twin"]
        tells = {a["name"]: a["credit_note"] for a in told["alternatives"]}
        assert tells["ssc"] == tells["ns"] == {"cause": "nothing-to-credit"}
        assert told["remarks"][0] == {"cause": "nothing-compensated"}
