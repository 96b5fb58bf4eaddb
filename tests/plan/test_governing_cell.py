"""The run that governs a cell of a plan's table: which one it is, and that its lift file is lowered to the same bits."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray

from stillhook.cli import run as stillhook
from stillhook.engine.simulate import simulate
from stillhook.errors import StillhookError
from stillhook.formats.lift_file import load_lift
from stillhook.formats.lift_writer import FILES, LIFT, Run, write_lift
from stillhook.formats.results import load_run
from stillhook.plan.answer import cell_run
from stillhook.plan.answer.cell_run import Governing, Wanted, answer_in, governing, governing_run, wanted
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.file import load_plan
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Execution
from stillhook.plan.tiers.time_domain.lowering import SeaState, winch_of
from stillhook.report import kit
from stillhook.report.save import LOWERING_FILES
from stillhook.sea.vessel.rao import Rao

BETA = math.radians(165.0)
SPOT = SeaState(1.85, 9.0, BETA)
PLAN = """\
crane = "nov-250t"
vessel = "construction-vessel-130m"
payload = "manifold-60t"
start_depth = "-4 m"
alternatives = ["none", "cap-80", "ssc", "strong-ssc"]
[tip]
at = "x=-15 m, y=-24 m, z=36 m"
[water]
depth = "300 m"
[environment]
Hs = ["1 m", "2 m", "3 m"]
Tp = ["6 s", "9 s"]
headings = ["165 deg", "180 deg"]
spread = 4
[operation]
T_POP = "4 h"
[[phase]]
name = "lift-off"
kind = "lift-off"
[[phase]]
name = "splash zone"
kind = "splash-zone"
[[phase]]
name = "down"
kind = "lowering"
mode = "ahc"
[[phase]]
name = "landing"
kind = "landing"
"""
SWELL = '[environment.swell]\nHs = "1 m"\nTp = "14.3 s"\nheading = "200 deg"\n'
OWN_PARTS = (
    PLAN.replace('payload = "manifold-60t"\n', "").replace('["none", ', '["none", "phc", ')
    + """\
[compensator]
unit = "phc-150t"
p_0 = "55.3 bar"
[sensors]
delay = "73 ms"
noise_s_tip = "3 mm"
[payload]
name = "own"
mass = "61.7 t"
shape = "assembly"
[payload.parts.base]
shape = "plate"
length = "7.3 m"
width = "5 m"
height = "0.4 m"
[payload.parts.top]
shape = "box"
at = "0.9 m"
length = "3.3 m"
width = "3 m"
height = "2 m"
perforation = 0.17
"""
)


def planned(folder, text: str = PLAN) -> LiftPlan:
    path = folder / "plan.toml"
    path.write_text(text, encoding="utf-8")
    return load_plan(path)


@pytest.fixture(scope="module")
def plan(tmp_path_factory) -> LiftPlan:
    return planned(tmp_path_factory.mktemp("plan"))


def run_of(plan: LiftPlan, phase: str, alternative: str, spot: SeaState = SPOT) -> tuple[Cells, Run, list]:
    """A plan's cells, the third run of one of them, and the first three."""
    cells = Cells(plan, Execution())
    request = CellRequest(phase, winch_of(plan.phase(phase), Alternative(alternative)), spot, 3)
    crane, cases = cells.cases(request, (1, 2, 3))
    return cells, Run(crane, cases[-1], **cells.options), cases


def same_bits(many: xarray.Dataset, case: int, one: xarray.Dataset) -> None:
    for name in many.data_vars:
        np.testing.assert_array_equal(many[name].values[case], one[name].values, err_msg=str(name))


@pytest.mark.long
@pytest.mark.parametrize(
    ("text", "phase", "alternative"),
    [
        (PLAN, "down", "ssc"),
        (PLAN, "splash zone", "none"),
        (PLAN, "splash zone, held", "none"),
        (PLAN, "landing", "strong-ssc"),
        (PLAN, "landing", "cap-80"),
        (PLAN.replace("[operation]", SWELL + "[operation]"), "landing, held", "ssc"),
        (OWN_PARTS, "landing", "phc"),
        (OWN_PARTS, "down", "ssc"),
    ],
)
def test_the_lowering_of_a_written_file_is_the_plans_own_run_to_the_bit(tmp_path, text, phase, alternative):
    plan = planned(tmp_path, text)
    cells, run, cases = run_of(plan, phase, alternative)
    many = simulate([run.crane] * 3, cases, **cells.options)
    names = write_lift(run, tmp_path, remarks=["what governs"])
    assert names[0] == LIFT
    assert ("payload.toml" in names) is (text is OWN_PARTS)
    assert ("crane.toml" in names) is (alternative == "strong-ssc")
    file = load_lift(tmp_path / LIFT)
    assert (file.end, file.lift.name) == ("programme", phase)
    same_bits(many, 2, simulate(file.crane, file.lift, step=file.step, sampling=file.sampling, end=file.end))


