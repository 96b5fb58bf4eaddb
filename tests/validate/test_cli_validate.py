"""`stillhook validate`: what a person reads, what a program reads, what is written, and what is refused. The steps are staged here."""

import datetime
import json
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from stillhook import load_crane
from stillhook.cli import run as command
from stillhook.errors import ValidateError
from stillhook.logs.types import Log
from stillhook.report.document import Table
from stillhook.spec.scenario import Mode
from stillhook.validate import validation as frame
from stillhook.validate.certificate import save as report_files
from stillhook.validate.criteria.criteria import Criteria, Criterion, Limit
from stillhook.validate.criteria.judge import judge
from stillhook.validate.criteria.results import Measure, Step, StepNumber
from stillhook.validate.data_set.campaign import Campaign, CraneTest, Kind
from stillhook.validate.data_set.record import Record, Segment
from stillhook.validate.figures import all as pictures
from stillhook.validate.report.texts import sentence
from stillhook.validate.validation import Validation
from stillhook.variables import BY_NAME

TERMINAL = 80  # columns
CRITERIA = Criteria(
    "quay",
    "3",
    "agreed with the owner",
    (
        Criterion(
            "1b", StepNumber.DATA, "Winch loads", "loads", Limit.AT_LEAST, 2.0, "", "2", source="paper F table 2"
        ),
        Criterion(
            "2b",
            StepNumber.AHC,
            "Mean deviation",
            "e_c_pp_deviation",
            Limit.AT_MOST,
            0.05,
            "length",
            "5 cm",
            source="paper F table 2",
        ),
        Criterion(
            "2b-s",
            StepNumber.AHC,
            "Its spread",
            "e_c_pp_deviation_s",
            Limit.AT_MOST,
            0.015,
            "length",
            "1.5 cm",
            judged=False,
            source="ours",
        ),
    ),
    {"window": 30.0, "eta_above": 1.0},
)


def record(name: str, load: float, s_w: float) -> Record:
    test = CraneTest(name, Path(f"{name}.csv"), Kind.AHC, load, Mode.SSC, s_w, None, None, 0.0, np.inf)
    t = np.arange(0.0, 1500.0, 0.01)
    part = Segment(name, 0, len(t), 0.0, 1500.0, load, s_w, s_w - 1.2, s_w + 1.2, 2.31, 9.4, Mode.SSC)
    log = Log(f"{name}.csv", t, {}, {}, (), (), 100.0, len(t))
    return Record(
        test, log, t, 0.01, {"s_tip": np.sin(0.65 * t)}, (part,), ("a gap of 20 s at 412 s: no window crosses it",)
    )


def staged(
    e_c_pp_deviation: float | None = 0.021,
    high: float = 0.027,
    *,
    low: float = 0.016,
    synthetic: bool = True,
    complete: bool = True,
) -> Validation:
    """A validation as the steps would leave it."""
    records = (record("1", 82e3, 487.0), record("2", 164e3, 2314.0))
    campaign = Campaign(
        title="Sea trial",
        date=datetime.date(2026, 11, 21),
        file=Path("campaign.toml"),
        crane=load_crane("nov-250t"),
        crane_name="nov-250t",
        criteria=CRITERIA,
        delay=0.0,
        tests=tuple(r.test for r in records),
        synthetic=synthetic,
        remarks=("wind 12 m/s",),
    )
    notes = ("no test has s_tip: log it",) if e_c_pp_deviation is None else ()
    deviation = Measure(
        "e_c_pp_deviation", e_c_pp_deviation, "length", low, high, "load case 2", "2 load cases, 71 windows", notes
    )
    spread = Measure("e_c_pp_deviation_s", 0.012, "length")
    table = Table(
        ("load case", "mean\n[cm]", "remark"),
        (("1", "1.9", ""), ("2", "2.1", "the <worst> one")),
        "Deviation by load case",
    )
    steps = tuple(
        Step(
            n,
            {StepNumber.DATA: (Measure("loads", 2.0, data="2 tests"),), StepNumber.AHC: (deviation, spread)}.get(n, ()),
            estimates=SimpleNamespace(comparisons=()) if n is StepNumber.AHC else None,
        )
        for n in (StepNumber if complete else (StepNumber.DATA, StepNumber.AHC))
    )
    steps = (
        *steps[:-1],
        replace(
            steps[-1], statements=("the twin errs by less than the crane",), tables=(table,), data={"e_c_pp": [0.1]}
        ),
    )
    measures = tuple(m for s in steps for m in s.measures)
    return Validation(campaign, records, steps, judge(CRITERIA, measures, [s.number for s in steps]))


