"""The certificate as a document: the same bytes from the same inputs, what it says, and what a validation that was not passed gets."""

import io
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.validate.staged_certificate import drawn, staged, write

from stillhook import load_crane
from stillhook.base.kept.sealed import canonical, digest_of
from stillhook.errors import ValidateError
from stillhook.kernels.build import results_hash
from stillhook.report.document import Bullets, Figure, Table, Text
from stillhook.report.pdf import pages
from stillhook.spec.crane import content
from stillhook.validate import Certificate, certificate_files, certificate_of, load_certificate
from stillhook.validate.certificate.content import content_of
from stillhook.validate.certificate.document import annex, document
from stillhook.validate.certificate.utilisation import most_used
from stillhook.validate.criteria.results import StepNumber
from stillhook.validate.report import figures as pictures_of
from stillhook.validate.report.figures import pictures

ROOT = Path(__file__).resolve().parents[2]
NOT_SHOWN = {"e_c_pp_deviation": None}
TOO_MUCH = {"e_c_pp_deviation": 0.31}
WARNING = (0x8A, 0x4B, 0x00)  # colour of the mark on synthetic data
HEADER = slice(0, 90)  # rows of a page at 80 dots per inch above its text
ELSEWHERE = """
import sys
from pathlib import Path
from types import SimpleNamespace
sys.path.insert(0, {root!r})
from stillhook.validate import certificate_files
from stillhook.validate.criteria.results import StepNumber
from stillhook.validate.report import figures
from tests.validate.staged_certificate import drawn, staged, write
figures.FIGURES = {{StepNumber.AHC: (drawn,)}}
here = Path.cwd()
for name, content in certificate_files(staged(write(here / "tests", order="21"))).items():
    (here / name).write_bytes(content)
"""


@pytest.fixture
def campaign(tmp_path: Path, monkeypatch) -> Path:
    monkeypatch.setattr(pictures_of, "FIGURES", {StepNumber.AHC: (drawn,)})
    return write(tmp_path / "trial")


