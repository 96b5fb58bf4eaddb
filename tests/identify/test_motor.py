"""From map to motor file: what is written drops into a crane, says where it is from, and is refused where there is nothing to write."""

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.identify.refusals import refused
from trials.campaigns.motor_map import synthetic_map, write_map

from stillhook.cli import run
from stillhook.cli.identify import MOTOR_FILES, STEMS
from stillhook.errors import LogError
from stillhook.formats.results import to_json
from stillhook.identify.motor.figures import figures
from stillhook.identify.motor.fit import LossModel
from stillhook.identify.motor.identify import MotorLoss, _twin, identify_motor, loss_set, map_table, report, to_dict
from stillhook.identify.motor.map import LossMap, gridded
from stillhook.library import load_crane, motor
from stillhook.library.parameter_sets import load_losses, save_set, set_toml
from stillhook.physics.hydraulics.motor import torque_loss
from stillhook.physics.hydraulics.motor_laws import motor_loss
from stillhook.report.document import Verdict
from stillhook.report.html import html
from stillhook.report.kit import png
from stillhook.spec.crane import SourceKind
from stillhook.winches.circuits.losses import MJ4, loss_fit

pytestmark = pytest.mark.slow

WRITTEN = 1e-12
"""Relative: through text and back."""


def thinned(m: LossMap) -> LossMap:
    """Every third speed and every second pressure: enough to choose a model, and quick."""
    return m.at(np.isin(m.omega_m, np.unique(m.omega_m)[::3]) & np.isin(m.dp_m, np.unique(m.dp_m)[1::2]))


@pytest.fixture(scope="module")
def small() -> LossMap:
    return thinned(synthetic_map("A6VM215", seed=4))


@pytest.fixture(scope="module")
def result(small: LossMap) -> MotorLoss:
    return identify_motor(small)