def drawn(estimates: object, campaign: Campaign) -> dict[str, Figure]:
    figure = Figure()
    figure.subplots().plot([0.0, 1.0])
    return {"error-over-time": figure}


@pytest.fixture
def stage(monkeypatch, tmp_path):
    """Puts a staged validation in place of the steps; returns the path of a campaign file."""
    monkeypatch.setattr(pictures, "FIGURES", {StepNumber.AHC: (drawn,)})
    monkeypatch.setattr("stillhook.validate.data_set.campaign.load_campaign", lambda path: staged().campaign)
    monkeypatch.setattr(report_files, "certificate_files", lambda found, drawn: {"certificate.json": b"{}"})
    asked = {}

    def put(found: Validation) -> dict:
        def validate(campaign, *, steps=None, progress=None):
            asked.update(campaign=campaign, steps=steps)
            return found

        monkeypatch.setattr(frame, "validate", validate)
        return asked

    return put


class Text(HTMLParser):
    """What a reader of a page sees, without its style."""

    def __init__(self):
        super().__init__()
        self.parts, self.hidden = [], False

    def handle_starttag(self, tag, attributes):
        self.hidden = tag == "style"

    def handle_data(self, data):
        if not self.hidden:
            self.parts.append(data)


def test_a_person_reads_load_cases_steps_every_criterion_and_one_sentence(stage, capsys):
    stage(staged())
    assert command(["validate", "campaign.toml"]) == 0
    out = capsys.readouterr().out
    first = out.splitlines()[0]
    assert "SYNTHETIC Sea trial: nov-250t" in first
    for words in (
        "2313-2315",
        "a gap of 20 s at 412 s",
        "shown     2b  Mean deviation in load case 2: 2.1 cm (1.6 to 2.7 cm), limit at most 5 cm; the far end of the interval is at 54 %",
        "1 line was judged by the 95 % interval of the value. Consumer's risk: such a line is judged shown in at most 2.5 % of campaigns",
        "1 line was judged by value",
    ):
        assert words in out
    assert 'PASSED: "nov-250t" as described represents the SYNTHETIC crane of these logs' in out
    assert "Deviation by load case" not in out
    assert (
        out.splitlines()[-1]
        == "every line in full: --all; report, figures and certificate: --out FOLDER; tables of a step: --steps 4"
    )


def test_an_interval_that_holds_the_limit_is_in_capitals_and_ends_with_exit_code_1(stage, capsys):
    stage(staged(0.0681, 0.12, low=0.0178))
    assert command(["validate", "campaign.toml"]) == 1
    out = capsys.readouterr().out
    assert "NOT SHOWN: of 2 criteria of quay version 3, none refuted, but 1 not shown (2b)." in out
    assert (
        "NOT SHOWN 2b  Mean deviation in load case 2: 6.81 cm (1.78 to 12 cm), limit at most 5 cm; the far end of the interval is 2.4 times"
        in out
    )
    assert "which the estimate misses and part of the interval meets" in out
    assert "REFUTED" not in out


def test_an_interval_beyond_the_limit_is_refuted_and_ends_with_exit_code_1(stage, capsys):
    stage(staged(0.068, 0.08, low=0.056))
    assert command(["validate", "campaign.toml"]) == 1
    out = capsys.readouterr().out
    assert "REFUTED: of 2 criteria of quay version 3, 1 refuted (2b)." in out
    assert (
        "Blocking, highest utilisation of the limit first:\nREFUTED   2b  Mean deviation in load case 2: 6.8 cm (5.6 to 8 cm)"
        in out
    )


@pytest.mark.slow
def test_what_has_no_figure_is_in_the_way_with_its_reason_and_is_explained(stage, capsys):
    stage(staged(None))
    assert command(["validate", "campaign.toml"]) == 1
    out = capsys.readouterr().out
    assert "NOT COVERED 2b  Mean deviation: no value; no test has s_tip: log it" in out
    assert "not covered: the tests lack the data for this line" in " ".join(out.split())
    assert "1 not covered (2b)" in out


@pytest.mark.slow
def test_the_verdict_and_what_decides_it_come_before_load_cases_steps_and_lines(stage, capsys):
    stage(staged())
    command(["validate", "campaign.toml"])
    out = capsys.readouterr().out
    places = [
        out.index(text)
        for text in (
            "PASSED: ",
            "shown     2b  Mean",
            "Consumer's risk",
            "load cases",
            "steps",
            "lines",
            "shown: the complete",
        )
    ]
    assert places == sorted(places)
    assert out.splitlines()[1].startswith("PASSED: ")


