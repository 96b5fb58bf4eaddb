"""One document gives the same texts on a terminal, as a page and on paper; nothing in it is taken for markup."""

import base64
import hashlib
import io
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread, imsave

from stillhook.report import kit
from stillhook.report.document import Bullets, Column, Document, Figure, Section, Table, Text, Verdict, facts
from stillhook.report.formatting import cell, change, days, direction, fixed, fmt, groups, hours, percent, percent_fixed
from stillhook.report.html import html
from stillhook.report.pdf import Unset, pages, pdf
from stillhook.report.terminal import print_document


def dot() -> bytes:
    image = io.BytesIO()
    imsave(image, np.full((2, 2, 3), 255, np.uint8), format="png")
    return image.getvalue()


LIMITS = Table(
    ("criterion", "para-\nmeters", "limit\n[cm]", "verdict"),
    [("2b", "12", "within +-5", Verdict("REFUTED", passed=False)), ("2c", "3", "1.5", Verdict("shown", passed=True))],
    "Limits of <step> 5",
)
DOCUMENT = Document(
    title="Report",
    name="crane & twin",
    subtitle="250 t",
    marks=["SYNTHETIC: simulated"],
    front=[Verdict("NOT SHOWN", passed=False, text=["One line is refuted."])],
    sections=[
        Section("1. Limits", [LIMITS, Section("Notes", [Bullets(["first [b]", "second"]), Text("A paragraph.")])]),
        Section("2. Inputs", [facts([("crane", "nov-250t")], "Files"), Figure(dot(), "A picture.")]),
    ],
    signatures=("Prepared by",),
    number="0123",
    date="2026-11-21",
)
TEXTS = (
    "250 t",
    "SYNTHETIC: simulated",
    "NOT SHOWN",
    "One line is refuted.",
    "1. Limits",
    "Notes",
    "second",
    "A paragraph.",
)


def test_every_text_is_on_the_terminal(capsys):
    print_document(DOCUMENT)
    out = capsys.readouterr().out
    assert out.startswith("Report: crane & twin\n")
    for text in (*TEXTS, "Limits of <step> 5", "- first [b]", "REFUTED", "Files:", "crane: nov-250t"):
        assert text in out


def test_every_text_is_on_the_page_and_none_is_markup():
    page = html(DOCUMENT)
    for text in (*TEXTS, "Limits of &lt;step&gt; 5", "parameters", "limit [cm]", "within ±5", "crane &amp; twin"):
        assert text in page
    assert '<span class="no">REFUTED</span>' in page
    assert '<span class="yes">shown</span>' in page
    assert [int(level) for level in re.findall(r"<h(\d)>", page)] == [1, 2, 3, 3, 2, 3]
    assert page.count("<img") == 1


def test_contents_beside_the_text_lead_to_every_section():
    page = html(DOCUMENT)
    contents = page[page.index("<nav") : page.index("</nav>")]
    links = re.findall(r'<a href="#([^"]+)">([^<]+)</a>', contents)
    assert [title for _, title in links] == ["Report", "1. Limits", "Notes", "2. Inputs"]
    anchors = re.findall(r'<section id="([^"]+)">', page)
    assert [anchor for anchor, _ in links] == anchors
    assert len(set(anchors)) == len(anchors)


def test_a_page_runs_no_script_but_its_own_and_loads_nothing():
    """A text that looks like markup stays a text; even if it did not, the policy of the page names its script alone."""
    hostile = "</style><script>alert(1)</script><img src=x onerror=alert(2)> \"' \\1 \\g<0>"
    sections = [Section(hostile, [Figure(dot(), hostile), Text(hostile), Bullets([hostile])])]
    page = html(replace(DOCUMENT, title=hostile, name=hostile, marks=[hostile], sections=sections))
    scripts = re.findall(r"<script[^>]*>(.*?)</script>", page, re.DOTALL)
    assert len(scripts) == 1
    assert f"'sha256-{base64.b64encode(hashlib.sha256(scripts[0].encode()).digest()).decode()}'" in page
    assert "default-src 'none'" in page
    assert "onerror=alert(2)>" not in page
    assert not re.search(r"<link|https?://|@import|url\(", page)


def test_lines_of_a_figure_are_part_of_the_page_and_follow_its_colours():
    hostile = "<b>&amp; -->\\1</b>"

    def draw() -> Figure:
        figure, ax = kit.panel((3.0, 2.0))
        ax.plot([0.0, 1.0], [0.0, 1.0], label=hostile)
        kit.axis(ax, hostile, hostile)
        kit.legend(ax)
        return kit.printed({"one": kit.caption(figure, hostile)})["one"]

    drawn = draw()
    assert drawn == draw()
    page = html(Document("Report", [Section("Figures", [drawn])]))
    image = page[page.index("<svg") : page.index("</svg>")]
    assert "<b>" not in image
    assert image.count("&lt;b&gt;") >= 4  # axes, legend, and the label for those who cannot see it
    assert "currentColor" in image
    assert "#000000" not in image
    assert not re.search(r"xmlns|<metadata|<!--|<\?xml", image)