@pytest.mark.thorough
def test_both_files_are_the_same_to_the_byte_in_another_folder_process_locale_and_time_zone(campaign, tmp_path):
    here = certificate_files(staged(campaign))
    other = tmp_path / "elsewhere"
    other.mkdir()
    (other / "matplotlibrc").write_text("lines.linewidth: 9\nfont.size: 20\nsvg.fonttype: none\n")
    odd = {
        "TZ": "Asia/Tokyo",
        "LC_ALL": "de_DE.UTF-8",
        "LANG": "de_DE.UTF-8",
        "PYTHONHASHSEED": "7",
        "SOURCE_DATE_EPOCH": "86400",
        "OMP_NUM_THREADS": "1",
    }
    code = ELSEWHERE.format(root=str(ROOT))
    done = subprocess.run([sys.executable, "-c", code], cwd=other, env=os.environ | odd, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert sorted(here) == ["certificate-annex.pdf", "certificate.json", "certificate.pdf", "crane.toml"]
    for name, data in here.items():
        assert (other / name).read_bytes() == data, name
        assert str(tmp_path).encode() not in data, f"{name} names a folder of this machine"


@pytest.mark.slow
def test_a_certificate_has_twelve_pages_at_most_and_its_annex_has_the_rest(campaign):
    """One of 50 pages was printed and not read. Of lines that are shown it has the figure; what they rest on is in the annex."""
    for found in ({}, TOO_MUCH, NOT_SHOWN):
        data = certificate_of(staged(campaign, **found)).data
        main, rest = document(data), annex(data, {})
        assert len(pages(main, 30.0)) <= 12
        titles = [part.title for part in rest.sections]
        assert {f"Step {s['step']}: {s['title']}" for s in data["steps"]} <= set(titles)
        assert any("crane file" in title for title in titles)
        rows = [row for part in main.parts if isinstance(part, Table) for row in part.rows]
        assert {line["key"] for line in data["lines"]} <= {row[0] for row in rows if isinstance(row[0], str)}


@pytest.mark.slow
def test_a_certificate_of_many_tests_keeps_twelve_pages_and_its_annex_lists_every_one(campaign):
    data = certificate_of(staged(campaign)).data
    n = 200
    cases = [[f"t{i}", *data["load_cases"]["rows"][0][1:]] for i in range(n)]
    logs = [{**data["campaign"]["logs"][0], "test": f"t{i}", "sha256": f"{i:064x}"} for i in range(n)]
    tests = [{**data["data"][0], "test": f"t{i}", "file": f"logs/t{i}.csv"} for i in range(n)]
    many = {
        **data,
        "data": tests,
        "load_cases": {**data["load_cases"], "rows": cases},
        "campaign": {**data["campaign"], "logs": logs},
    }
    main, rest = document(many), annex(many, {})
    assert len(pages(main, 30.0)) <= 12
    rows = [row for part in rest.section("E: the data").parts if isinstance(part, Table) for row in part.rows]
    assert {log["sha256"] for log in logs} <= {row[1] for row in rows}
    assert {test["file"] for test in tests} <= {row[2] for row in rows if len(row) > 2}
    last = next(part for part in rest.section("Load cases").parts if isinstance(part, Table))
    assert [row[0] for row in last.rows] == [f"t{i}" for i in range(n)]
    text = " ".join(part.text for part in main.parts if isinstance(part, Text))
    assert "20 of 200 logs and 20 of 200 load cases; annex E has all of them." in text
    assert not any(part.title.startswith("E:") for part in annex(data, {}).sections)


def test_the_first_page_of_a_certificate_shows_how_much_of_its_limits_the_twin_uses(campaign):
    data = certificate_of(staged(campaign)).data
    lines = most_used(data)
    used = [line["used"] for line in lines]
    assert used == sorted(used, reverse=True)
    assert all(line["judged"] and line["step"] > 0 for line in lines)
    figures = [part for part in document(data).front if isinstance(part, Figure)]
    assert [f"the {len(lines)} judged lines" in figure.caption for figure in figures] == [True]
    assert len(pages(replace(document(data), sections=[]), 30.0)) == 1


def test_a_certificate_explains_the_three_kinds_of_line_in_a_sentence_each(campaign):
    text = " ".join(
        line
        for part in document(certificate_of(staged(campaign)).data).parts
        if isinstance(part, Bullets)
        for line in part.lines
    )
    for kind in ("required: ", "supporting: it blocks the certificate if its estimate is outside", "information: "):
        assert text.count(kind) == 1
    assert "not to be refuted" not in text


@pytest.mark.slow
def test_a_certificate_reads_back_as_it_was_written(campaign, tmp_path):
    made = certificate_of(staged(campaign))
    path = tmp_path / "certificate.json"
    path.write_text(made.text(), encoding="utf-8")
    assert load_certificate(path) == made
    assert made.digest == digest_of(made.data)


@pytest.mark.slow
def test_it_says_what_it_rests_on(campaign, tmp_path):
    data = certificate_of(staged(campaign)).data
    assert data["date"] == "2026-11-21"
    assert data["campaign"]["file"] == "campaign.toml"
    assert [log["file"] for log in data["campaign"]["logs"]] == ["logs/1.csv", "logs/2.csv"]
    assert all(len(log["sha256"]) == 64 for log in (*data["campaign"]["logs"], data["campaign"]))
    assert [d["samples"] for d in data["data"]] == [4000, 4000]
    assert data["crane"]["content"] == content(load_crane("nov-250t"))
    assert data["twin"]["code"] == results_hash()
    assert data["criteria"]["name"] == "paper-f"
    assert {c["key"] for c in data["criteria"]["criteria"]} == {line["key"] for line in data["lines"]}
    assert [s["step"] for s in data["steps"]] == [0, 1, 2, 3, 4, 5, 6]


@pytest.mark.slow
def test_it_covers_what_the_stretches_of_step_5_covered_and_no_more(campaign, tmp_path):
    envelope = certificate_of(staged(campaign)).short.envelope
    assert envelope is not None
    assert envelope.load == (82e3, 164e3)
    assert envelope.s_w == pytest.approx((486.0, 2314.4))
    assert envelope.s_tip_pp == pytest.approx(
        (0.8, 2.0), rel=0.01
    )  # amplitudes 0.4 m and 1 m; step 0 meets a crest within 1 %
    assert envelope.period == pytest.approx((8.0, 11.0), abs=1e-3)
    assert envelope.modes == ("ns", "ssc")


@pytest.mark.slow
def test_a_validation_that_was_not_passed_gets_a_document_that_certifies_nothing(campaign):
    files = certificate_files(staged(campaign, **TOO_MUCH))
    assert sorted(files) == ["not-passed-annex.pdf", "not-passed.json", "not-passed.pdf"]
    data = json.loads(files["not-passed.json"])
    assert (data["passed"], data["envelope"], data["outcome"]) == (False, None, "refuted")
    assert data["verdict"].startswith("REFUTED")
    passed, failed = (certificate_of(staged(campaign, **found)).short for found in ({}, TOO_MUCH))
    assert (passed.level, passed.variant, failed.level, failed.variant) == (2, 2, 1, 1)  # of table 2.7


def test_criteria_of_which_none_counts_certify_nothing(campaign, tmp_path):
    (campaign.parent / "lax.toml").write_text(
        'version = "1"\n[settings]\nwindow = "30 s"\neta_above = "1 m"\nlayers_apart = 1\nload_apart = "10 %"\n'
        '[[criterion]]\nkey = "2b"\nstep = 5\ntitle = "Mean deviation"\nmeasure = "e_c_pp_deviation"\nat_most = "5 cm"\nneeded = false\n'
    )
    campaign.write_text(campaign.read_text().replace("synthetic", 'criteria = "lax.toml"\nsynthetic'))
    data = certificate_of(staged(campaign, **NOT_SHOWN)).data
    assert data["passed"] is False
    assert data["verdict"].startswith("NOT ASSESSED: no criterion of lax version 1 counts on these data")
    assert certificate_of(staged(campaign)).passed


def test_a_twin_that_never_compensated_is_validated_for_nothing(campaign, tmp_path):
    text = campaign.read_text().replace('kind = "ahc"', 'kind = "limits"')
    campaign.write_text(text)
    data = certificate_of(staged(campaign)).data
    assert data["passed"] is False
    assert data["verdict"].startswith("NOT SHOWN: no part of the logs with heave compensation could be compared")


def test_what_the_data_cannot_tell_is_among_the_limitations(campaign, tmp_path):
    data = certificate_of(staged(campaign, **NOT_SHOWN)).data
    told = {part["heading"]: part["lines"] for part in data["limitations"]}
    assert any(line.startswith("2b (blocks the certificate)") for line in told["Not covered by the tests"])
    assert "Synthetic data" in told


def test_what_was_logged_and_not_judged_is_among_the_limitations(campaign, tmp_path):
    made = staged(campaign)
    records = tuple(
        replace(r, signals={**r.signals, "p_hp": r.signals["s_tip"], "f_pump": r.signals["s_tip"]})
        for r in made.records
    )
    data = content_of(replace(made, records=records))
    assert data["unjudged"] == {"f_pump": ["1", "2"]}
    found = {part["heading"]: part["lines"] for part in data["limitations"]}
    assert found["Logged, not judged"] == ["f_pump in every test"]


def test_only_all_steps_make_a_certificate(campaign, tmp_path):
    with pytest.raises(ValidateError, match="only some of the steps 0 to 6 were taken"):
        certificate_of(staged(campaign, complete=False))


def test_numbers_that_are_none_do_not_stop_it(campaign, tmp_path):
    data = certificate_of(staged(campaign, e_c_correlation=np.float64("nan"))).data
    measure = next(line["measure"] for line in data["lines"] if line["key"] == "2d-correlation")
    assert measure["value"] is None


def _marked(page: bytes) -> bool:
    """Whether the header of a page holds the mark on synthetic data."""
    pixels = np.asarray(Image.open(io.BytesIO(page)).convert("RGB"))[HEADER].astype(int)
    return bool((np.abs(pixels - WARNING).max(axis=-1) < 8).any())


@pytest.mark.thorough
@pytest.mark.parametrize("synthetic", [True, False])
def test_every_page_of_a_synthetic_certificate_says_so_and_no_page_of_another(tmp_path, monkeypatch, synthetic):
    monkeypatch.setattr(pictures_of, "FIGURES", {StepNumber.AHC: (drawn,)})
    found = staged(write(tmp_path, synthetic=synthetic))
    data = certificate_of(found).data
    made = (document(data), annex(data, pictures(found)))
    marks = [_marked(page) for one in made for page in pages(one, 80.0)]
    assert len(marks) > 5
    assert all(marks) if synthetic else not any(marks)


@pytest.mark.slow
def test_names_that_typst_could_take_for_markup_stay_as_they_are(campaign, tmp_path):
    text = campaign.read_text()
    campaign.write_text(text.replace('"Sea trial"', '"#1 *sea* $trial$ @ 30° <50 %> [x] Åsgård \\\\ _e_"'))
    made = certificate_of(staged(campaign))
    assert made.pdf().startswith(b"%PDF")


@pytest.mark.long
def test_letters_that_the_fonts_lack_do_not_stop_it(campaign, tmp_path):
    campaign.write_text(campaign.read_text().replace('"Sea trial"', '"海上試験"'), encoding="utf-8")
    made = certificate_of(staged(campaign))
    assert made.pdf() == made.pdf()
    assert "海上試験" in made.text()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda t: t.replace('"passed": false', '"passed": true'), "was changed after it was written"),
        (lambda t: t[: len(t) // 2], "not a certificate"),
        (lambda t: "[1, 2]", "JSON, but not a certificate"),
        (lambda t: t.replace("certificate 4", "certificate 9"), 'this Stillhook reads "stillhook certificate 4"'),
        (lambda t: "", "not a certificate"),
    ],
)
def test_a_damaged_file_is_refused_in_one_line(campaign, tmp_path, change, text):
    path = tmp_path / "not-passed.json"
    path.write_text(change(certificate_of(staged(campaign, **TOO_MUCH)).text()), encoding="utf-8")
    with pytest.raises(ValidateError, match=text) as problem:
        load_certificate(path)
    assert "\n" not in str(problem.value)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("place", "value"),
    [
        ("campaign", None),
        ("twin", []),
        ("lines", [5]),
        ("passed", "yes"),
        ("data", [{"duration": "long"}]),
        ("crane", {}),
        ("date", 5),
    ],
)
def test_what_lacks_a_part_is_no_certificate_even_where_its_digest_fits(campaign, tmp_path, place, value):
    data = {**certificate_of(staged(campaign)).data, place: value}
    path = tmp_path / "certificate.json"
    path.write_text(canonical({**data, "digest": digest_of(data)}), encoding="utf-8")
    with pytest.raises(ValidateError, match=rf"certificate\.json: not a complete certificate \({place}") as problem:
        load_certificate(path)
    assert "\n" not in str(problem.value)


def test_a_certificate_is_its_data():
    assert Certificate({"digest": "a", "passed": True}).name == "certificate.json"
    assert Certificate({"digest": "a", "passed": False}).name == "not-passed.json"
