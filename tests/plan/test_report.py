"""The report of a plan says what a surveyor must know, in the order in which he reads, and the same bytes for the same results."""

import hashlib
import io
import json
import math
import re
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.image import imsave
from PIL import Image
from tests.plan.made_up import RULES, made_up

from stillhook.cli import run as command
from stillhook.errors import PlanError
from stillhook.plan.file import load_plan
from stillhook.plan.report import document as writing
from stillhook.plan.report import figures as drawing
from stillhook.plan.report.actions import actions
from stillhook.plan.report.decision.status import status_of
from stillhook.plan.report.document import document, marks, save_report
from stillhook.plan.report.figures import answer, depth, figures, limit_tables, pictures
from stillhook.plan.report.limits_summary import verdict
from stillhook.plan.report.words import between, differs, height, named
from stillhook.plan.result import PlanResult, cause, load_plan_result, save_plan
from stillhook.report import kit
from stillhook.report.document import Document, Figure, Table
from stillhook.report.html import html
from stillhook.report.kit import png
from stillhook.report.pdf import pages, pdf
from stillhook.trust.standing import MEANING, UNSIGNED

pytestmark = pytest.mark.slow


def dot() -> bytes:
    image = io.BytesIO()
    imsave(image, np.full((2, 2, 3), 255, np.uint8), format="png")
    return image.getvalue()


DOT = dot()
"""A small picture: stands for a figure where only texts are looked at."""


@pytest.fixture(scope="module")
def result() -> PlanResult:
    return made_up()


@pytest.fixture(scope="module")
def stems(result: PlanResult) -> tuple[str, ...]:
    behind = ("depth", "efficiency", "landing", "convergence")
    return ("claim", "answer", "limits-over-period", "limits-credited", "limits-twin", "waiting-by-month", *behind)


@pytest.fixture(scope="module")
def light(result: PlanResult) -> PlanResult:
    """With two blocks only, which are quick to save."""
    return replace(result, blocks={name: result[name] for name in ("weather", "efficiency")})


@pytest.fixture(scope="module")
def saved(light: PlanResult, tmp_path_factory) -> Path:
    return save_plan(light, tmp_path_factory.mktemp("results") / "plan")


def dots(stems: tuple[str, ...]) -> dict[str, Figure]:
    return {stem: Figure(DOT, f"Of {stem}.") for stem in stems}


def texts(part: object) -> list[str]:
    """Every text of a document, in order."""
    if is_dataclass(part):
        return [t for field in fields(part) for t in texts(getattr(part, field.name))]
    if isinstance(part, list | tuple):
        return [t for value in part for t in texts(value)]
    return [str(part)]


def written(result: PlanResult) -> Document:
    return document(result, {})


def told(result: PlanResult) -> str:
    return "\n".join(texts(written(result)))


def said_of_the_limits(result: PlanResult) -> str:
    return " ".join(verdict(result).text)


def first_table(parts) -> Table:
    return next(part for part in parts if isinstance(part, Table) and part.header)


def of_limits(result: PlanResult) -> Table:
    """The table that the operation is run by."""
    return first_table(written(result).section("Limits, cell by cell").parts)


def test_the_limits_in_words_tell_limit_credit_reference_period_and_forecast_height(result):
    said = said_of_the_limits(result)
    assert re.search(
        r"Credited limit with \S.* Hs [0-9.]+ m to [0-9.]+ m for Tp 5 s to 16 s, waves at 150° to 180°", said
    )
    assert "Simulated limit (not creditable)" in said
    assert "T_POP 24 h, T_C not assessed, so T_R is twice T_POP: T_R 48 h, weather restricted." in said
    assert "alpha 0.76: forecast limit OP_WF Hs" in said
    table = of_limits(result)
    assert table.header[:4] == ("Tp", "150°", "165°", "180°")
    assert len(table.rows) == result.data.sizes["period"]