@pytest.mark.slow
def test_still_water_and_other_waves_of_the_same_sea_are_written_as_well(tmp_path, plan):
    cells, run, cases = run_of(plan, "landing", "ssc", SPOT._replace(Hs=0.0))
    assert write_lift(run, tmp_path) == (LIFT,)
    file = load_lift(tmp_path / LIFT)
    assert (file.sea, file.vessel) == (None, None)
    same_bits(
        simulate([run.crane], cases, **cells.options),
        0,
        simulate(file.crane, file.lift, step=file.step, sampling=file.sampling, end=file.end),
    )


def test_a_vessel_of_ones_own_is_written_with_all_its_digits(tmp_path, plan):
    of = plan.vessel
    own = Rao("own", of.omega * (1.0 + 1e-9), of.beta, of.H * np.exp(1e-7j), depth=323.456789)
    _, run, _ = run_of(replace(plan, vessel=own), "landing", "ssc")
    assert write_lift(run, tmp_path) == (LIFT, "vessel.csv")
    read = load_lift(tmp_path / LIFT).vessel
    assert read.depth == own.depth
    for name in ("omega", "beta", "H"):
        np.testing.assert_array_equal(getattr(read, name), getattr(own, name))


def test_a_file_may_say_how_the_waves_are_made_and_refuses_waves_shorter_than_the_run(tmp_path, plan):
    _, run, _ = run_of(plan, "landing", "cap-80")
    write_lift(run, tmp_path)
    text = (tmp_path / LIFT).read_text(encoding="utf-8")
    for line in ('amplitudes = "rayleigh"', "water = false", f"left = {run.case.left!r}", 'resolution = "coarse"'):
        assert line in text
    short = text.replace("repeat = ", 'repeat = "100 s" # ')
    (tmp_path / LIFT).write_text(short, encoding="utf-8")
    with pytest.raises(StillhookError, match=r"sea\.repeat.*the run takes"):
        load_lift(tmp_path / LIFT)


# which cell


def test_a_cell_is_one_of_the_table(plan):
    cell = wanted("heading = 165 deg, Tp=9 s, phase=landing, held, Hs=1.85 m, alternative=ssc", plan)
    assert cell == Wanted(9.0, plan.environment.headings[0], 1.85, Alternative.SSC, plan.phase("landing, held"))
    assert cell.complete
    assert not wanted("tp=6 s, Heading=180 deg", plan).complete


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("Tp=9 s", "name Tp and heading"),
        ("Tz=9 s, heading=165 deg", "name Tp and heading"),
        ("Tp=9 s, Tp=9 s, heading=165 deg", "each once"),
        ("Tp=9, heading=165 deg", "no unit"),
        ("Tp=7 s, heading=165 deg", "Tp 7 s is not of the plan's table, which has 6 s, 9 s"),
        ("Tp=9 s, heading=170 deg", "heading 170 deg is not of the plan's table, which has 165 deg, 180 deg"),
        ("Tp=9 s, heading=165 deg, alternative=hs", "the plan has none, cap-80, ssc, strong-ssc"),
        ("Tp=9 s, heading=165 deg, phase=lift-off", 'made of "splash zone"; "splash zone, held"'),
        ("Tp=9 s, heading=165 deg, Hs=9 m", "the table goes from 0 m to 3 m"),
    ],
)
def test_a_cell_that_there_is_not_is_refused_in_one_line(plan, text, says):
    with pytest.raises(StillhookError, match=says.replace("(", r"\(")) as error:
        wanted(text, plan)
    assert "\n" not in str(error.value)


# what governs


ALTERNATIVES, RULES = ("none", "cap-80", "ssc", "strong-ssc"), ("load-motion", "slack-sling")


