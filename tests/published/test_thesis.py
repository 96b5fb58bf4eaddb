"""The figures and tables of the thesis: every one is listed, and what is listed as drawn is drawn, with its numbers."""

import csv
import io
import json
import re
from collections import Counter

import numpy as np
import pytest
from tests.commands import refusal
from tests.scripts import PAGES

from stillhook.cli import run
from stillhook.errors import CommandError
from stillhook.thesis import components, losses, quay
from stillhook.thesis.gallery import STATES, drawing, item, items

FIGURES = {"1": 13, "2": 37, "A": 11, "C": 18, "D": 23, "E": 26, "F": 13}
TABLES = {"1": 2, "2": 8, "A": 1, "C": 1, "D": 5, "E": 2, "F": 3}
"""How many the thesis has, by chapter and paper, numbered from 1 on."""
DRAWN = {one.function: one.number for one in items().values() if one.function}


def names(table: str, counts: dict[str, int]) -> set[str]:
    return {
        f"{table}{part}.{i}" if part.isdigit() else f"{part}{table}{i}"
        for part, n in counts.items()
        for i in range(1, n + 1)
    }


def test_every_figure_and_table_is_listed_once():
    assert set(items()) == names("", FIGURES) | names("T", TABLES)
    assert len({one.caption for one in items().values() if one.state == "drawn"}) > 50


@pytest.mark.parametrize("one", items().values(), ids=lambda one: one.number)
def test_an_item_says_what_it_is(one):
    assert one.state in STATES
    assert one.caption
    assert bool(one.function) == (one.state in ("drawn", "numbers", "circuit"))
    assert one.missing or one.state != "no data"
    assert not one.page or (PAGES / one.page).is_file()
    assert not one.differs or one.page in {path.name for path in PAGES.glob("*.md")}


@pytest.mark.thorough
@pytest.mark.parametrize("function", DRAWN)
def test_every_drawing_has_numbers_and_a_picture(function):
    one = drawing(DRAWN[function])
    assert one.title
    assert one.svg.startswith("<") or one.data()
    for table in one.data().values():
        rows = list(csv.reader(io.StringIO(table.csv())))
        assert len(rows) > 1
        assert {len(row) for row in rows} == {len(table.head)}
    if one.pictured:
        assert one.figure().axes


@pytest.mark.slow
@pytest.mark.parametrize("number", ["2.11", "2.16", "E13", "C13", "D8", "E15"])
def test_data_are_the_curves_in_si(number):
    one = drawing(number)
    for panel, table in zip(one.panels, one.data().values(), strict=True):
        for curve in panel.curves:
            y = np.array([row[2] for row in table.rows if row[0] == curve.label])
            np.testing.assert_array_equal(y, curve.y)
        assert re.fullmatch(r".+ \[(m|s|rad/s|N m|m/s|Pa|m\^3/rad|-)\]", table.head[2])


@pytest.mark.parametrize(("table", "n"), [("T2.2", 5), ("T2.4", 6), ("DT1", 15), ("DT3", 12), ("DT4", 22)])
def test_published_parameters_are_those_of_the_library(table, n):
    rows = drawing(table).printed
    assert len(rows) == n
    for one in rows:
        assert float(one.ours) == pytest.approx(float(one.printed), rel=1e-6, abs=0.0)


def test_main_data_of_the_250_t_crane_are_those_printed():
    """But for the gain K_1, whose print is an erratum, every number of paper E tables 1 and 2."""
    for one in (*drawing("ET1").printed, *drawing("ET2").printed):
        printed = one.printed.rpartition("= ")[2].replace(" 500", "500").split()[0]
        assert float(one.ours.split()[0]) == pytest.approx(float(printed), rel=1e-4), one


@pytest.mark.parametrize("speed", ["1500", "2000"])
def test_tables_of_the_pumps_leakage_are_those_printed(speed):
    for one in components.pump_leakage(speed).printed:
        assert float(one.ours.split()[0]) == pytest.approx(float(one.printed.split()[0]), rel=1e-9)