@pytest.mark.slow
def test_what_agrees_is_in_full_only_where_it_is_wanted(stage, capsys):
    full = (
        "shown     2b  Mean deviation in load case 2: 2.1 cm (95 % interval 1.6 to 2.7 cm)",
        "the twin errs by less than the crane",
    )
    stage(staged())
    command(["validate", "campaign.toml"])
    assert not any(words in capsys.readouterr().out for words in full)
    command(["validate", "campaign.toml", "--all"])
    out = capsys.readouterr().out
    assert all(words in out for words in full)
    assert "[paper F table 2]" in out
    assert "Deviation by load case" not in out


def test_nothing_of_the_text_is_wider_than_a_terminal_of_80_columns(stage, capsys, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", str(TERMINAL))
    stage(staged(None))
    command(["validate", "campaign.toml"])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, (line for line in lines if not line.startswith(("│", "┃", "┏", "┡", "└"))))) <= TERMINAL


def test_single_steps_say_that_there_is_no_certificate_without_the_others(stage, capsys):
    asked = stage(staged(complete=False))
    assert command(["validate", "campaign.toml", "--steps", "0, 5"]) == 0
    assert list(asked["steps"]) == [0, 5]
    out = capsys.readouterr().out
    assert "This is steps 0 and 5 only: a certificate needs all steps, 0 to 6." in out
    assert "Deviation by load case" in out