def test_the_limits_of_the_table_are_those_of_the_result(result):
    table = of_limits(result)
    Hs = result.data["Hs_limit"].sel(credit="credited", alternative="strong-ssc").values
    for k, row in enumerate(table.rows):
        assert [float(x) for x in row[1:4]] == pytest.approx(Hs[:, k], abs=0.005)  # printed with two decimals
        op_wf = result.data["op_wf"].sel(credit="credited", alternative="strong-ssc").values[:, k]
        assert float(row[-1]) == pytest.approx(op_wf[Hs[:, k].argmin()], abs=0.005)


def test_limits_that_the_twin_was_run_for_come_with_their_interval(result):
    table = of_limits(result)
    assert "95 %" not in table.header  # the frequency-domain method has none
    data = result.data.copy(deep=True)
    here = {"credit": "credited", "alternative": "strong-ssc", "period": 8.0}
    data["Hs_limit_low"].loc[here], data["Hs_limit_high"].loc[here] = 1.9, 2.2
    table = of_limits(replace(result, data=data))
    told = [row[table.header.index("95 %")] for row in table.rows]
    assert told == [*["frequency domain"] * 3, "1.90 to 2.20", *["frequency domain"] * 6]
    data["Hs_limit_high"].loc[here] = np.inf
    told = [row[table.header.index("95 %")] for row in of_limits(replace(result, data=data)).rows]
    assert told[3] == f"1.90 to > {data.attrs['Hs_highest']:g}"


def test_what_no_tier_told_is_marked_on_every_page(result):
    remark = cause("not-assessed", phases=["splash zone"], alternatives=["none"])
    odd = replace(result, facts={**result.facts, "remarks": [remark]})
    assert any(mark.startswith("NOT ASSESSED") and "splash zone (none)" in mark for mark in written(odd).marks)


def test_no_number_of_this_machine_stands_in_the_report(result):
    busy = replace(result, facts={**result.facts, "runs": {**result.facts["runs"], "store": "kept-runs"}})
    assert told(busy) == told(result)


def test_where_a_certificate_covers_nothing_is_taken_from_the_twin():
    covered = made_up(certificate=True)
    assert not any(differs(covered, name) for name in covered.data["alternative"].values)
    followed = [{**phase, "compensated": True} for phase in covered.facts["phases"]]
    said = said_of_the_limits(replace(covered, facts={**covered.facts, "phases": followed}))
    assert "Simulated limits: the same (the crane's certificate covers the governing phases)." in said
    assert "not validated" not in told(covered)


def test_credit_that_rests_on_a_certificate_says_who_signed_it_and_what_that_shows(result):
    covered = made_up(certificate=True)
    assert MEANING in verdict(covered).text
    section = written(covered).section("Credit for compensation")
    assert MEANING in texts(section)
    assert "signed by Sea trials (key 0123456789abcdef), trusted by the user's list" in told(covered)
    assert MEANING not in told(result)  # no certificate, nothing to sign


def test_a_certificate_that_nobody_vouches_for_is_marked_on_every_page_and_not_for_approval():
    covered = made_up(certificate=True)
    crane = covered.facts["crane"]
    for signature in (UNSIGNED.to_dict(), None):  # of a version that knew of none
        certificate = {**crane["certificate"], "signature": signature, "synthetic": True}
        found = replace(covered, facts={**covered.facts, "crane": {**crane, "certificate": certificate}})
        assert any(mark.startswith("UNTRUSTED CERTIFICATE: it is unsigned") for mark in marks(found))
        assert "untrusted-certificate" in [reason["code"] for reason in status_of(found, ())["reasons"]]
        assert any(text.startswith("UNTRUSTED CERTIFICATE") for text in verdict(found).text)


def test_a_certificate_is_not_named_for_phases_that_nothing_compensates():
    covered = made_up(certificate=True)
    for phases, said in (
        ((), "no phase is compensated: there is no compensation to credit"),
        (("over-boarding",), "the governing phases are not compensated"),
    ):
        manual = [{**phase, "compensated": phase["name"] in phases} for phase in covered.facts["phases"]]
        told_of = said_of_the_limits(replace(covered, facts={**covered.facts, "phases": manual}))
        assert f"Simulated limits: the same ({said}" in told_of
        assert "certificate covers" not in told_of