def test_what_does_not_vary_is_no_panel():
    assert kit.varies([1.0, 1.02])
    assert not kit.varies([1.0, 1.002], [0.5, 0.5], [np.nan, np.nan])
    assert not kit.varies([0.0, 0.0], [])


@pytest.mark.slow
def test_paper_is_the_same_bytes_every_time():
    assert pdf(DOCUMENT) == pdf(DOCUMENT)
    assert len(pages(DOCUMENT, 20.0)) == 2  # the first page ends with its signatures


@pytest.mark.long
def test_a_figure_stays_in_its_section_where_its_page_has_no_room_for_it():
    """A red picture too tall for what is left of its page, between verdicts whose frames have their own colours."""
    colours = {"failed": (0x9B, 0x1C, 0x1C), "red": (255, 0, 0), "passed": (0x1B, 0x5E, 0x20)}
    image = io.BytesIO()
    imsave(image, np.full((50, 70, 3), colours["red"], np.uint8), format="png")
    before, after = (Verdict("verdict", passed=passed, text=["a line"]) for passed in (False, True))
    first = Section("A", [Bullets(["a line"] * 30), before, Figure(image.getvalue(), "red")])
    paper = [imread(io.BytesIO(page)) for page in pages(Document("x", [first, Section("B", [after])]), 150.0)]
    pixels = np.concatenate([page[..., :3] for page in paper])
    rows = {
        name: np.flatnonzero((np.abs(pixels - np.array(colour) / 255.0) < 0.02).all(axis=2).any(axis=1))
        for name, colour in colours.items()
    }
    assert len(paper) == 2
    assert rows["failed"].max() < rows["red"].min()
    assert rows["red"].max() < rows["passed"].min()


def test_a_picture_that_cannot_be_read_is_refused():
    with pytest.raises(Unset, match="cannot be set"):
        pdf(replace(DOCUMENT, sections=[Section("Figures", [Figure(b"none", "")])]))


def test_a_section_is_found_by_the_end_of_its_title():
    assert DOCUMENT.section("Notes").parts[0] == Bullets(["first [b]", "second"])


@pytest.mark.parametrize(
    ("cells", "kind"),
    [
        (["1.5", "-", "> 4", "", "-0.208 to 0.3 %", "any"], Column.NUMBER),
        (["56.2 % (39.3 % to 71.8 %)"], Column.NUMBER),
        (["manual", "ns"], Column.WORD),
        (["2 load cases, 740 s, 71 effective windows"], Column.TEXT),
        (["the load on its wire is in resonance"], Column.TEXT),
        ([Verdict("shown")], Column.WORD),
    ],
)
def test_columns_are_aligned_by_what_they_hold(cells, kind):
    assert Table(("", "x"), [("a", x) for x in cells]).kinds == (Column.WORD, kind)


def test_numbers_are_written_in_one_way_and_missing_ones_are_dashes():
    assert [fmt(x, "pressure") for x in (2.5e7, math.nan, None)] == ["250 bar", "-", "-"]
    assert [fmt(1234.5678), fmt(0.0)] == ["1235", "0"]
    assert [percent(0.12345), percent(1e-9), percent(math.nan)] == ["12.3 %", "0 %", "-"]
    assert [percent_fixed(0.5), percent_fixed(0.5, 0), change(-0.05), change(0.1, 0)] == [
        "50.00 %",
        "50 %",
        "-5.0 %",
        "+10 %",
    ]
    assert [fixed(-0.001, 1), fixed(None, 1)] == ["0.0", "-"]
    assert [hours(5400.0), days(86400.0), days(864000.0), days(math.inf)] == ["1.5 h", "24 h", "10 d", "-"]
    assert [direction(math.pi), groups("0123456789", 6)] == ["180°", "0123 45"]
    assert [
        cell("e_c_pp", 0.1234),
        cell("e_c_pp", 2.5),
        cell("eta_c", 0.9876),
        cell("p_max", 2e7),
        cell("status", "ok"),
    ] == [
        "123.4 mm",
        "2.5 m",
        "98.8 %",
        "200 bar",
        "ok",
    ]


@pytest.mark.slow
def test_texts_of_files_are_no_formulae_in_pictures_and_powers_of_ten_are():
    figure, ax = kit.panel((3.0, 2.0), "crane $x_{$")
    ax.semilogx([1e3, 1e6], [0.0, 1.0], label=r"cost $\oops$")
    kit.axis(ax, x="from $5 to $6")
    kit.legend(ax)
    drawn = kit.svg(figure)
    assert kit.png(figure).startswith(b"\x89PNG")
    for text in ("crane $x_{$", r"cost $\oops$", "from $5 to $6"):
        assert f">{text}<" in drawn
    assert "mathdefault" not in re.sub("<!--.*?-->", "", drawn, flags=re.DOTALL)