def test_json_is_in_si_with_names_of_the_nomenclature(stage, capsys):
    stage(staged())
    assert command(["validate", "campaign.toml", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert set(data) <= set(BY_NAME)
    line = next(x for x in data["lines"] if x["key"] == "2b")
    assert line["measure"]["value"] == 0.021
    assert (line["verdict"], line["failed"], line["figures"]) == ("shown", False, 1)
    assert (line["consumer_risk"], line["producer_risk"]) == (0.025, 0.025)
    assert data["segments"][1]["load"] == 164e3
    assert data["steps"][-1]["data"] == {"e_c_pp": [0.1]}
    assert (data["passed"], data["outcome"], data["decisive"]) == (True, "passed", ["2b"])


@pytest.mark.slow
def test_everything_is_written_and_the_page_reads_as_text(stage, capsys, tmp_path):
    stage(staged())
    out = tmp_path / "out"
    assert command(["validate", "campaign.toml", "--out", str(out)]) == 0
    assert {p.name for p in out.iterdir()} == {
        "report.html",
        "summary.json",
        "segments.csv",
        "step-5-error-over-time.png",
        "certificate.json",
    }
    assert (
        f"written to {out}: report.html (read this), certificate.json, segments.csv, summary.json, 1 figures"
        in capsys.readouterr().out
    )
    page = Text()
    page.feed((out / "report.html").read_text(encoding="utf-8"))
    text = " ".join(" ".join(page.parts).split())
    for words in (
        "Validation of SYNTHETIC Sea trial: nov-250t",
        "not measured on a crane",
        sentence(staged()),
        "Step 5: active heave compensation",
        "Step 5 alone: passed",
        "the <worst> one",
        "Step 5: error over time",
        "2.1 cm (1.6 to 2.7 cm)",
        "Closest to their limits",
        "Consumer's risk",
        "wind 12 m/s",
        "payload on the hook 82 t to 164 t",
        "quay version 3",
        'Test "1": a gap of 20 s',
    ):
        assert words in text
    assert json.loads((out / "summary.json").read_text(encoding="utf-8"))["complete"] is True
    assert (out / "segments.csv").read_text(encoding="utf-8").splitlines()[1].startswith("1,0.0,1500.0,82.0,")


@pytest.mark.slow
def test_a_certificate_of_an_earlier_validation_does_not_stay_beside_a_later_report(stage, tmp_path):
    out = tmp_path / "out"
    stage(staged())
    command(["validate", "campaign.toml", "--out", str(out)])
    (out / "my-notes.txt").write_text("kept")
    stage(staged(complete=False))
    command(["validate", "campaign.toml", "--out", str(out), "--steps", "0,5"])
    assert not (out / "certificate.json").exists()
    assert (out / "my-notes.txt").read_text() == "kept"


@pytest.mark.slow
def test_criteria_of_the_command_line_give_no_certificate(stage, tmp_path, capsys):
    stage(staged())
    command(["validate", "campaign.toml", "--out", str(tmp_path / "out"), "--criteria", "paper-f"])
    assert not (tmp_path / "out" / "certificate.json").exists()
    assert "no certificate with --criteria" in capsys.readouterr().out


def test_a_crane_file_in_the_folder_of_the_results_is_not_written_over(stage, tmp_path, capsys):
    stage(staged())
    (tmp_path / "crane.toml").write_text("mine")
    assert command(["validate", "campaign.toml", "--out", str(tmp_path)]) == 2
    assert (
        'crane.toml" there is not from an earlier validation, and could be lost. Choose another folder.'
        in capsys.readouterr().err
    )
    assert (tmp_path / "crane.toml").read_text() == "mine"


def test_a_crane_relative_file_the_numbers_of_another_command_is_not_taken_away(stage, tmp_path, capsys):
    stage(staged())
    (tmp_path / "crane.toml").write_text("mine")
    (tmp_path / "summary.json").write_text('{"runs": []}')
    assert command(["validate", "campaign.toml", "--out", str(tmp_path)]) == 2
    assert "is not from an earlier validation" in capsys.readouterr().err
    assert (tmp_path / "crane.toml").read_text() == "mine"


def test_a_folder_in_the_way_of_a_figure_is_told_before_anything_is_written(stage, tmp_path, capsys):
    stage(staged())
    (tmp_path / "out" / "step-5-error-over-time.png").mkdir(parents=True)
    assert command(["validate", "campaign.toml", "--out", str(tmp_path / "out")]) == 2
    assert '"step-5-error-over-time.png" there is a folder in the way of a figure' in capsys.readouterr().err
    assert len(list((tmp_path / "out").iterdir())) == 1


def test_a_file_on_which_the_crane_is_built_is_not_written_over(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "tuned-crane.toml").write_text('base = "nov-250t"\n')
    (tmp_path / "out" / "summary.json").write_text('{"criteria": {}, "complete": true, "verdict": ""}')
    (tmp_path / "ours.toml").write_text('base = "out/tuned-crane.toml"\n')
    campaign = replace(staged().campaign, file=tmp_path / "campaign.toml", crane_name="ours.toml")
    with pytest.raises(ValidateError, match=r'"tuned-crane.toml" there belongs to the campaign'):
        report_files.check_out(campaign, tmp_path / "out")


def test_an_interrupted_validation_leaves_no_file(stage, capsys, tmp_path, monkeypatch):
    stage(staged())

    def stopped(*given):
        raise KeyboardInterrupt

    monkeypatch.setattr(pictures, "FIGURES", {StepNumber.AHC: (stopped,)})
    out = tmp_path / "out"
    assert command(["validate", "campaign.toml", "--out", str(out)]) == 130
    assert not out.exists()
    assert "stopped" in capsys.readouterr().err


def test_criteria_of_the_command_line_take_the_place_of_those_of_the_campaign(stage, capsys):
    asked = stage(staged())
    command(["validate", "campaign.toml", "--criteria", "paper-f"])
    assert asked["campaign"].criteria.name == "paper-f"


def test_a_verdict_without_any_criterion_that_counts_is_no_pass(stage, capsys):
    found = staged(complete=False)
    told = replace(found, lines=tuple(replace(line, judged=False) for line in found.lines))
    assert sentence(told).startswith("NOT ASSESSED")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.toml"], '"nowhere.toml": no such file'),
        (
            ["campaign.toml", "--steps", "7"],
            '--steps = "7": "7" is not one of 0, 1, 2, 3, 4, 5, 6. Write numbers such as 1,2.',
        ),
        (["campaign.toml", "--steps", ""], '"" is not one of'),
        (["campaign.toml", "--criteria", "papier-f"], 'did you mean "paper-f"'),
        (["campaign.toml", "--out", "a-file"], "a-file is not a folder"),
        ([], "CAMPAIGN.toml"),
    ],
)
def test_bad_input_is_refused_in_one_line(arguments, words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a-file").write_text("")
    Path("log.csv").write_text("")
    Path("campaign.toml").write_text('date = 2026-11-21\ncrane = "nov-250t"\n[[test]]\nlog = "log.csv"\nkind = "ahc"\n')
    assert command(["validate", *arguments]) == 2
    error = capsys.readouterr().err.strip()
    assert words in error
    assert "\n" not in error


def test_help_shows_an_example(capsys):
    assert command(["validate", "--help"]) == 0
    assert "Example: stillhook validate" in " ".join(capsys.readouterr().out.split())