def test_without_a_certificate_the_report_says_so_on_every_page(result):
    marks = written(result).marks
    assert any("twin of this crane is not validated" in mark for mark in marks)
    assert "The difference is not credited: the crane has no certificate of validation." in verdict(result).text[1]


def test_synthetic_weather_is_marked_wherever_it_is_used(result, stems):
    page = html(document(result, dots(stems)))
    assert page.index("SYNTHETIC WEATHER") < page.index("OP_LIM")
    assert "made-up-north-sea.csv.gz (SYNTHETIC)" in page
    assert "SYNTHETIC weather, whole year" in verdict(result).text[-1]
    assert "SYNTHETIC" not in told(made_up(synthetic=False, certificate=True))


def test_every_rule_stands_with_its_source_and_the_advice_to_check_it(result):
    section = written(result).section("Rules")
    table = first_table(section.parts)
    assert table.header[-1] == "source"
    assert [row[0] for row in table.rows] == [f"R{i + 1}" for i in range(len(RULES))]
    assert all(rule["standard"] in row[-1] for rule, row in zip(RULES, table.rows, strict=True))


def test_the_order_is_answer_basis_detail_inputs_and_what_is_not_covered(result):
    titles = [re.sub(r"^\d+\. ", "", s.title) for s in written(result).sections]
    wanted = [
        "Operation and phases",
        "Rules",
        "Limits, cell by cell",
        "Weather and waiting",
        "Inputs, versions, seeds",
        "What is not covered",
    ]
    assert [t for t in titles if t in wanted] == wanted


def test_hashes_versions_and_seeds_are_told(result):
    page = told(result)
    for digest in (i["sha256"] for i in result.facts["inputs"]):
        assert digest in page
    for word in ("Stillhook 0.7.0", "0123456789abcdef", "seeds a cell, least and most", "4200"):
        assert word in page


def test_limits_beyond_the_table_none_and_untold_are_told_apart():
    assert [height(x, 4.0) for x in (math.inf, 0.0, math.nan, 2.345)] == ["> 4", "0", "-", "2.35"]


def test_the_closed_form_stands_beside_what_counts(result):
    section = written(result).section("phase by phase")
    rows = first_table(section.parts).rows
    lowering = {row[1]: row[3:] for row in rows if row[0] == "P4 lowering"}
    assert set(lowering) == {"closed-form", "frequency", "time", "credited"}
    own = result.data["Hs_rule"].sel(credit="twin", tier="closed-form", alternative="strong-ssc", phase="lowering")
    assert float(lowering["closed-form"][3]) == pytest.approx(
        float(own.min(["rule", "heading"]).sel(period=8.0)), abs=0.005
    )


def test_ranges_of_limits_say_when_they_run_beyond_what_was_asked():
    assert between(np.array([2.2, math.inf, math.nan]), 4.0) == "2.20 m to above 4 m"
    assert between(np.array([1.5, 1.5]), 4.0) == "1.50 m"
    assert between(np.array([math.nan]), 4.0) == "no result"


def test_a_table_that_tells_nothing_somewhere_does_not_claim_the_best_of_the_rest(result):
    data = result.data.copy(deep=True)
    data["Hs_limit"].loc[{"credit": "credited", "heading": data["heading"][0], "period": 5.0}] = np.nan
    rows = of_limits(replace(result, data=data)).rows
    assert rows[0][1] == "-"
    assert rows[0][4] in ("-", "lowering: capacity")


def test_no_workable_sea_is_said_in_so_many_words(result):
    data = result.data.copy(deep=True)
    data["Hs_limit"][:] = 0.0
    found = verdict(replace(result, data=data))
    assert (found.word, found.passed) == ("NO WORKABLE SEA STATE", False)


@pytest.mark.thorough
def test_pdf_and_page_of_one_result_are_the_same_bytes_after_a_way_over_the_disk(light, stems, saved):
    again = load_plan_result(saved)
    drawn = dots(stems)
    first, second = (document(each, drawn) for each in (light, again))
    assert pdf(second) == pdf(first)
    assert html(second) == html(first)
    assert str(saved) not in html(second)