def answer(plan: LiftPlan, limits: dict, tier: str = "time") -> SimpleNamespace:
    """A result: (credit, alternative) -> phase, rule and limit of every cell; the same as modelled by runs."""
    phases = [phase.name for phase in plan.phases]
    cell, dims = ("credit", "alternative", "heading", "period"), ((2, 4, 2, 2))
    Hs = xarray.DataArray(np.full(dims, np.inf), dims=cell)
    names = {key: xarray.DataArray(np.full(dims, "", dtype="U20"), dims=cell) for key in ("phase", "rule", "tier")}
    of_rule = xarray.DataArray(
        np.full((2, 1, 4, len(phases), 2, 2, 2), np.nan),
        dims=("credit", "tier", "alternative", "phase", "rule", "heading", "period"),
    )
    for (credit, alternative), (phase, rule, limit) in limits.items():
        place = {"credit": int(credit == "credited"), "alternative": ALTERNATIVES.index(alternative)}
        Hs[place] = limit
        for key, value in (("phase", phase), ("rule", rule), ("tier", tier)):
            names[key][place] = value
        if credit == "twin" and tier == "time":
            of_rule[place | {"phase": phases.index(phase), "rule": RULES.index(rule)}] = limit
    counts = xarray.DataArray(np.full((4, len(phases), 2, 2), tier), dims=("alternative", "phase", "heading", "period"))
    coords = {"credit": ["twin", "credited"], "tier": ["time"], "alternative": list(ALTERNATIVES), "phase": phases}
    coords |= {"rule": list(RULES), "heading": sorted(plan.environment.headings), "period": [6.0, 9.0]}
    governs = {f"governing_{key}": values for key, values in names.items()}
    data = xarray.Dataset({"Hs_limit": Hs, "Hs_rule": of_rule, "counts": counts, **governs}, coords)
    return SimpleNamespace(data=data, facts={"summary": {"shown": "ssc"}})


OF_CAP = {
    ("twin", "cap-80"): ("landing", "load-motion", 1.2),
    ("twin", "ssc"): ("landing", "load-motion", 2.1),
    ("credited", "ssc"): ("landing", "load-motion", 1.2),
}


@pytest.mark.parametrize(
    ("limits", "cell", "by", "Hs"),
    [
        (OF_CAP, "", "cap-80", 1.2),
        (OF_CAP | {("twin", "cap-80"): ("landing", "load-motion", 2.1)}, "", "ssc", 1.2),
        (OF_CAP, ", alternative=ssc", "ssc", 2.1),
        (OF_CAP, ", phase=landing", "ssc", 2.1),
    ],
)
def test_the_runs_of_the_alternative_that_sets_the_limit_govern(plan, limits, cell, by, Hs):
    ask = wanted(f"Tp=9 s, heading=165 deg{cell}", plan)
    found = governing(plan, answer(plan, limits), ask)
    assert found == Governing(Alternative.SSC, Alternative(by), plan.phase("landing"), "load-motion", Hs, not cell)


@pytest.mark.parametrize(
    ("limits", "tier", "cell", "says"),
    [
        (
            OF_CAP,
            "frequency",
            "",
            "landing: the limit is by the frequency tier, and no run sets it. Add Hs=1.2 m and phase=",
        ),
        ({}, "time", "", "no limit up to Hs 3 m. Add Hs=1.5 m and phase="),
        (
            OF_CAP,
            "closed-form",
            ", phase=down",
            "down: the limit is by the closed-form tier, and no run sets it. Add Hs",
        ),
    ],
)
def test_a_limit_that_no_run_sets_is_refused_with_what_there_is(plan, limits, tier, cell, says):
    ask = wanted(f"Tp=9 s, heading=165 deg{cell}", plan)
    with pytest.raises(StillhookError) as error:
        governing(plan, answer(plan, limits, tier), ask)
    assert says in str(error.value)


# which run


def stored(cells_of: dict[float, list[float]]):
    """Runs of a store that holds these motions and speeds, by height of the sea."""

    def of(self, request):
        values = np.array(cells_of.get(round(request.spot.Hs, 6), []))
        names = ("load_pp", "e_c_pp", "v_tip_max")
        runs = {"duration": np.full(len(values), 90.0)} | dict.fromkeys(names, values)
        return list(range(1, len(values) + 1)), runs

    return of


@pytest.mark.parametrize(
    ("phase", "rule", "cells_of", "at"),
    [
        ("down", "winch-speed", {1.8: [0.1], 1.9: [0.3, 0.7, 0.5], 2.0: [0.9]}, (1.9, 2, 3)),  # next to the limit
        ("landing, held", "load-motion", {1.75: [0.8], 1.85: [0.2], 1.9: [0.6], 2.1: [0.9]}, (1.9, 1, 2)),  # within 5 %
    ],
)
def test_the_worst_run_about_the_limit_is_the_one(plan, monkeypatch, phase, rule, cells_of, at):
    monkeypatch.setattr(Cells, "stored", stored(cells_of))
    Hs, number, n = at
    ask = wanted("Tp=9 s, heading=165 deg", plan)
    of = Governing(Alternative.SSC, Alternative.SSC, plan.phase(phase), rule, 1.88, credited=True)
    found = governing_run(plan, of, ask, Execution())
    assert (found.Hs, found.number, found.n, found.made) == (Hs, number, n, False)
    assert found.run.case.sea.trains[0].spectrum.H_s == Hs
    quantity, limit = found.rule.rule.quantity, cell_run.shown(found.rule.rule.quantity, found.limit)
    assert found.line == (
        f"Tp 9 s, 165 deg: {rule} in {phase} governs ssc, up to Hs 1.88 m; run {number}, the worst of {n} at Hs {Hs:g} m:"
        f" {quantity} {cell_run.shown(quantity, found.value)}, {rule} at most {limit}"
    )


