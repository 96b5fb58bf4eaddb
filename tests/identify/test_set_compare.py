"""Friction sets side by side: published numbers, bands that cover, one figure with its sources, the commands."""

import json

import numpy as np
import pytest
from tests.identify.refusals import refused

from stillhook import load_crane
from stillhook.cli import run as command
from stillhook.identify.compare import (
    FASTEST,
    PARTS,
    band,
    drum_torque,
    figure,
    notes,
    speeds,
    split,
    table,
)
from stillhook.library import FrictionSet, load_friction
from stillhook.library.draws import draw
from stillhook.library.parameter_sets import Evidence, save_set
from stillhook.physics.scalar import G

RPM = np.pi / 30.0
CRANE = load_crane("nov-150t")


def with_evidence(**ranges) -> FrictionSet:
    base = load_friction("crane-2")
    evidence = Evidence(
        names=("Y_1", "Y_4", "Y_6"),
        covariance=((1e-12, -4e-7, 0.0), (-4e-7, 1.0, 0.0), (0.0, 0.0, 2.5e-13)),
        dof=1e6,
        data="made-up tests",
        statements=("Y_2 cannot be reported from Y_3",),
        **ranges,
    )
    return FrictionSet("mine", "made up", base.system, base.sources, evidence)


def test_the_parts_add_up_to_the_published_friction():
    """SPEC section 8: crane 1 at 1.5 MN m and 100 rev/min, 45.927398 N m per motor."""
    s = split(load_friction("crane-1"), 1.5e6, np.array([100.0 * RPM]))
    assert s.total[0] == pytest.approx(45.927398, abs=1e-6)
    assert s.part("total") == pytest.approx(s.part("Coulomb") + s.part("stiction") + s.part("viscous"))
    assert s.half is None


def test_crane_1_sticks_more_and_slides_easier_than_crane_2():
    """What paper D figure 8 shows: at 100 t crane 1 has the larger stiction, crane 2 the larger Coulomb friction."""
    T_d = drum_torque(CRANE, 100e3)
    one, two = (split(load_friction(n), T_d, speeds()) for n in ("crane-1", "crane-2"))
    assert one.stiction[0] > 2.0 * two.stiction[0]
    assert one.coulomb[0] < two.coulomb[0]
    assert one.total[0] > two.total[0]
    assert one.total[-1] < two.total[-1]


@pytest.mark.slow
def test_the_band_holds_95_of_100_draws():
    item, T_d = with_evidence(), 1.5e6
    omega = np.array([0.0, 100.0, 500.0, 1500.0]) * RPM
    drawn = draw(item, 4000, np.random.default_rng(5))

    def total(row):
        system = item.system.model_copy(update=dict(zip(drawn.names, row, strict=True)))
        return split(FrictionSet("d", "d", system, {}), T_d, omega).total

    totals = np.array([total(row) for row in drawn.values])
    half = band(item.system, item.evidence, T_d, omega)
    inside = np.mean(np.abs(totals - split(item, T_d, omega).total) < half, axis=0)
    assert inside == pytest.approx(np.full(4, 0.95), abs=0.015)


def test_drum_torque_is_the_weight_of_load_and_hook_on_the_layer():
    outer, inner = (drum_torque(CRANE, 100e3, n) for n in (None, 1))
    assert outer == pytest.approx(103e3 * G * 0.5 * (2.25 + 21 * 0.077))
    assert inner == pytest.approx(103e3 * G * 0.5 * (2.25 + 0.077))
    line = 'layer = 12: the drum of "nov-150t" has layers 1 to 11.'
    assert refused(drum_torque, CRANE, 100e3, 12) == line
    line = 'load 151 t: "nov-150t" lifts 0 t to 150 t. Give a load in between.'
    assert refused(drum_torque, CRANE, 151e3) == line


def test_what_the_data_do_not_reach_and_cannot_tell_is_said():
    item = with_evidence(omega_m=("25 rev/min", "1200 rev/min"), T_d=("0 kN m", "1 MN m"))
    s = split(item, 1.5e6, speeds())
    assert notes([s], 1.5e6) == [
        "mine: 1500 kN m of drum torque is beyond its data, 0 kN m to 1000 kN m",
        "mine: its data are of 25 rev/min to 1200 rev/min; the rest is extrapolated",
        "mine: Y_2 cannot be reported from Y_3",
    ]
    assert np.flatnonzero(~s.inside).size > 0
    assert notes([split(load_friction("crane-1"), 1.5e6, speeds())], 1.5e6) == []


