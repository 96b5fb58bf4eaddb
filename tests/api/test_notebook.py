"""What Python and notebooks get: figures and HTML of every result, summary and series apart, codes with their words."""

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread
from tests.commands import answer

import stillhook
from stillhook.base.variable import flags
from stillhook.errors import PlanError, StillhookError
from stillhook.plan.report.checked import Severity, remarks_at_rest
from stillhook.report import kit
from stillhook.report.document import Document, Section, Table, Text
from stillhook.report.html import fragment
from stillhook.validate import Certificate

HOSTILE = '<script>alert("x")</script>&<img src=x onerror=y>'
CRANE = stillhook.load_crane("nov-250t")
CASE = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", duration="30 s", warm_up="10 s")
SEA = stillhook.parse_sea("jonswap Hs=2 m Tp=9 s", heading="180 deg")
LEAST_INK = 0.003
"""Part of the points of a figure that are not white, at least: an empty frame with its axes has fewer."""
VOID = {"img", "br", "meta", "input", "hr"}


@cache
def run() -> Any:
    return stillhook.simulate(CRANE, CASE)


@cache
def runs() -> Any:
    return stillhook.simulate(CRANE, [CASE.with_mode(mode) for mode in ("ns", "ssc")], series=True)


@cache
def lowered() -> Any:
    file = stillhook.load_lift("anchor-to-3000m", duration="200 s")
    return stillhook.simulate(file.crane, file.lift)


@cache
def charted() -> Any:
    return stillhook.analysis.operability_map(CRANE, loads="50 t, 100 t", speeds="20 m/min, 40 m/min, 60 m/min")


@cache
def planned() -> Any:
    return stillhook.plan.plan("template-to-1500m", tier="closed-form")


def ink(figure: Any) -> float:
    """Part of the points of a figure that are not white."""
    points = imread(BytesIO(figure._repr_png_()))[..., :3]
    return float((points.min(axis=-1) < 0.9).mean())


DRAWN: dict[str, Callable[[], Any]] = {
    "run": lambda: stillhook.plot.run(run()),
    "lowering": lambda: stillhook.plot.lowering(lowered()),
    "moments": lambda: stillhook.plot.moments(lowered()),
    "map": lambda: stillhook.plot.map(charted(), "p_max"),
    "change": lambda: stillhook.plot.change(charted()),
    "envelope": lambda: stillhook.plot.envelope(stillhook.analysis.envelope(CRANE, loads="50 t, 100 t, 200 t")),
    "layers": lambda: stillhook.plot.layers(stillhook.analysis.envelope(CRANE, loads="100 t", layers=[1, 6, 12])),
    "settings": lambda: stillhook.plot.settings(stillhook.analysis.setting_curves(CRANE)),
    "bode": lambda: stillhook.plot.bode(CRANE),
    "root_locus": lambda: stillhook.plot.root_locus(CRANE),
    "uncertainty": lambda: stillhook.plot.uncertainty(stillhook.analysis.monte_carlo(CRANE, runs_of_draws(), n=16)),
    "plan": lambda: stillhook.plot.plan(planned(), "limits-credited"),
    "payload": lambda: stillhook.plot.payload(stillhook.read_payload("template-120t")),
    "vessel": lambda: stillhook.plot.vessel(stillhook.read_vessel("supply-vessel-82m"), (10.0, 5.0)),
    "spectrum": lambda: stillhook.plot.spectrum(SEA.trains[0].spectrum),
}


def runs_of_draws() -> list[stillhook.Scenario]:
    return [CASE.with_mode("ssc").model_copy(update={"name": "ssc"})]


@pytest.mark.long
@pytest.mark.parametrize("name", DRAWN)
def test_every_figure_shows_something_in_a_notebook(name: str) -> None:
    assert ink(DRAWN[name]()) > LEAST_INK


def test_a_figure_without_content_would_be_seen() -> None:
    assert ink(kit.canvas(8.0, 6.0)) < LEAST_INK


@pytest.mark.slow
@pytest.mark.parametrize(("data", "labels"), [(run, {"wanted", ""}), (runs, {"wanted", "NS", "SSC"})])
def test_runs_are_labelled_by_what_tells_them_apart(data: Callable[[], Any], labels: set[str]) -> None:
    assert set(data().stillhook.plot().axes[0].get_legend_handles_labels()[1]) <= labels


@pytest.mark.slow
@pytest.mark.parametrize(("data", "words"), [(run, "control error"), (lowered, "tension"), (charted, "load")])
def test_a_dataset_draws_the_figure_of_what_it_is(data: Callable[[], Any], words: str) -> None:
    assert any(words in ax.get_ylabel() for ax in data().stillhook.plot().axes)


