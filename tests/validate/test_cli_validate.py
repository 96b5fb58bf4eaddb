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
from stillhook.report.kit import caption
from stillhook.spec.scenario import Mode
from stillhook.validate import validation as frame
from stillhook.validate.certificate import certificate as report_files
from stillhook.validate.criteria.criteria import Criteria, Criterion, Limit
from stillhook.validate.criteria.judge import judge
from stillhook.validate.criteria.results import Measure, Step, StepNumber
from stillhook.validate.data_set.campaign import Campaign, CraneTest, Kind
from stillhook.validate.data_set.record import Record, Segment
from stillhook.validate.report import figures as pictures
from stillhook.validate.report.view import sentence
from stillhook.validate.validation import Validation
from stillhook.variables import BY_NAME

TERMINAL = 80  # columns
MEAN = "e_c_pp_deviation"
PAPER, M = "paper F table 2", "length"
CRITERIA = Criteria(
    "quay",
    "3",
    "agreed with the owner",
    (
        Criterion("1b", StepNumber.DATA, "Winch loads", "loads", Limit.AT_LEAST, 2.0, "", "2", source=PAPER),
        Criterion("2b", StepNumber.AHC, "Mean deviation", MEAN, Limit.AT_MOST, 0.05, M, "5 cm", source=PAPER),
        Criterion("2b-s", StepNumber.AHC, "Its spread", f"{MEAN}_s", Limit.AT_MOST, 0.015, M, "1.5 cm", judged=False),
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
    data = "2 load cases, 71 windows"
    deviation = Measure(MEAN, e_c_pp_deviation, M, low, high, "load case 2", data, notes)
    rows = (("1", "1.9", ""), ("2", "2.1", "the <worst> one"))
    step_5 = {
        "statements": ("the twin errs by less than the crane",),
        "tables": (Table(("load case", "mean\n[cm]", "remark"), rows, "Deviation by load case"),),
        "data": {"e_c_pp": [0.1]},
        "estimates": SimpleNamespace(comparisons=()),
    }
    found = {
        StepNumber.DATA: (Measure("loads", 2.0, data="2 tests"),),
        StepNumber.AHC: (deviation, Measure(f"{MEAN}_s", 0.012, M)),
    }
    numbers = tuple(StepNumber) if complete else tuple(found)
    steps = tuple(Step(n, found.get(n, ()), **(step_5 if n is StepNumber.AHC else {})) for n in numbers)
    measures = tuple(m for s in steps for m in s.measures)
    return Validation(campaign, records, steps, judge(CRITERIA, measures, numbers))


def drawn(estimates: object, campaign: Campaign) -> dict[str, Figure]:
    figure = Figure()
    figure.subplots().plot([0.0, 1.0])
    return {"error-over-time": caption(figure, "Control error over time, <all> load cases.")}


@pytest.fixture
def stage(monkeypatch, tmp_path):
    """Puts a staged validation in place of the steps; returns the path of a campaign file."""
    monkeypatch.setattr(pictures, "FIGURES", {StepNumber.AHC: (drawn,)})
    monkeypatch.setattr("stillhook.validate.data_set.campaign.load_campaign", lambda path: staged().campaign)
    monkeypatch.setattr(report_files, "certificate_files", lambda found, drawn, key: {"certificate.json": b"{}"})
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


def printed(stage, capsys, found, *arguments, code=0):
    stage(found)
    assert command(["validate", "campaign.toml", *arguments, "--verbose"]) == code
    return capsys.readouterr().out


def test_a_person_reads_the_verdict_and_what_decides_it_before_load_cases_steps_and_lines(stage, capsys):
    out = printed(stage, capsys, staged())
    lines = out.splitlines()
    assert lines[0].startswith("SYNTHETIC Sea trial: nov-250t")
    assert lines[1].startswith('PASSED: "nov-250t" as described represents the SYNTHETIC crane of these logs')
    words = (
        "shown     2b  Mean deviation in load case 2: 2.1 cm (1.6 to 2.7 cm), limit at most 5 cm; the far end of the",
        "1 line was judged by the 95 % interval of the value. Consumer's risk: such a line is judged shown in at most",
        "1 line was judged by value",
        "load cases",
        "2313-2315",
        "a gap of 20 s at 412 s",
        "steps",
        "shown: the complete",
    )
    places = [out.index(text) for text in words]
    assert places == sorted(places)
    assert "Deviation by load case" not in out
    assert lines[-1].startswith("every line in full: --all; report, figures and certificate: --out FOLDER; tables")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("value", "low", "high", "words", "never"),
    [
        (
            *(0.0681, 0.0178, 0.12),
            (
                "NOT SHOWN: of 2 criteria of quay version 3, none refuted, but 1 not shown (2b).",
                "NOT SHOWN 2b  Mean deviation in load case 2: 6.81 cm (1.78 to 12 cm), limit at most 5 cm; the far end",
                "which the estimate misses and part of the interval meets",
            ),
            "REFUTED",
        ),
        (
            *(0.068, 0.056, 0.08),
            (
                "REFUTED: of 2 criteria of quay version 3, 1 refuted (2b).",
                "Blocking, highest utilisation of the limit first:\nREFUTED   2b  Mean deviation in load case 2: 6.8 cm",
            ),
            "NOT SHOWN",
        ),
        (
            *(None, 0.016, 0.027),
            (
                "NOT COVERED 2b  Mean deviation: no value; no test has s_tip: log it",
                "not covered: the tests lack the data for this line",
                "1 not covered (2b)",
            ),
            "REFUTED",
        ),
    ],
    ids=["not shown", "refuted", "not covered"],
)
def test_a_line_that_blocks_is_in_capitals_with_its_reason_and_ends_with_exit_code_1(
    stage, capsys, value, low, high, words, never
):
    out = printed(stage, capsys, staged(value, high, low=low), code=1)
    assert all(text in out for text in words), out
    assert never not in out


@pytest.mark.slow
def test_what_agrees_is_in_full_only_where_it_is_wanted(stage, capsys):
    full = (
        "shown     2b  Mean deviation in load case 2: 2.1 cm (95 % interval",
        "the twin errs by less than the crane",
    )
    assert not any(words in printed(stage, capsys, staged()) for words in full)
    out = printed(stage, capsys, staged(), "--all")
    assert all(words in out for words in (*full, "[paper F table 2]"))
    assert "Deviation by load case" not in out


def test_nothing_of_the_text_is_wider_than_a_terminal_of_80_columns(stage, capsys, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", str(TERMINAL))
    stage(staged(None))
    command(["validate", "campaign.toml", "--verbose"])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, (line for line in lines if not line.startswith(("│", "┃", "┏", "┡", "└"))))) <= TERMINAL