def test_figures_do_not_follow_the_settings_of_matplotlib(result, monkeypatch):
    one = {"depth": lambda r: depth(r["depth"])}
    monkeypatch.setattr(drawing, "figures", lambda r: {name: draw(r) for name, draw in one.items()})
    plain = pictures(result)
    with mpl.rc_context({"lines.linewidth": 9.0, "font.size": 25.0}):
        assert pictures(result) == plain


@pytest.mark.thorough
def test_every_figure_that_a_report_can_show_is_drawn(result, stems):
    drawn = figures(result)
    assert set(drawn) == set(stems)
    assert len(png(drawn["depth"], 40)) > 1000


def test_many_headings_are_parted_over_several_pictures(result):
    data = result.data.isel(heading=[0] * 12, period=[0, 5]).assign_coords(
        heading=np.radians(np.arange(0.0, 360.0, 30.0))
    )
    many = limit_tables(replace(result, data=data), "credited")
    assert [[ax.get_title(loc="left") for ax in f.axes] for f in many.values()] == [
        ["none"],
        ["80 % cap, HS, SSC, strong SSC"],
        ["NS"],
    ]
    few = limit_tables(result, "twin")
    assert [ax.get_title(loc="left") for ax in few["limits-twin"].axes] == [
        named(n) for n in ("hs", "ssc", "strong-ssc")
    ]


@pytest.mark.parametrize("cut", [{"heading": [1], "period": [4]}, {"alternative": [0]}])
def test_the_smallest_of_plans_has_a_report(result, cut):
    small = made_up(blocks=False)
    small = replace(small, data=small.data.isel(cut))
    names = set(small.data["alternative"].values)
    facts = {**small.facts, "alternatives": [a for a in small.facts["alternatives"] if a["name"] in names]}
    report = document(replace(small, facts=facts), dots(("limits-over-period", "limits-credited")))
    assert pdf(report).startswith(b"%PDF")


def test_of_many_headings_the_table_tells_the_best_and_the_worst(result):
    data = result.data.isel(heading=[0, 1, 2, 2, 2]).assign_coords(
        heading=np.radians([150.0, 165.0, 180.0, 195.0, 210.0])
    )
    table = of_limits(replace(result, data=data))
    assert table.header[:3] == ("Tp", "best heading", "worst heading")
    Hs = data["Hs_limit"].sel(credit="credited", alternative="strong-ssc").values
    assert list(table.rows[0][1:3]) == [f"{Hs[:, 0].max():.2f} (180°)", f"{Hs[:, 0].min():.2f} (150°)"]


def test_how_to_repeat_it_names_tier_and_forecast_table_as_they_were(result):
    quick = replace(result, facts={**result.facts, "tiers": ["closed-form", "frequency"]})
    assert (
        "To repeat: stillhook plan made-up.toml --tier frequency --forecast-factors dnv-os-h101 --out FOLDER, then stillhook report FOLDER."
        in told(quick)
    )


def test_limits_without_a_twin_are_not_said_to_be_its_own(result):
    plain = replace(result, data=result.data.sel(alternative=["none"]))
    assert "No twin is part of this limit." in verdict(plain).text
    closed = replace(result, facts={**result.facts, "tiers": ["closed-form"]})
    assert verdict(closed).text[1].startswith("Not simulated")


def test_a_plan_without_weather_says_that_waiting_is_not_reckoned():
    assert "waiting is not calculated" in told(made_up(blocks=False))


def test_the_page_needs_nothing_from_outside(result, stems):
    page = html(document(result, dots(stems)))
    assert all(source.startswith("data:image/png;base64,") for source in re.findall(r'src="([^"]{0,40})', page))
    assert not re.search(r"<link|<script[^>]|https?://|@import|url\(", page)


def test_the_figure_of_the_limits_names_what_governs_and_boxes_the_worst_heading(result):
    figure = answer(result)
    Hs = result.data["Hs_limit"].sel(credit="credited", alternative="strong-ssc").values
    ax = figure.axes[0]
    boxes = {(round(p.get_y() + 0.45), round(p.get_x() + 0.47)) for p in ax.patches}
    assert boxes == {(int(Hs[:, k].argmin()), k) for k in range(Hs.shape[1])}
    cells = {(round(t.get_position()[1]), round(t.get_position()[0])): t.get_text() for t in ax.texts}
    assert float(cells[0, 0].split("\n")[0]) == pytest.approx(Hs[0, 0], abs=0.005)
    caption = figure.get_label()
    for code in {text.split("\n")[1] for text in cells.values()}:
        assert re.search(rf"{code}: [a-z].*?, [a-z]", caption)