def test_parts_of_the_loss_add_up_and_their_order_is_the_printed_one():
    shares = losses.term_shares("A6VM280", 250.0)
    assert sum(shares.values()) == pytest.approx(1.0, abs=1e-12)
    assert set(sorted(shares, key=shares.__getitem__)[-2:]) == {"X_2", "X_4"}


def test_cubic_reduction_is_the_printed_polynomial():
    """Paper C eqs 13 and 14 with D_min = 0.7 D_max."""
    curve = drawing("C13").panels[0].curves[0]
    u = np.abs(curve.x)
    k = np.where(u > 0.6, -31.25 * u**3 + 75.0 * u**2 - 56.25 * u + 13.5, 0.0)
    np.testing.assert_allclose(curve.y, 1.0 - 0.3 * k, atol=1e-12)


@pytest.mark.slow
def test_torque_balance_of_a_friction_test_is_solved():
    """Half the difference of the two pressure drops, times the displacement, is the friction that the models predict."""
    from stillhook.identify.compare import drum_torque
    from stillhook.identify.system_friction.fitting.fit import predicted
    from stillhook.identify.system_friction.fitting.model import Points, Y, loss_of
    from stillhook.library import load_crane, motor, system_friction

    crane, y, loss = load_crane("nov-150t"), Y.of(system_friction("crane-2")), loss_of(motor(losses.FIRST))
    n = np.linspace(50.0, 1500.0, 9) * losses.RPM
    at = Points.planned(n, drum_torque(crane, 77e3), 215.0 * losses.CC, count=11.0)
    found = losses.staged(at, loss, y, crane)
    np.testing.assert_allclose(found.T_f, predicted(found, loss, y), rtol=1e-9)


@pytest.mark.slow
def test_scenario_2_gives_what_the_page_says():
    by_name = {one.quantity: one.ours for one in quay.scenario("2", "v_w").printed}
    page = (PAGES / "paper-e-scenario-2.md").read_text(encoding="utf-8")
    for name, theirs in (("control error of SSC", "within 10 cm"), ("pump capacity that SSC has left", "10 %")):
        assert f"| {theirs} | {by_name[name]}" in page


class TestCommand:
    def test_the_list_counts_every_state(self, capsys):
        assert run(["thesis", "--json"]) == 0
        listed = json.loads(capsys.readouterr().out)
        assert len(listed) == sum(FIGURES.values()) + sum(TABLES.values())
        assert run(["thesis"]) == 0
        out = capsys.readouterr().out
        for state, n in Counter(one["state"] for one in listed).items():
            assert re.search(rf"^{state} +{n} ", out, re.MULTILINE), state

    def test_a_number_is_read_in_any_case_and_writes_its_files(self, capsys, tmp_path):
        assert run(["thesis", "c13", str(tmp_path / "out"), "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert answer["number"] == "C13"
        assert answer["printed"][0]["printed"] == "60 %"
        assert {p.name for p in (tmp_path / "out").iterdir()} >= {"data.csv", "summary.json"}

    def test_a_circuit_is_written_as_svg(self, capsys, tmp_path):
        assert run(["thesis", "E1", str(tmp_path / "out")]) == 0
        assert (tmp_path / "out" / "E1.svg").read_text(encoding="utf-8").startswith("<")

    @pytest.mark.parametrize(("number", "line"), [("D17", "the measured points"), ("F10", "the measured motion")])
    def test_what_needs_data_says_so(self, number, line, capsys):
        assert run(["thesis", number]) == 0
        assert line in capsys.readouterr().out
        with pytest.raises(CommandError, match=line):
            drawing(number)

    def test_a_photograph_is_nothing_to_draw(self, capsys):
        assert run(["thesis", "1.1"]) == 0
        assert "Nothing to draw" in capsys.readouterr().out

    @pytest.mark.parametrize("number", ["E99", "", "2,17", "fig. E19", "T"])
    def test_an_unknown_number_is_one_line(self, number, capsys):
        line = refusal(capsys, "thesis", number)
        assert "no figure or table has this number" in line
        assert "such as" in line

    def test_the_nearest_numbers_are_named(self):
        with pytest.raises(CommandError, match=r"E2\d?"):
            item("E27")