@pytest.fixture(scope="module")
def file(result: MotorLoss, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("motor") / "my-motor.toml"
    path.write_text(set_toml(loss_set(result, "my-motor")))
    return path


@pytest.mark.thorough
def test_the_written_motor_is_a_motor_with_the_fitted_loss(result, file, small):
    back = load_losses(file)
    here = torque_loss(small.omega_m, small.D_m, small.dp_m, back.motor.loss)
    assert here == pytest.approx(result.mj4.torque(small.omega_m, small.D_m, small.dp_m), rel=WRITTEN)


def test_everything_but_the_loss_is_the_lenders_with_its_kind(file):
    back, lender = load_losses(file), load_losses("A6VM215")
    for field in ("D_max", "n_max_full", "n_max", "J", "C_1", "C_2"):
        assert getattr(back.motor, field) == getattr(lender.motor, field)
        assert back.sources[field] == lender.sources[field]
    for n in ("X_1", "X_2", "X_3", "X_4", "X_5"):
        assert back.sources[f"loss.{n}"].kind is SourceKind.FITTED
        assert "SYNTHETIC" in back.sources[f"loss.{n}"].text


def test_evidence_holds_covariance_ranges_and_where_not_to_use_it(result, file, small):
    evidence = load_losses(file).evidence
    assert evidence is not None
    assert evidence.names == result.mj4.names
    assert evidence.matrix == pytest.approx(result.covariance, rel=1e-9)
    assert evidence.deviation("X_4") > result.mj4.errors[3]  # spread of levels, not of cells
    assert evidence.omega_m == pytest.approx(small.range()["omega_m"])
    assert evidence.D_m == pytest.approx(small.range()["D_m"])
    assert evidence.dof == result.mj4.dof
    assert any("off by up to" in s for s in evidence.statements)
    assert any("the map ends at" in s for s in evidence.statements)


def test_the_motor_file_drops_into_a_crane_file(file):
    own = file.with_name("my-crane.toml")
    own.write_text(f'base = "nov-250t"\n[active.motor]\ntype = "{file.name}"\n')
    crane, base = load_crane(own), load_crane("nov-250t")
    assert crane.active.motor.loss == load_losses(file).motor.loss
    assert crane.active.motor.loss != base.active.motor.loss
    assert crane.active.motor.count == base.active.motor.count


@pytest.mark.thorough
def test_a_parameter_at_its_bound_claims_no_error_in_the_file(small):
    rising = replace(small, T_f=small.T_f - 4e-14 * small.dp_m**2 + 8.0)
    found = identify_motor(rising, threshold=0.2)
    assert "X_5" in found.mj4.at_bound
    written = loss_set(found, "x")
    assert written.evidence is not None
    assert "X_5" not in written.evidence.names
    assert len(written.evidence.covariance) == len(written.evidence.names)
    assert any("X_5 is at its bound" in s for s in written.evidence.statements)


@pytest.mark.thorough
def test_a_model_by_name_is_looked_at_and_written_and_mj4_beside_it(small):
    found = identify_motor(small, model="mj6")
    assert found.model is LossModel.MJ6
    assert found.ranking.recommended is LossModel.MJ4
    motor = loss_set(found, "x").motor
    assert motor.loss.X_4 == found.mj4["X_4"]
    assert motor.law == "mj6"
    assert motor.loss_model.C == tuple(found.fit.values)
    assert "names MJ6, as requested, and the twin runs it" in html(report(found, {}))


@pytest.mark.thorough
def test_a_model_that_is_blind_to_displacement_is_looked_at_and_mj4_is_written(small):
    found = identify_motor(small, model="wilson")
    assert loss_set(found, "x").motor.law == "mj4"
    assert "twin runs MJ4" in html(report(found, {}))


@pytest.mark.long
@pytest.mark.parametrize("model", ["map", "mj5", "ortwig", None])
def test_a_crane_file_takes_the_motor_file_of_any_model_and_of_the_map(small, model, tmp_path):
    found = identify_motor(small, model=model)
    save_set(loss_set(found, "motor"), tmp_path / "motor.toml")
    (tmp_path / "map.csv").write_text(map_table(found))
    (tmp_path / "crane.toml").write_text('base = "nov-150t"\n[active.motor]\ntype = "motor.toml"\n')
    motor = load_crane(tmp_path / "crane.toml").active.motor
    assert motor.law == (model or "mj4")
    assert motor.D_loss_min == pytest.approx(small.D_m.min())
    omega, D, dp = small.omega_m, small.D_m, small.dp_m
    loss = np.array([motor_loss(*map(float, at), loss_fit(motor)) for at in zip(omega, D, dp, strict=True)])
    expected = small.T_f if model == "map" else found.fit.torque(omega, D, dp)
    assert loss == pytest.approx(expected, rel=1e-6 if model == "map" else 1e-9)
    as_good = {law for law, of in motor.alternatives if of is not None}
    assert as_good == {x.value for x in found.ranking.equals} - {motor.law}


@pytest.mark.long
def test_a_map_with_gaps_is_filled_between_its_cells_and_says_how_many(small):
    holes = small.at(np.random.default_rng(0).random(len(small)) < 0.9)
    (D, omega, dp, T_f), filled = gridded(holes)
    assert filled == len(small) - len(holes) > 0
    assert len(T_f) == len(D) * len(omega) * len(dp) == len(small)
    assert f"{filled} combinations interpolated" in map_table(identify_motor(holes, model="map")).splitlines()[0]


def test_scattered_settings_are_no_map_of_the_twin(small):
    rng = np.random.default_rng(0)
    moved = replace(small, **{n: small.axis(n) * rng.uniform(0.5, 1.0, len(small)) for n in ("D_m", "omega_m", "dp_m")})
    with pytest.raises(LogError, match=r"cells for \d+ combinations of levels: the settings are scattered"):
        gridded(moved)


@pytest.mark.thorough
def test_a_motor_of_no_library_size_needs_a_lender(small):
    odd = replace(small, D_max=1.15 * small.D_max)
    found = identify_motor(odd)
    assert found.like is None
    assert "no motor of the library has 247.2" in refused(loss_set, replace(found, map=odd), "x")
    lent = loss_set(identify_motor(odd, like="A6VM280"), "x")
    assert lent.motor.D_max == odd.D_max
    assert lent.motor.J == motor("A6VM280").J
    assert "a motor of another size" in lent.sources["J"].text


@pytest.mark.thorough
def test_a_map_in_another_unit_is_doubted(small):
    """Pressures in MPa that are called bar: loss and nominal torque no longer belong together."""
    wrong = replace(small, dp_m=0.1 * small.dp_m)
    assert any("check the units" in note for note in identify_motor(wrong, like="A6VM215").notes)
    assert not any("check the units" in note for note in identify_motor(small).notes)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"model": "mj7"}, '"mj7": not one of wilson, '),
        ({"like": "A6VM999"}, "A6VM999"),
        ({"threshold": 1.5}, "between 0 and 1"),
    ],
)
def test_wrong_requests_are_refused(small, options, words):
    assert words in refused(identify_motor, small, **options)