def test_limits_that_are_alike_in_every_cell_are_a_sentence_and_no_figure(result):
    data = result.data.copy(deep=True)
    data["Hs_limit"][:] = 2.0
    flat = replace(result, data=data)
    assert answer(flat) is None
    told_of = texts(document(flat, dots(("depth",))).section("Limits, cell by cell"))
    assert any(text.startswith("In every cell of heading and period the credited limit") for text in told_of)


def test_panels_that_do_not_vary_become_sentences_of_the_caption(result):
    block = result["depth"].copy(deep=True)
    drawn = depth(block)
    assert len(drawn.axes) == 4
    block["DAF"][:] = 1.0
    flat = depth(block)
    assert len(flat.axes) == 3
    assert "Daf" not in flat.get_label()
    assert "DAF: 1.00 at every depth, not drawn." in flat.get_label()


@pytest.mark.thorough
def test_every_figure_has_a_caption_of_its_own(result):
    captions = [figure.get_label() for figure in figures(result).values()]
    assert all(len(caption) > 40 and caption.endswith(".") for caption in captions)
    assert len(set(captions)) == len(captions)


def test_what_to_do_next_follows_from_what_is_missing(result):
    lines = actions(result)
    assert any(line.startswith("Validate the twin by sea trials") for line in lines)
    assert any(line.startswith("Replace the SYNTHETIC weather") for line in lines)
    assert any(line.startswith("Assess the contingency time T_C") for line in lines)
    certain = made_up(synthetic=False, certificate=True)
    known = {**certain.facts, "operation": {**certain.facts["operation"], "T_C": 3600.0}}
    fewer = actions(replace(certain, facts=known))
    assert not any(word in line for line in fewer for word in ("Validate", "SYNTHETIC", "T_C"))
    remark = cause("not-assessed", phases=["splash zone"], alternatives=["none"])
    odd = actions(replace(result, facts={**result.facts, "remarks": [remark]}))
    assert odd[0].startswith("Complete the analysis. NOT ASSESSED")


@pytest.mark.thorough
def test_no_page_between_the_first_and_the_last_is_empty_in_a_third_of_its_height(result):
    """A page of a report on paper is text, table and figure: none waits for a figure of the next one. The first one has
    room above its signature lines."""
    sheets = pages(document(result, pictures(result)), 40.0)
    assert len(sheets) > 5
    for sheet in sheets[1:-1]:
        grey = np.asarray(Image.open(io.BytesIO(sheet)).convert("L"), dtype=int)
        body = grey[int(0.08 * len(grey)) : int(0.92 * len(grey))]
        inked = np.flatnonzero((body < 200).any(axis=1))
        assert np.diff([0, *inked, len(body)]).max() < len(body) / 3


@pytest.mark.long
def test_names_in_any_letters_are_set(result):
    facts = {**result.facts, "name": "模板 <b>to</b> 1500 m & more"}
    odd = replace(result, facts=facts)
    assert pdf(written(odd)).startswith(b"%PDF")
    assert "&lt;b&gt;to&lt;/b&gt;" in html(written(odd))