def test_the_figure_shows_every_part_of_every_set_and_its_source():
    splits = [split(load_friction("crane-1"), 1.5e6, speeds()), split(with_evidence(), 1.5e6, speeds())]
    picture = figure(splits, 1.5e6)
    assert [ax.get_title() for ax in picture.axes] == list(PARTS)
    for ax in picture.axes:
        assert len([line for line in ax.lines if len(line.get_xdata()) and np.isfinite(line.get_ydata()).any()]) == 2
        assert ax.get_xlim() == (0.0, FASTEST)
    assert len(picture.axes[0].collections) == 1  # one band: crane 1 states no uncertainty
    assert "paper D table 3, crane 1" in picture.get_supxlabel()
    assert "made-up tests" in picture.get_supxlabel()


def test_the_table_has_a_row_a_set_with_half_the_band_where_it_is_known():
    rows = table([split(i, 1.5e6, speeds()) for i in (load_friction("crane-1"), with_evidence())])
    assert rows[0]["half_95"]["100 rev/min"] is None
    assert rows[1]["half_95"]["0 rev/min"] > 1.0
    assert rows[0]["total"]["100 rev/min"] == pytest.approx(45.927398, abs=1e-6)


# Commands


@pytest.mark.slow
def test_the_sets_of_the_library_are_listed_with_their_sources(capsys):
    assert command(["list", "frictions", "--verbose"]) == 0
    said = capsys.readouterr().out
    for name in ("crane-1", "crane-2", "L4593", "crane-2-second-loop", "A6VM215", "A6VM215-crane-2-second-loop"):
        assert name in said
    assert "paper D table 3, crane 1" in said
    assert command(["list", "frictions", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert {d["kind"] for d in data} == {"system friction", "motor"}
    assert all(d["sources"] for d in data)


@pytest.mark.thorough
def test_the_comparison_is_printed_and_written_whole(tmp_path, capsys):
    def compared(*arguments):
        assert command(["friction", "compare", *map(str, arguments), "--verbose"]) == 0
        return capsys.readouterr().out

    out, path = tmp_path / "out", save_set(with_evidence(), tmp_path / "mine.toml")
    said = compared("crane-1", path, "--drum-torque", "1.5 MN m", "--out", out)
    assert "45.9" in said
    assert " ± " in said
    assert sorted(p.name for p in out.iterdir()) == [
        "friction-sets.json",
        "friction-sets.png",
        "stillhook-manifest.json",
    ]
    assert (out / "friction-sets.png").read_bytes().startswith(b"\x89PNG")
    again = save_set(with_evidence(), out / "mine.toml")
    sets = json.loads(compared(path, again, path, "--json"))["sets"]
    assert [s["set"] for s in sets] == [str(path), str(again)]  # two files of one name are distinguished
    data = json.loads(compared("crane-1", "--load", "100 t", "--crane", "nov-150t", "--layer", "3", "--json"))
    assert data["T_d"] == pytest.approx(drum_torque(CRANE, 100e3, 3))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["compare", "crane-9"], 'friction set = "crane-9": not in the library, which has L4593, crane-1'),
        (["compare", "crane-1", "--load", "100"], '--load = "100": no unit; write "100 t" (allowed: kg, t, te).'),
        (["compare", "crane-1", "--load", "1 kt"], '--load = "1 kt": unit "kt" is not one of kg, t, te.'),
        (["compare", "crane-1", "--load", "170 t"], 'load 170 t: "nov-150t" lifts 0 t to 150 t.'),
        (["compare", "crane-1", "--drum-torque", "-1 MN m"], '--drum-torque "-1 MN m": give 0 or more.'),
        (["draws", "crane-2"], 'set "crane-2": it has no [evidence]'),
        (["draws", "no-such.toml"], 'set = "no-such.toml": no such file. Check the path.'),
    ],
)
def test_a_command_that_cannot_be_done_says_so_in_one_line(arguments, text, capsys):
    assert command(["friction", *arguments]) == 2
    err = capsys.readouterr().err
    assert err.startswith(f"error: {text}")
    assert err.count("\n") == 1