def test_single_steps_say_that_there_is_no_certificate_without_the_others(stage, capsys):
    asked = stage(staged(complete=False))
    assert command(["validate", "campaign.toml", "--steps", "0, 5", "--verbose"]) == 0
    assert list(asked["steps"]) == [0, 5]
    out = capsys.readouterr().out
    assert "Only steps 0, 5 were taken: a certificate needs all steps, 0 to 6." in out
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
    assert data["steps"][5]["data"] == {"e_c_pp": [0.1]}
    assert (data["passed"], data["outcome"], data["decisive"]) == (True, "passed", ["2b"])


@pytest.mark.slow
def test_everything_is_written_and_the_page_reads_as_text(stage, capsys, tmp_path):
    out = tmp_path / "out"
    text = printed(stage, capsys, staged(), "--out", str(out))
    names = {"report.html", "summary.json", "segments.csv", "step-5-error-over-time.png", "certificate.json"}
    assert {p.name for p in out.iterdir()} == {*names, "stillhook-manifest.json"}
    assert f"written to {out}: report.html (read this), certificate.json, segments.csv, summary.json, 1 fig" in text
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
        "Control error over time, <all> load cases.",
        "2.1 cm (1.6 to 2.7 cm)",
        "Closest to their limits",
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


@pytest.mark.parametrize("summary", [None, '{"runs": []}'])
def test_a_crane_file_in_the_folder_of_the_results_is_not_written_over(stage, tmp_path, capsys, summary):
    """Nor where numbers of another command lie next to it."""
    stage(staged())
    (tmp_path / "crane.toml").write_text("mine")
    if summary:
        (tmp_path / "summary.json").write_text(summary)
    assert command(["validate", "campaign.toml", "--out", str(tmp_path)]) == 2
    assert 'crane.toml" there is not from an earlier validation' in capsys.readouterr().err
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


@pytest.mark.slow
def test_criteria_of_the_command_line_replace_those_of_the_campaign_and_give_no_certificate(stage, tmp_path, capsys):
    asked = stage(staged())
    command(["validate", "campaign.toml", "--out", str(tmp_path / "out"), "--criteria", "paper-f", "--verbose"])
    assert asked["campaign"].criteria.name == "paper-f"
    assert not (tmp_path / "out" / "certificate.json").exists()
    assert "no certificate with --criteria" in capsys.readouterr().out


def test_a_verdict_without_any_criterion_that_counts_is_no_pass(stage, capsys):
    found = staged(complete=False)
    told = replace(found, lines=tuple(replace(line, judged=False) for line in found.lines))
    assert sentence(told).startswith("NOT ASSESSED")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.toml"], '"nowhere.toml": no such file'),
        (["campaign.toml", "--steps", "7"], '--steps = "7": "7" is not one of 0, 1, 2, 3, 4, 5, 6.'),
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