@pytest.mark.thorough
def test_a_map_of_noise_has_no_usable_model(small):
    rng = np.random.default_rng(0)
    noise = replace(small, T_f=rng.uniform(0.0, 0.5, len(small)) * small.T_N)
    found = identify_motor(noise)
    assert not found.usable
    (verdict,) = (part for part in report(found, {}).parts if isinstance(part, Verdict))
    assert verdict.passed is False
    assert verdict.word.startswith("NO: ")
    assert "wrong on most of it" in refused(loss_set, found, "x")


def test_json_holds_every_model_with_units_errors_and_strict_numbers(result):
    data = json.loads(to_json(to_dict(result)))
    assert {m["model"] for m in data["models"]} == {m.value for m in LossModel}
    assert data["recommended"] == "mj4"
    assert data["synthetic"] is True
    mj4 = next(m for m in data["models"] if m["model"] == "mj4")
    assert mj4["parameters"]["X_4"]["unit"] == "N m"
    assert mj4["parameters"]["X_4"]["value"] == pytest.approx(result.mj4["X_4"])
    wilson = next(m for m in data["models"] if m["model"] == "wilson")
    assert all(wilson["parameters"][n]["standard_error"] is None for n in wilson["at_bound"])


def test_figures_show_the_map_they_are_made_from_and_say_that_it_is_synthetic(result):
    made = figures(result)
    assert set(made) == set(STEMS)
    for figure in made.values():
        assert "SYNTHETIC" in figure.get_suptitle()
    points = [line for ax in made["model-and-map"].axes for line in ax.get_lines() if line.get_marker() == "."]
    assert {float(y) for line in points for y in line.get_ydata()} <= {float(t) for t in result.map.T_f}
    bars = made["ranking"].axes[1].patches
    assert sorted(b.get_height() for b in bars) == sorted(r.fit.normalised for r in result.ranking.ranked)


def test_term_shares_are_of_the_whole(result):
    """Paper A figure 6: turbulent and constant losses are the largest of MJ4."""
    ax = figures(result)["terms"].axes[0]
    shares = np.array([p.get_height() for p in ax.patches]).reshape(3, -1)
    assert shares.sum(axis=1) == pytest.approx([100.0] * 3)
    names = [t.get_text() for t in ax.get_xticklabels()]
    largest = {names[i] for i in np.argsort(shares[0])[-2:]}
    assert largest == {"turbulent", "constant"}