@pytest.mark.thorough
def test_report_writes_its_files_beside_the_results_or_where_it_is_told(saved, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(writing, "pictures", lambda r: dots(("limits-credited", "depth")))
    monkeypatch.setattr(writing, "pdf", lambda report: b"%PDF")
    assert command(["report", str(saved), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [Path(f).name for f in answer["files"]] == [
        "report.pdf",
        "card.pdf",
        "decision.pdf",
        "report.html",
        "card.json",
        "decision.json",
    ]
    assert all(Path(f).is_file() for f in answer["files"])
    assert answer["answer"].startswith("OP_LIM Hs")
    assert command(["report", str(saved), "--out", str(tmp_path / "other"), "--figures", "--verbose"]) == 0
    assert sorted(p.name for p in (tmp_path / "other").iterdir()) == [
        "card.json",
        "card.pdf",
        "decision.json",
        "decision.pdf",
        "figure-depth.png",
        "figure-limits-credited.png",
        "report.html",
        "report.pdf",
        "stillhook-manifest.json",
    ]
    assert "OP_LIM Hs" in capsys.readouterr().out


def test_a_folder_without_results_is_refused_in_one_line(tmp_path, capsys):
    assert command(["report", str(tmp_path)]) == 2
    error = capsys.readouterr().err.strip()
    assert error.startswith("error: ")
    assert "stillhook plan --out" in error
    assert error.count("\n") == 0


def test_a_report_that_cannot_be_set_leaves_nothing_behind(result, tmp_path, monkeypatch):
    monkeypatch.setattr(writing, "pictures", lambda r: {"depth": Figure(b"no picture", "Of the depth.")})
    with pytest.raises(PlanError, match="cannot be set"):
        save_report(result, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def refused(folder: Path, capsys) -> str:
    """The one line by which the command refuses a folder, which it leaves as it is."""
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert command(["report", str(folder)]) == 2
    error = capsys.readouterr().err.strip().removeprefix("drawing and setting the report ...").strip()
    assert error.startswith("error: ")
    assert error.count("\n") == 0
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    return error


def damaged(saved: Path, folder: Path, *, known: bool = True, numbers=lambda raw: raw, facts=lambda told: told) -> Path:
    """A copy of results with numbers (bytes) or facts changed; known: whether the facts tell the hash of the numbers."""
    folder.mkdir()
    told = json.loads((saved / "plan.json").read_text())
    if not known:
        del told["numbers_sha256"], told["facts_sha256"]
    (folder / "plan.json").write_text(json.dumps(facts(told)))
    (folder / "plan.nc").write_bytes(numbers((saved / "plan.nc").read_bytes()))
    return folder


def turned(raw: bytes, at: int) -> bytes:
    return raw[:at] + bytes([raw[at] ^ 0xFF]) + raw[at + 1 :]


@pytest.mark.thorough
def test_a_turned_byte_anywhere_in_the_numbers_is_refused(saved, tmp_path, capsys):
    size = (saved / "plan.nc").stat().st_size
    for i, at in enumerate(range(0, size, size // 7)):
        folder = damaged(saved, tmp_path / str(i), numbers=lambda raw, at=at: turned(raw, at))
        assert (
            "plan.nc: not as it was written with plan.json: damaged, or of another plan. Run the plan again."
            in refused(folder, capsys)
        )


def test_numbers_that_break_off_are_refused_even_where_no_hash_is_known(saved, tmp_path, capsys):
    for part in (0.0, 0.3, 0.97):
        folder = damaged(
            saved, tmp_path / str(part), known=False, numbers=lambda raw, part=part: raw[: int(part * len(raw))]
        )
        assert "plan.nc: not the numbers of a plan" in refused(folder, capsys)


@pytest.mark.thorough
def test_damage_of_any_kind_in_numbers_without_a_hash_never_ends_in_a_traceback(saved, tmp_path):
    for at in range(0, 4000, 500):
        folder = damaged(saved, tmp_path / str(at), known=False, numbers=lambda raw, at=at: turned(raw, at))
        try:
            load_plan_result(folder)
        except PlanError as e:
            assert "\n" not in str(e)  # noqa: PT017 - some bytes mean nothing: then it is read


@pytest.mark.parametrize(("key", "value"), [("phases", "x"), ("operation", {"T_POP": "8 h"}), ("alternatives", [])])
def test_facts_that_were_changed_are_refused(saved, tmp_path, capsys, key, value):
    changed = damaged(saved, tmp_path / "odd", facts=lambda told: {**told, key: value})
    assert "plan.json: not as it was written: damaged, or changed. Run the plan again." in refused(changed, capsys)


def test_facts_without_a_hash_are_marked_and_their_missing_parts_are_refused(
    saved, stems, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(writing, "pictures", lambda r: dots(stems))
    folder = damaged(saved, tmp_path / "old", known=False)
    assert command(["report", str(folder)]) == 0
    assert "NOT SEALED: plan.json has no hash of its facts" in (folder / "report.html").read_text()
    capsys.readouterr()
    less = damaged(saved, tmp_path / "less", known=False, facts=lambda told: {**told, "rules": None})
    assert "plan.json has no hash, and a part of it is missing or odd" in refused(less, capsys)


@pytest.mark.parametrize(("key", "value"), [("rules", None), ("phases", 1), ("crane", {}), ("remarks", [[1]])])
def test_odd_facts_are_refused_where_their_hash_fits_as_well(saved, stems, tmp_path, capsys, monkeypatch, key, value):
    """Those of another version, or edited with their hash made anew."""
    monkeypatch.setattr(writing, "pictures", lambda r: dots(stems))

    def edited(told: dict) -> dict:
        bare = {name: x for name, x in told.items() if name != "facts_sha256"} | {key: value}
        digest = hashlib.sha256(json.dumps(bare, sort_keys=True).encode()).hexdigest()
        return {**bare, "facts_sha256": digest}

    odd = damaged(saved, tmp_path / "odd", facts=edited)
    assert "is of another version or was edited: a part of it is missing or odd" in refused(odd, capsys)


def test_the_box_tells_the_low_end_of_the_interval_and_what_was_assumed(result):
    data = result.data.copy(deep=True)
    at = {"credit": "credited", "alternative": "strong-ssc", "period": 8.0}
    data["Hs_limit_low"].loc[at] = 1.9
    data["Hs_limit"].loc[{"credit": "credited", "alternative": "none", "period": 5.0}] = 0.8
    weather = result["weather"].assign_attrs(outside=0.34)
    operation = {**result.facts["operation"], "T_POP_given": False}
    odd = replace(
        result, data=data, facts={**result.facts, "operation": operation}, blocks={**result.blocks, "weather": weather}
    )
    said = said_of_the_limits(odd)
    assert (
        "The estimate counts; the low end of its 95 % interval is Hs 1.90 m, in the 3 of 30 cells that have one."
        in said
    )
    assert "T_POP 24 h (not specified: sum of the phases)" in said
    assert re.search(
        r"Without compensation \d+ of 30 cells have no alpha \(below 1 m: case by case\), and so no window: gains compare them by the factor of 1 m",
        said,
    )
    assert "34 % of the records are outside the table's periods and headings and count as not workable." in said
    assert "not given" not in said_of_the_limits(result)


def test_what_is_not_computed_is_told_with_its_reason(result):
    facts = {**result.facts, "not_computed": {"convergence": cause("no-runs")}}
    assert "Not computed in this run: convergence (no runs in the time domain were requested: --tier time)." in told(
        replace(result, facts=facts, blocks={k: v for k, v in result.blocks.items() if k != "convergence"})
    )


def test_a_plan_of_the_library_is_repeated_by_its_name(result):
    assert load_plan("template-to-1500m").source == "template-to-1500m"
    assert "To repeat: stillhook plan template-to-1500m " in told(
        replace(result, facts={**result.facts, "source": "template-to-1500m"})
    )


def test_hours_and_gaps_of_the_record_are_counted_in_whole_numbers(result, stems):
    (counts,) = re.findall(r">([^<>]*) h, ([^<>]*) gaps<", html(document(result, dots(stems))))
    expected = [int(result["weather"][name].values.flat[0]) for name in ("n_hours", "n_gaps")]
    assert [int(re.sub(r"\W", "", count)) for count in counts] == expected


@pytest.mark.long
def test_a_figure_of_strips_may_be_parted_between_two_of_them(result):
    tables = {name: each for name, each in figures(result).items() if name.startswith("limits-credited")}
    drawn = {name: kit.printed({name: each})[name] for name, each in tables.items()}
    assert drawn
    for name, of in drawn.items():
        picture = np.asarray(Image.open(io.BytesIO(of.png)).convert("L"), dtype=int)
        assert len(of.cuts) == len(tables[name].axes) - 1 > 0
        for cut in of.cuts:
            assert (picture[round(cut * len(picture))] == picture.max()).all()  # no letter is cut