def test_without_a_rule_the_one_that_the_waves_use_most_is_said(plan, monkeypatch):
    monkeypatch.setattr(Cells, "stored", stored({2.0: [0.1, 0.4]}))
    ask = wanted("Tp=9 s, heading=165 deg, Hs=2 m, alternative=ssc, phase=landing, held", plan)
    found = governing_run(plan, governing(plan, None, ask), ask, Execution())
    assert (found.rule.rule.key, found.number, found.value) == ("control-error", 2, 0.4)


@pytest.mark.long
def test_where_a_calm_is_beyond_the_run_is_one_in_still_water(plan, tmp_path, monkeypatch):
    monkeypatch.setattr(cell_run, "can_draw", lambda: False)
    of = Governing(Alternative.SSC, Alternative.SSC, plan.phase("landing"), "landing-speed", 0.0, credited=True)
    found = governing_run(plan, of, wanted("Tp=9 s, heading=165 deg", plan), Execution())
    assert (found.Hs, found.n) == (0.0, 1)
    assert "up to Hs 0 m; the run made now in still water: v_landed" in found.line
    assert cell_run.lowered(found, tmp_path / "cell").repeats


@pytest.mark.long
def test_a_run_that_no_store_holds_is_made_once_and_written_with_what_lowers_it(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(cell_run, "can_draw", lambda: False)  # its film takes a minute
    monkeypatch.chdir(tmp_path)
    planned(tmp_path)
    command = [
        "plan",
        "plan.toml",
        "--out",
        "out",
        "--cell",
        "Tp=9 s, heading=165 deg, Hs=2 m, alternative=ssc, phase=landing",
    ]
    assert stillhook(command) == 0
    first = " ".join(capsys.readouterr().out.split())
    assert "the worst of 16 made now at Hs 2 m" in first
    assert "repeats it to the bit." in first
    folder = tmp_path / "out" / "cell-9s-165deg-2m-ssc-landing"
    names = {p.name for p in folder.iterdir()}
    assert sorted(names & set(FILES)) == [LIFT]
    assert names >= set(LOWERING_FILES)
    kept = load_run(folder / "lowering.nc")
    monkeypatch.setattr(kit, "can_draw", lambda: False)  # the same pictures again say nothing of the run
    assert stillhook(command) == 0
    assert "the worst of 16 at Hs 2 m" in " ".join(capsys.readouterr().out.split())
    assert stillhook(["lower", str(folder / LIFT), "--out", "again"]) in (0, 1)
    assert load_run("again/lowering.nc").equals(kept)
    assert answer_in(tmp_path / "out", load_plan("plan.toml")) is None


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--out", "out", "--check"), "--check"),
        (("--out", "out", "--tier", "frequency"), "leave --tier out"),
        ((), "Give --out"),
    ],
)
def test_options_that_make_no_run_are_refused_beside_a_cell(capsys, options, says):
    assert stillhook(["plan", "template-to-1500m", "--cell", "Tp=9 s, heading=165 deg", *options]) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1


TABLES = """
[sensors]
delay = "50 ms"

[sensors.s_w]
noise = "1 mm"
faults = [{ time = "40 s", until = "41 s", kind = "frozen" }]

[sensors.p_a]
drift = "0.5 bar"
step = "0.1 bar"
faults = [{ time = "30 s", until = "31.5 s", kind = "value", value = "3 bar" }]

[operation]"""


def test_errors_of_sensors_are_written_as_the_plan_has_them(tmp_path):
    text = re.sub(r"\[sensors\][^[]*", "", PLAN).replace("[operation]", TABLES.strip())
    _, run, _ = run_of(planned(tmp_path, text), "landing", "ssc")
    write_lift(run, tmp_path)
    written = load_lift(tmp_path / LIFT).lift.sensors
    assert written == run.lift.sensors
    assert written.disturbed == ("s_w", "p_a")