@pytest.mark.thorough
@pytest.mark.parametrize("part", ["one displacement", "one pressure", "scattered"])
def test_figures_and_report_come_out_of_odd_maps_too(small, part):
    m = {
        "one displacement": small.full(),
        "one pressure": small.at(small.dp_m == small.dp_m.max()),
        "scattered": small.at(np.random.default_rng(0).random(len(small)) < 0.4),
    }[part]
    found = identify_motor(m)
    page = html(report(found, {stem: png(f) for stem, f in figures(found).items()}))
    assert page.count("<img") == 6
    if part == "one pressure":
        assert not found.usable
        assert "cannot be distinguished" in page


@pytest.mark.thorough
def test_the_page_stands_alone(result):
    page = html(report(result, {stem: png(f) for stem, f in figures(result).items()}))
    assert page.startswith("<!doctype html>")
    assert "SYNTHETIC" in page
    assert set(re.findall(r'src="([^,]*),', page)) == {"data:image/png;base64"}
    assert re.search(r"(src|href)=.?http", page) is None


# The command line


@pytest.fixture
def csv(small, tmp_path) -> Path:
    return write_map(small, tmp_path / "map.csv")


@pytest.mark.thorough
def test_cli_from_map_to_files(csv, tmp_path, capsys):
    assert run(["identify", "motor", str(csv), "--out", str(tmp_path / "o"), "--verbose"]) == 0
    told = capsys.readouterr()
    assert all(words in told.out for words in ("Recommended: MJ4: 5 parameters", "Where it must not be used"))
    assert "SYNTHETIC map" in told.err
    assert sorted(p.name for p in (tmp_path / "o").iterdir()) == sorted([*MOTOR_FILES, "stillhook-manifest.json"])
    assert load_losses(tmp_path / "o" / "motor.toml").evidence is not None
    assert json.loads((tmp_path / "o" / "models.json").read_text())["recommended"] == "mj4"
    assert run(["identify", "motor", str(csv), "--json"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["cells"] > 100
    assert told.err == ""


@pytest.mark.thorough
def test_cli_says_no_with_exit_code_1_and_writes_no_motor(small, tmp_path, capsys):
    one = write_map(small.at(small.dp_m == small.dp_m.max()), tmp_path / "one.csv")
    assert run(["identify", "motor", str(one), "--out", str(tmp_path / "o"), "--verbose"]) == 1
    told = capsys.readouterr()
    assert all(words in told.out for words in ("NO: ", "cannot be distinguished"))
    assert "motor.toml is not written" in told.err
    assert not (tmp_path / "o" / "motor.toml").exists()
    assert (tmp_path / "o" / "report.html").exists()


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["gone.csv"], "no such file"),
        (["map.csv", "--model", "mj9"], "not one of wilson"),
        (["map.csv", "--like", "A6VM99"], "A6VM99"),
        (["map.csv", "--like", "A6VM170"], "beyond the motor's full 170 cm^3/rev"),
        (["map.csv", "--threshold", "0"], "--threshold"),
        (["map.csv", "--mapping", "gone.toml"], '"gone.toml": no such file'),
        (["map.csv", "--out", "map.csv"], "is not a folder"),
    ],
)
def test_cli_refuses_in_one_line(csv, monkeypatch, capsys, arguments, part):
    monkeypatch.chdir(csv.parent)
    assert run(["identify", "motor", *arguments]) == 2
    told = capsys.readouterr().err.strip().splitlines()
    assert told[-1].startswith("error: ")
    assert part in told[-1]
    assert "Traceback" not in "".join(told)


@pytest.mark.parametrize(("equals", "said"), [((), False), (("mj4",), False), (("mj4", "wilson"), True)])
def test_models_that_fit_equally_well_are_named_where_there_is_more_than_one(equals, said):
    ranking = SimpleNamespace(equals=[LossModel(name) for name in equals])
    text = _twin(SimpleNamespace(ranking=ranking, law=MJ4, model=LossModel.MJ4))
    assert ("Equally good by the rule: " in text) == said
    assert text.startswith("The twin runs MJ4: the motor file holds this fit.")
