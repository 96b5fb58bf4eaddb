"""One scenario on several cranes, as for draws of uncertain parameters: paired, labelled, stored, repeated, side by side."""

import json

import numpy as np
import pytest

from stillhook import Scenario, load_crane, load_run, save_run, simulate
from stillhook.cli import run as command
from stillhook.engine.scenario import run as engine_run
from stillhook.errors import StillhookError
from stillhook.formats.results import origin, rerun
from stillhook.library import changed
from stillhook.spec.scenario import Sensors

BASE = load_crane("nov-150t")
CRANES = [changed(BASE, {"friction": {"system": {"Y_6": 1.2e-5 + 1e-6 * i}}}) for i in range(20)]
CASE = Scenario(
    load="60 t",
    s_w="100 m",
    tip="sine 1 m 9 s",
    duration="30 s",
    warm_up="10 s",
    sensors=Sensors(noise_s_w="1 mm", seed=2),
)
OTHER = CASE.model_copy(update={"load": 30e3, "name": "light"})


@pytest.mark.slow
def test_a_list_of_cranes_runs_one_case_each_as_it_does_alone():
    together = simulate(CRANES, CASE)
    assert together.sizes == {"case": 20}
    for i in (0, 7, 19):
        alone = simulate([CRANES[i]], CASE)
        for name in ("e_c_pp", "p_max", "energy_through", "energy_unaccounted"):
            assert float(together[name][i]) == float(alone[name][0])
    assert np.all(np.diff(together.p_max.values) > 0.0)  # more friction, more pressure


@pytest.mark.slow
def test_many_cranes_run_sixteen_side_by_side_and_not_one_by_one(monkeypatch):
    blocks: list[int] = []

    class Counting(engine_run.ScenarioBlock):
        def __init__(self, packs, **options):
            blocks.append(len(packs))
            assert options["lanes"] == 16
            super().__init__(packs, **options)

    monkeypatch.setattr(engine_run, "ScenarioBlock", Counting)
    simulate([*CRANES, *CRANES], CASE)
    assert sorted(blocks) == [8, 16, 16]


@pytest.mark.slow
def test_more_cranes_than_fit_side_by_side_give_the_bits_of_single_trajectories():
    together = simulate(CRANES, CASE, step="5 ms")
    alone = simulate(CRANES[17], CASE, step="5 ms")
    assert float(together.p_max[17]) == float(alone.p_max)
    assert float(together.e_c_pp[17]) == float(alone.e_c_pp)


def test_equally_many_cases_go_with_the_cranes_in_pairs():
    data = simulate(CRANES[:2], [CASE, OTHER])
    assert data["case"].values.tolist() == ["0", "light"]
    assert float(data.p_max[1]) == float(simulate(CRANES[1], [OTHER]).p_max[0])
    assert float(data.F_w_max[1]) < float(data.F_w_max[0])


def test_notes_are_those_of_each_crane():
    weak = changed(BASE, {"control": {"K_p": "30 1/m"}})
    data = simulate([BASE, weak], CASE, on_failure="mark")
    assert "marginally stable" not in data.notes.values[0]
    assert "marginally stable" in data.notes.values[1]


@pytest.mark.slow
def test_cranes_of_different_names_name_their_cases():
    pair = [changed(BASE, {"name": name}) for name in ("stiff", "soft")]
    assert simulate(pair, CASE)["case"].values.tolist() == ["stiff", "soft"]
    assert simulate(CRANES[:3], CASE)["case"].values.tolist() == ["0", "1", "2"]


def test_series_of_several_cranes_share_a_table():
    data = simulate(CRANES[:2], CASE, series=True)
    assert data.e_c.dims == ("case", "time")
    assert np.array_equal(data.p_a.values[1], simulate(CRANES[1], CASE).p_a.values)


@pytest.mark.thorough
@pytest.mark.parametrize("cases", [CASE, [CASE, OTHER, CASE]], ids=["one case", "a case each"])
def test_a_run_of_several_cranes_repeats_itself_from_disk(cases, tmp_path):
    data = simulate(CRANES[:3], cases)
    stored = load_run(save_run(data, tmp_path / "run.nc"))
    assert len(json.loads(stored.attrs["crane"])) == 3
    assert len(json.loads(stored.attrs["scenarios"])) == (1 if isinstance(cases, Scenario) else 3)
    cranes, each = origin(stored)
    assert cranes == CRANES[:3]
    assert each == ([cases] * 3 if isinstance(cases, Scenario) else cases)
    again = rerun(stored)
    assert again["case"].values.tolist() == data["case"].values.tolist()
    for name in ("e_c_pp", "p_max", "energy_through"):
        assert np.array_equal(again[name].values, data[name].values)


@pytest.mark.thorough
def test_the_command_line_runs_a_stored_run_of_several_cranes_again(tmp_path, capsys):
    path = save_run(simulate(CRANES[:2], CASE), tmp_path / "run.nc")
    assert command(["run", str(path), "--json", "--out", str(tmp_path / "again")]) == 0
    said = json.loads(capsys.readouterr().out)
    assert [s["p_max"] for s in said.values()] == pytest.approx(
        simulate(CRANES[:2], CASE).p_max.values.tolist(), rel=1e-4
    )
    cranes, _ = origin(load_run(tmp_path / "again" / "runs.nc"))
    assert cranes == CRANES[:2]


def test_a_run_of_one_crane_is_stored_as_it_always_was():
    data = simulate(BASE, [CASE, OTHER])
    assert data.attrs["crane"].startswith('name = "nov-150t"')
    assert data.attrs["title"] == "Stillhook run of nov-150t"


@pytest.mark.parametrize(
    ("cranes", "case", "text"),
    [
        ([], CASE, "simulate: the list of cranes is empty. Give at least one Crane."),
        (CRANES[:2], [], "simulate: the list of cases is empty. Give at least one Scenario or Lowering or InSea."),
        (CRANES[:3], [CASE, OTHER], "simulate: 3 cranes and 2 cases. Give one case, or one for each crane."),
        (CRANES[:1], [CASE, OTHER], "simulate: 1 cranes and 2 cases. Give one case, or one for each crane."),
        ([BASE, load_crane("nov-100t-pure-active")], CASE, 'simulate: crane 0 "nov-150t" is active-passive with a PLC'),
        ([BASE, changed(BASE, {"control": {"t_cycle": "20 ms"}})], CASE, 'simulate: crane 0 "nov-150t" is'),
        ([BASE, "nov-250t"], CASE, 'crane = "nov-250t": not a Crane. Read one with load_crane, by name or path.'),
        (CRANES[:2], CASE.model_copy(update={"load": 200e3}), 'case 0: Load 200 t exceeds the SWL 150 t of "nov-150t"'),
    ],
)
def test_what_cannot_be_paired_is_one_line(cranes, case, text):
    with pytest.raises(StillhookError) as caught:
        simulate(cranes, case)
    assert text in str(caught.value)
