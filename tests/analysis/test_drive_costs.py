"""What drives cost their owner: stated cells are added up, empty ones stay empty and are named."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from tests.commands import answer, case_file, refusal

import stillhook
from stillhook import Scenario, load_crane
from stillhook.analysis.drives.comparison import DriveComparison, compare_drives
from stillhook.analysis.drives.costs import CELLS, PAPER, CostFile, load_costs, omissions, owner_rows
from stillhook.analysis.drives.sizing import library_crane, scaled
from stillhook.errors import StillhookError
from stillhook.library import changed
from stillhook.spec.crane import content

CASE = Scenario(load="50 t", s_w="100 m", tip="sine 1 m 10 s", duration="60 s", warm_up="30 s")
YEAR = {"hours": "600 h", "operations": 20, "vessel": "150000 EUR/d", "write_off": 10}
ENERGY = {"grid": "0.15 EUR/kWh", "hydraulic": "0.2 EUR/kWh", "returned": "0.05 EUR/kWh"}
FULL = {
    "maintenance": "60000 EUR/year",
    "capital": "4e6 EUR",
    "footprint": "18 m^2",
    "mass": "60 t",
    "source": "offer 7",
}
KWH = 3.6e6


@pytest.fixture(scope="module")
def pair() -> DriveComparison:
    with pytest.MonkeyPatch.context() as patch:
        for module in ("controllers", "drives.sizing"):
            patch.setattr(f"stillhook.analysis.{module}.strong_gain", lambda crane, mode, delay=0.0: (0.2, "as given"))
        return compare_drives(load_crane("nov-100t-pure-active"), CASE, ("pure-active", "electric"), n=0)


def costs(**drives: dict[str, str]) -> CostFile:
    return CostFile.model_validate({"year": YEAR, "energy": ENERGY, "drive": drives})


def test_a_sum_is_that_of_its_cells_and_energy_is_priced_by_its_source(pair):
    rows = {row.name: row for row in owner_rows(pair, costs(electric=FULL), {"electric": 2.5})}
    run = next(run for run in pair.runs if run.name == "electric")
    cells = rows["electric"].costs
    assert cells["energy"] == pytest.approx(600 * (0.15 * run.energy.drawn - 0.05 * run.energy.returned) / KWH)
    assert cells["capital"] == 400_000
    assert cells["vessel"] == 20 * 2.5 * 150_000
    assert rows["electric"].total == pytest.approx(sum(cells.values()))
    assert rows["electric"].left_out == ()
    assert rows["electric"].sources["mass"] == "offer 7"


def test_an_empty_cell_stays_empty_and_the_sum_names_it(pair):
    rows = {row.name: row for row in owner_rows(pair, costs(electric=FULL, **{"pure-active": {}}))}
    assert rows["pure-active"].left_out == ("maintenance", "capital", "vessel")
    assert rows["pure-active"].costs["capital"] is None
    assert rows["pure-active"].total == rows["pure-active"].costs["energy"]
    assert (rows["pure-active"].footprint, rows["pure-active"].sources["footprint"]) == (None, "not stated")
    assert rows["electric"].left_out == ("vessel",)
    assert "Sums that leave out different costs do not compare." in omissions(list(rows.values()))


def test_a_table_without_prices_has_no_sum(pair):
    bare = CostFile.model_validate({"drive": {"electric": dict.fromkeys(FULL, "")}})
    for row in owner_rows(pair, bare):
        assert row.total is None
        assert row.left_out == CELLS


def test_dearer_energy_costs_more_and_returned_energy_never_costs(pair):
    def energy(**prices: str) -> float:
        file = CostFile.model_validate({"year": YEAR, "energy": prices, "drive": {"pure-active": {}}})
        row = next(row for row in owner_rows(pair, file) if row.name == "pure-active")
        return row.costs["energy"] or math.nan

    assert energy(hydraulic="0.4 EUR/kWh") == pytest.approx(2 * energy(hydraulic="0.2 EUR/kWh"))
    assert energy(hydraulic="0.2 EUR/kWh", returned="0.1 EUR/kWh") < energy(hydraulic="0.2 EUR/kWh")
    assert math.isnan(energy(grid="0.2 EUR/kWh"))


def test_operations_that_no_year_holds_are_named(pair):
    rows = owner_rows(pair, costs(electric={}), {"electric": 39.0, "pure-active": 3.0})
    line = omissions(rows)[-1]
    assert line == "Vessel days that no year holds: electric 780. State fewer operations, or plan for a season."


def test_a_winch_that_is_not_built_is_marked(pair):
    rows = {row.name: row for row in owner_rows(pair, costs(electric={}))}
    assert (rows["electric"].basis, rows["pure-active"].basis) == (PAPER, "as built")
    assert [run.label for run in pair.runs] == ["pure-active", "electric (paper)"]
    assert [run.to_dict()["paper"] for run in pair.runs] == [False, True]
    assert [name for name in stillhook.cranes() if load_crane(name).paper] == [
        "deep-250t",
        "nov-100t-cylinder",
        "nov-100t-electric",
        "nov-250t-digital",
        "nov-250t-secondary",
        "utility-20t-open-circuit",
    ]


def test_a_built_winch_is_scaled_before_a_paper_one():
    assert library_crane("active-passive", load_crane("nov-100t-pure-active")).name == "nov-150t"


def test_deck_area_and_mass_are_of_the_winch_that_states_them_and_no_result_follows_from_them():
    crane = load_crane("nov-100t-pure-active")
    known = changed(crane, {"installation": {"footprint": "20 m^2", "mass": "80 t"}})
    assert content(known) == content(crane)
    own, _, _ = scaled(known, known)
    assert own.installation == known.installation
    twice, _, _ = scaled(known, known.model_copy(update={"SWL": 2.0 * known.SWL}))
    assert twice.installation is None


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ('[drive.eletric]\nmass = "60 t"', "drive.eletric: unknown drive. Choose active-passive"),
        ('[drive.electric]\ncapital = "4e6"', 'drive.electric.capital = "4e6": give an amount with its currency'),
        ('[drive.electric]\ncapital = "-4 EUR"', 'capital = "-4 EUR": give an amount with its currency'),
        ('[drive.electric]\nmaintenance = "6 EUR/d"', 'such as "150 EUR/year"'),
        ('[drive.electric]\nmass = "60 m"', 'unit "m" is not one of'),
        ('[drive.electric]\ncapital = "4 EUR"\nmaintenance = "6 NOK/year"', "Write one currency."),
        ('[drive.electric]\nweight = "60 t"', "weight: unknown field"),
        ('[year]\nhours = "9000 h"\n[drive.electric]', "year.hours"),
        ("[year]\noperations = -1\n[drive.electric]", "year.operations"),
        ("[year]\n[drive]", "drive"),
        ("", "Write one with: stillhook new drives FILE."),
    ],
)
def test_a_cell_that_cannot_be_is_refused_in_one_line(tmp_path: Path, text: str, line: str):
    file = tmp_path / "costs.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(StillhookError) as refused:
        load_costs(file)
    assert str(refused.value).startswith("costs.toml: ")
    assert line in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.slow
def test_the_command_answers_with_the_owners_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    file = tmp_path / "costs.toml"
    file.write_text('[year]\nhours = "600 h"\n[energy]\nhydraulic = "0.2 EUR/kWh"\n[drive.pure-active]\n', "utf-8")
    case = case_file(tmp_path, "nov-100t-pure-active", settings="draws = 0", load="50 t", duration="60 s")
    data = answer(capsys, "compare", case, "--drives", str(file), code=1)
    owner = data["owner"]
    assert owner["currency"] == "EUR"
    assert owner["drives"]["pure-active"]["left_out"] == ["maintenance", "capital", "vessel"]
    assert "no such file" in refusal(capsys, "compare", case, "--drives", str(tmp_path / "none.toml"))
    assert "is a case file, not a table of costs" in refusal(capsys, "compare", case, "--drives", case)