@pytest.mark.long
@pytest.mark.parametrize(
    ("draw", "line"),
    [
        (lambda: stillhook.simulate(CRANE, [CASE]).stillhook.plot(), "series=True"),
        (lambda: stillhook.plot.run(stillhook.simulate(CRANE, [CASE] * 9, series=True)), "9 cases"),
        (lambda: stillhook.plot.lowering(lowered(), case=3), "case = 3: the cases are 0 to 0"),
        (lambda: stillhook.plot.map(charted(), "settling"), 'value = "settling": choose one of e_c_pp, eta_c, p_max'),
        (lambda: stillhook.plot.map(run()), "a map is needed"),
        (lambda: stillhook.plot.plan(planned(), HOSTILE), "choose one of claim, answer"),
        (lambda: planned().data.stillhook.plot(), "no figure of this Dataset"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_one_line(draw: Callable[[], Any], line: str) -> None:
    with pytest.raises(StillhookError) as problem:
        draw()
    assert line in str(problem.value)
    assert "\n" not in str(problem.value)


# HTML


class Balanced(HTMLParser):
    """Elements that are open, and everything that is no text."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: set[str] = set()
        self.attributes: set[str] = set()
        self.text = ""

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def parsed(thing: Any) -> Balanced:
    page = Balanced()
    page.feed(thing._repr_html_())
    page.close()
    assert page.open == []
    return page


def hostile_run(*, several: bool) -> Any:
    named = CASE.model_copy(update={"name": HOSTILE})
    crane = CRANE.model_copy(update={"name": HOSTILE, "title": HOSTILE})
    return stillhook.simulate(crane, [named, named.with_mode("hs")] if several else named)


def hostile_certificate() -> Any:
    class Shown(Certificate):
        def summary(self) -> Any:
            return Document(
                HOSTILE, name=HOSTILE, front=[Text(HOSTILE), Table((HOSTILE, "b"), [[HOSTILE, "1"]], HOSTILE)]
            )

    return Shown({})


def hostile_result() -> Any:
    facts = {**planned().facts, "name": HOSTILE, "tiers": [HOSTILE]}
    shown = facts["summary"]["alternatives"]["none"]
    shown = {**shown, "credited": {**shown["credited"], "governs": [{"phase": HOSTILE, "rule": HOSTILE, "cells": 1}]}}
    return replace(planned(), facts=facts | {"summary": {"alternatives": {HOSTILE: shown}}})


def hostile_plan() -> Any:
    return replace(stillhook.load_plan("template-to-1500m"), name=HOSTILE, notes=(HOSTILE,))


SHOWN: dict[str, tuple[Callable[[], Any], str]] = {
    "crane": (lambda: CRANE.model_copy(update={"name": HOSTILE, "title": HOSTILE}), "safe working load"),
    "payload": (
        lambda: stillhook.read_payload("template-120t").model_copy(update={"name": HOSTILE, "title": HOSTILE}),
        "submerged weight in sea water",
    ),
    "scenario": (lambda: CASE.model_copy(update={"name": HOSTILE}), "sine 1 m 12 s"),
    "run": (lambda: hostile_run(several=False).stillhook.summary, "mm"),
    "runs": (lambda: hostile_run(several=True).stillhook.summary, "e_c_pp"),
    "plan": (hostile_plan, "T_POP"),
    "check": (lambda: stillhook.plan.check(hostile_plan()), "severity"),
    "result": (hostile_result, "limiting Hs"),
    "certificate": (hostile_certificate, "alert"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SHOWN)
def test_a_hostile_name_is_shown_and_never_run(name: str) -> None:
    make, words = SHOWN[name]
    page = parsed(make())
    assert words in page.text
    if name != "run":  # one run alone has no name
        assert HOSTILE in page.text
    assert not {"script", "img"} & page.tags
    assert not any(attribute.startswith("on") for attribute in page.attributes)


def test_a_run_shows_its_title_summary_and_dataset_and_escapes_the_crane() -> None:
    text = hostile_run(several=False).stillhook._repr_html_()
    assert "Stillhook run of &lt;script&gt;" in text
    assert HOSTILE not in text
    assert "xarray" in text


def test_a_long_text_is_cut_in_a_table() -> None:
    assert len(parsed(CRANE.model_copy(update={"title": "x" * 5000})).text) < len(parsed(CRANE).text) + 200


def test_a_long_table_is_folded_and_a_short_one_is_not() -> None:
    short, long = ([[str(i), "1"] for i in range(n)] for n in (12, 13))
    assert "<details>" not in fragment(Document("a", front=[Table(("a", "b"), short)]))
    assert "<summary>13 rows</summary>" in fragment(Document("a", front=[Section("s", [Table(("a", "b"), long)])]))


# Summary and series


def test_summary_and_series_share_the_variables_of_a_run_and_change_none() -> None:
    summary, series = run().stillhook.summary, run().stillhook.series
    assert set(summary) | set(map(str, series.data_vars)) == set(map(str, run().data_vars))
    assert not set(summary) & set(map(str, series.data_vars))
    assert all("time" in x.dims for x in series.data_vars.values())
    assert all(summary[name] == run()[name].item() or np.isnan(summary[name]) for name in summary)
    assert summary.unit("e_c_pp") == "m"
    assert "peak-to-peak" in summary.meaning("e_c_pp")
    assert f"{1e3 * summary['e_c_pp']:.1f} mm" in repr(summary)


def test_a_summary_of_many_cases_has_arrays_and_says_how_many_it_leaves_out() -> None:
    many = stillhook.simulate(CRANE, [CASE] * 25)
    assert many.stillhook.summary["e_c_pp"].shape == (25,)
    assert repr(many.stillhook.summary).endswith("and 5 more cases")
    assert "and 5 more cases" in parsed(many.stillhook.summary).text


def test_names_that_are_shown_are_those_that_there_are() -> None:
    stub = Path(stillhook.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    assert dir(stillhook) == sorted(line.rpartition(" as ")[2] for line in stub.splitlines())
    assert all(getattr(stillhook, name) is not None for name in dir(stillhook))
    assert dir(run().stillhook) == ["plot", "series", "summary"]
    assert all(hasattr(run().stillhook, name) for name in dir(run().stillhook))
    assert dir(stillhook.metrics) == sorted(stillhook.metrics.__all__)


@pytest.mark.long
@pytest.mark.parametrize("order", ["import xarray, stillhook", "import stillhook, xarray"])
def test_run_stillhook_is_there_whichever_is_imported_first_and_costs_nothing(order: str) -> None:
    heavy = '{"stillhook.variables", "stillhook.report.formatting", "matplotlib", "pydantic"}'
    code = f'{order}; import sys; print(hasattr(xarray.Dataset, "stillhook"), {heavy} & set(sys.modules))'
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-W", "error", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.split(maxsplit=1) == ["True", "set()\n"]


# Codes


@pytest.mark.parametrize("name", ["mode", "brake"])
def test_a_coded_signal_says_the_word_of_every_value_it_takes(name: str) -> None:
    signal = run()[name]
    words = dict(zip(signal.flag_values, signal.flag_meanings.split(), strict=True))
    assert {words[value] for value in np.unique(signal.values)} <= {"ssc", "open", "closed", "manual"}


@pytest.mark.long
def test_phases_of_a_lowering_are_named_by_their_code_and_survive_a_file(tmp_path: Path) -> None:
    signal = stillhook.load_run(stillhook.save_run(lowered(), tmp_path / "run.nc"))["phase_number"]
    words = [word.replace("_", " ") for word in signal.flag_meanings.split()]
    assert words == list(lowered()["phase"].values)
    assert list(signal.flag_values) == list(range(len(words)))


@pytest.mark.parametrize(
    ("meaning", "words"),
    [
        ("holding brake: 0 open, 1 closed", "open closed"),
        ("sum of 1 late, 2 stale input", "late stale_input"),
        ("highest sling tension; 0 where they never went slack", None),
        ("direction in which waves travel: 0 following, pi/2 from starboard", None),
        ("peak-to-peak over 30 s", None),
    ],
)
def test_only_a_list_of_codes_is_taken_for_one(meaning: str, words: str | None) -> None:
    assert flags(meaning).get("flag_meanings") == words
    assert ("flag_masks" in flags(meaning)) == meaning.startswith("sum of")


# The check of a plan


@pytest.mark.long
def test_the_check_of_a_plan_has_its_remarks_as_codes_with_severity_place_and_text(
    capsys: pytest.CaptureFixture[str],
) -> None:
    check = stillhook.plan.check("template-to-1500m")
    assert check.possible
    assert [(r.code, r.severity.value) for r in check.remarks[:2]] == [
        ("steep-seas", "warning"),
        ("resonance", "warning"),
    ]
    assert all(r.place and r.text for r in check.remarks)
    printed = answer(capsys, "plan", "template-to-1500m", "--check")
    assert printed["remarks"] == [dict(r._asdict()) for r in check.remarks]


@pytest.mark.long
def test_a_lift_that_is_never_possible_is_an_error_with_its_phases_and_rule() -> None:
    facts = stillhook.plan.check("template-to-1500m").facts
    row = {"phase": "landing", "rule": "static-load", "quantity": "F_w_max", "value": 2e6, "limit": 1e6, "basis": "SWL"}
    every = [{**row, "alternatives": list(facts["alternatives"])}]
    some = [{**row, "alternatives": list(facts["alternatives"])[:1]}]
    (error,), (warning,) = (list(remarks_at_rest({**facts, "beyond": beyond})) for beyond in (every, some))
    assert (error.code, error.severity, warning.severity) == ("beyond-at-rest", Severity.ERROR, Severity.WARNING)
    assert error.place == 'landing: rule "static-load"'
    assert error.text.startswith("NOT POSSIBLE in any sea with any alternative")


def test_a_plan_that_does_not_exist_is_refused_in_one_line() -> None:
    with pytest.raises(PlanError, match="template-to-1500m"):
        stillhook.plan.check("no-such-plan")
