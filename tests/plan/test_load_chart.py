"""A crane's load chart: capacity by radius and wave height, side-lead and off-lead, and mistakes in one line."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from scipy.integrate import solve_ivp
from tests.plan.manifold import manifold

from stillhook.cli import run
from stillhook.errors import StillhookError
from stillhook.physics.scalar import G
from stillhook.plan.definition.capacities import CAPACITIES, calm
from stillhook.plan.definition.load_chart import CraneChart, read_load_chart
from stillhook.plan.definition.rules import Alternative, Demand, Level, Limited, Rule, Seas, Sense, Tier
from stillhook.plan.file import load_plan
from stillhook.plan.limits import limited, limits_in, limits_of, utilisation
from stillhook.plan.planning import plan as planned
from stillhook.plan.tiers.closed_form import closed_form, leads
from stillhook.plan.tiers.sideways import in_air
from stillhook.plan.weather.spectral import spectral_persistence
from stillhook.response import Waves
from stillhook.sea.spectra.measured import SeaStates
from stillhook.sea.vessel.boom import TipPoint
from stillhook.sea.vessel.rao import DOFS, Rao
from stillhook.spec.lift.phase import PhaseKind
from stillhook.weather.alpha import load_alpha_table

HEAD = "radius [m],Hs [m],SWL [t],DAF [1],side_lead [deg],off_lead [deg]\n"
ROWS = """\
10,1,240,1.3,3,6
30,1,140,1.3,3,6
10,2,200,1.4,3,6
30,2,100,1.4,3,6
10,3,160,1.5,3,6
20,3,90,1.5,3,6
"""
PLAN = (
    manifold("none", start_depth="-7 m")
    + """\
[environment]
Hs = "0.5 m to 4 m by 0.5 m"
Tp = ["6 s", "10 s"]
headings = ["150 deg", "180 deg", "210 deg"]

[load_chart]
file = "chart.csv"
pedestal = "x=-15 m, y=-9 m"

[[phase]]
name = "over the side"
kind = "in-air"

[[phase]]
name = "splash"
kind = "splash-zone"
"""
)
SPECTRA = 0.02  # of an amplitude by integration in time, its last swings
H = np.array([0.5, 1.0, 1.5, 2.5, 4.0])
STEPS = ((1.0, 2.0), (2.0, 1.5), (3.0, 1.0))


def written(folder: Path, *changes: tuple[str, str], rows: str = ROWS, head: str = HEAD) -> Path:
    """A plan and its chart, with texts of the plan exchanged; each must be there."""
    text = PLAN
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    (folder / "chart.csv").write_text(head + rows, encoding="utf-8")
    (folder / "plan.toml").write_text(text, encoding="utf-8")
    return folder / "plan.toml"


def chart(folder: Path, rows: str = ROWS, head: str = HEAD):
    (folder / "chart.csv").write_text(head + rows, encoding="utf-8")
    return read_load_chart(folder / "chart.csv")


def stepped(values, steps=STEPS, heights=H, still=None):
    """Limiting height of a demand at these heights by a limit that falls in steps."""
    rule = Rule("rule", "a rule", "e_c_pp", "SWL", Sense.AT_MOST, Level.MPM, (PhaseKind.DEEP,), "none")
    seas = Seas(np.asarray(heights), np.full(len(heights), 8.0), np.full(len(heights), math.pi))
    demand = Demand("deep", Alternative.NONE, Tier.TIME, seas, {"e_c_pp": np.asarray(values, dtype=float)})
    held = Limited(rule, steps[0][1], "", steps)
    return float(limits_of(demand, [held], None if still is None else {"e_c_pp": still}).Hs["rule"][0])


class TestReading:
    def test_capacity_falls_along_straight_lines_between_radii(self, tmp_path):
        first = chart(tmp_path).at(20.0)[0]
        assert first.SWL == pytest.approx(190e3)
        assert [point.Hs for point in chart(tmp_path).at(20.0)] == [1.0, 2.0, 3.0]

    def test_a_height_whose_rows_do_not_reach_the_radius_has_no_capacity(self, tmp_path):
        assert [point.Hs for point in chart(tmp_path).at(25.0)] == [1.0, 2.0]
        assert chart(tmp_path).at(31.0) == ()
        assert chart(tmp_path).at(9.0) == ()

    def test_an_excel_sheet_is_the_same_chart_as_its_csv(self, tmp_path):
        book = openpyxl.Workbook()
        book.active.append(HEAD.strip().split(","))
        for line in ROWS.splitlines():
            book.active.append([float(cell) for cell in line.split(",")])
        book.save(tmp_path / "chart.xlsx")
        assert read_load_chart(tmp_path / "chart.xlsx").digest == chart(tmp_path).digest

    def test_units_are_those_of_the_headings(self, tmp_path):
        in_kg = chart(tmp_path, "10,240000\n30,140000\n", "radius [m],capacity [kg]\n").at(10.0)[0]
        assert in_kg.SWL == 240e3
        assert in_kg.DAF is None
        assert math.isinf(in_kg.Hs)

    @pytest.mark.parametrize(
        ("head", "rows", "texts"),
        [
            ("radius [m],Hs [m]\n", "10,1\n", ['no column "SWL [t]"', '"Hs [m]"']),
            ("radius,SWL [t]\n", "10,1\n", ['"radius"', "no unit", "radius [m]"]),
            ("radius [m],SWL [kN]\n", "10,1\n", ['unit "kN"', "kg"]),
            ("radius [m],SWL [t]\n", "10,\n20,100\n", ["row 2", "SWL [t]", "empty"]),
            ("radius [m],SWL [t]\n", "10,nan\n", ["row 2", "empty"]),
            ("radius [m],SWL [t]\n", "", ["no data below"]),
            ("", "", ["empty"]),
            ("radius [m],SWL [t]\n", "20,100\n10,120\n", ["row 3", "radius 10 m after 20 m", "must rise"]),
            ("radius [m],SWL [t]\n", "10,100\n10,100\n", ["row 3", "each once"]),
            ("radius [m],SWL [t]\n", "10,-5\n", ["row 2", "-5 t", "not between"]),
            ("radius [m],SWL [t],DAF [1]\n", "10,5,0.8\n", ["row 2", "DAF", "not between 1 and 10"]),
            ("radius [m],SWL [t],side_lead [rad]\n", "10,5,3\n", ["side_lead", "not between", "Check number and unit"]),
            ("radius [m],Hs [m],SWL [t]\n", "10,1,100\n10,2,110\n", ["10 m", "rises from 100 t", "110 t"]),
        ],
    )
    def test_a_chart_that_cannot_be_is_refused_in_one_line(self, tmp_path, head, rows, texts):
        with pytest.raises(StillhookError) as refusal:
            chart(tmp_path, rows, head)
        line = str(refusal.value)
        assert line.startswith("chart.csv")
        assert "\n" not in line
        for text in texts:
            assert text in line


class TestStepsOfHeight:
    """A limit that falls with the wave height ends a sea at its step, and within a step where the demand meets it."""

    @pytest.mark.parametrize(
        ("values", "more", "height"),
        [
            (H, {}, 1.5),  # within a step the demand meets it: 1.5 m of the step to 2 m
            (np.full(5, 1.2), {}, 2.0),  # the next step is beyond at once
            (np.full(5, 1.8), {}, 1.0),
            (np.full(5, 0.1), {}, 3.0),  # above the chart there is no capacity
            (np.full(5, 2.5), {"still": 2.5}, 0.0),  # a calm beyond the first step
            (np.full(3, 0.1), {"heights": H[:3]}, math.inf),  # nothing is known beyond the last sea
            (np.full(5, np.nan), {}, math.nan),
        ],
    )
    def test_a_limit_ends_at_its_step_or_where_the_demand_meets_it(self, values, more, height):
        assert stepped(values, **more) == pytest.approx(height, nan_ok=True)

    def test_steps_of_one_limit_are_that_limit_up_to_their_end(self):
        alike = ((1.0, 1.2), (2.0, 1.2), (9.0, 1.2))
        assert stepped(H, alike) == pytest.approx(stepped(H, ((9.0, 1.2),)))

    def test_the_limit_in_a_sea_is_that_of_the_next_higher_row(self):
        rule = Rule("rule", "a rule", "e_c_pp", "SWL", Sense.AT_MOST, Level.MPM, (PhaseKind.DEEP,), "none")
        held = Limited(rule, STEPS[0][1], "", STEPS)
        assert held.at(np.array([0.0, 1.0, 1.001, 2.0, 3.0, 3.1])).tolist() == [2.0, 2.0, 1.5, 1.5, 1.0, 0.0]
        assert utilisation(held, np.array([1.5, 1.5]), np.array([1.0, 2.0])) == pytest.approx([0.75, 1.0])


@pytest.mark.slow
class TestPlan:
    def test_a_plan_takes_the_capacity_of_the_chart_at_the_radius_of_the_tip(self, tmp_path):
        lift = load_plan(written(tmp_path))
        phase, crane = lift.phases[0], lift.crane
        static, dynamic = (CAPACITIES[name].find(lift, phase, Alternative.NONE) for name in ("SWL_tip", "SWL_dynamic"))
        assert lift.load_chart.radius_of(lift.at) == pytest.approx(15.0)
        assert static.value == pytest.approx((215e3 + crane.hook_mass) * G)
        assert [Hs for Hs, _ in static.by_Hs] == [1.0, 2.0, 3.0]
        assert dynamic.by_Hs[2][1] == pytest.approx(1.5 * static.by_Hs[2][1])
        assert "chart.csv, radius 15 m" in static.basis

    def test_a_larger_radius_carries_less_and_a_boom_gives_it(self, tmp_path):
        boom = '[boom]\npedestal = ["-15 m", "-9 m", "19 m"]\nslew = "270 deg"\nmain = ["20 m", "40 deg"]'
        lift = load_plan(
            written(
                tmp_path,
                ('[tip]\nat = "x=-15 m, y=-24 m, z=36 m"', boom),
                ('pedestal = "x=-15 m, y=-9 m"\n', ""),
                ('kind = "in-air"', 'kind = "in-air"\nlimits = { rigging-daf-air = "1.4" }'),
            )
        )
        near = load_plan(written(tmp_path))
        find = CAPACITIES["SWL"].find
        assert lift.load_chart.radius_of(lift.at) == pytest.approx(20.0 * math.cos(math.radians(40.0)))
        assert find(lift, lift.phases[0], Alternative.NONE).value < find(near, near.phases[0], Alternative.NONE).value

    def test_a_crane_that_may_not_carry_the_load_in_a_sea_limits_the_plan_to_the_step_below(self, tmp_path):
        rows = ROWS.replace("10,2,200", "10,2,50").replace("30,2,100", "30,2,40").replace("10,3,160", "10,3,45")
        lift = load_plan(written(tmp_path, rows=rows.replace("20,3,90", "20,3,35")))
        phase = lift.phases[0]
        found = limits_in(lift, closed_form(lift, phase, lift.environment.table()))
        assert (found.Hs["static-load"] == 1.0).all()

    def test_without_a_chart_the_rules_are_those_of_the_crane_file(self, tmp_path):
        text = PLAN.replace('[load_chart]\nfile = "chart.csv"\npedestal = "x=-15 m, y=-9 m"\n', "")
        (tmp_path / "bare.toml").write_text(text, encoding="utf-8")
        lift = load_plan(tmp_path / "bare.toml")
        rules = {each.rule.key: each for each in limited(lift, lift.phases[0], Alternative.NONE)}
        assert rules["dynamic-load"].limit == rules["static-load"].limit  # nobody states a dynamic factor
        assert not {"side-lead", "off-lead"} & rules.keys()

    def test_a_chart_is_part_of_what_an_answer_follows_from(self, tmp_path):
        first = load_plan(written(tmp_path)).digest
        assert load_plan(written(tmp_path, rows=ROWS.replace("10,1,240", "10,1,241"))).digest != first

    @pytest.mark.parametrize(
        ("changes", "rows", "texts"),
        [
            ((), ROWS.replace("240", "260"), ["SWL 260 t at 10 m", "above the SWL 250 t of nov-250t"]),
            ((("y=-9 m", "y=8 m"),), ROWS, ["over the side", "radius of 32 m", "from 10 m to 30 m"]),
            ((('pedestal = "x=-15 m, y=-9 m"', ""),), ROWS, ["load_chart", "axis of slewing is missing"]),
            ((("[load_chart]\n", '[load_chart]\nradius = "15 m"\n'),), ROWS, ["load_chart", "both are given"]),
            ((("chart.csv", "none.csv"),), ROWS, ["load_chart.file", "no such file"]),
            (
                (
                    ('pedestal = "x=-15 m, y=-9 m"', 'radius = "15 m"'),
                    ('kind = "in-air"', 'kind = "in-air"\ntip = "x=-15 m, y=-20 m, z=36 m"'),
                ),
                ROWS,
                ["over the side", "has another tip", "load_chart.pedestal"],
            ),
        ],
    )
    def test_what_does_not_fit_is_refused_in_one_line_with_exit_code_2(self, tmp_path, capsys, changes, rows, texts):
        assert run(["plan", str(written(tmp_path, *changes, rows=rows)), "--check"]) == 2
        line = capsys.readouterr().err.strip()
        assert "\n" not in line
        for text in texts:
            assert text in line

    def test_radius_alone_gives_capacity_and_says_that_leads_are_not_judged(self, tmp_path):
        lift = load_plan(written(tmp_path, ('pedestal = "x=-15 m, y=-9 m"', 'radius = "15 m"')))
        assert "off_lead" not in closed_form(lift, lift.phases[0], lift.environment.table()).values
        assert any("NOT JUDGED" in note and "where the boom points" in note for note in lift.notes)

    def test_the_answer_ends_at_the_chart_and_names_it(self, tmp_path, capsys):
        result = planned(load_plan(written(tmp_path)), tier="closed-form")
        assert float(result.data["Hs_limit"].max()) <= 3.0
        assert any("NOT JUDGED in splash" in str(line) for line in result.facts["remarks"])
        assert "load chart" in {row["item"] for row in result.facts["inputs"]}
        static = next(row for row in result.facts["limited"] if row["rule"] == "static-load")
        assert [step["Hs"] for step in static["by_Hs"]] == [1.0, 2.0, 3.0]
        json.dumps(static)


@pytest.mark.slow
def test_a_year_of_spectra_is_held_against_the_chart_as_well(tmp_path):
    n, unknown = 4, np.full(4, math.nan)
    time = np.datetime64("2020-01-01T00:00:00") + np.arange(n) * np.timedelta64(3600, "s")
    states = SeaStates(time, np.ones(n, dtype=bool), np.full(n, 0.4), np.full(n, 8.0), unknown, unknown)
    off = 'kind = "splash-zone"\nlimits = { slack-sling = "off", snap-load = "off", rigging-daf-subsea = "off" }'
    found = {}
    for name, SWL in (("strong", 120), ("weak", 30)):  # 60 t at rest; forecasts are raised to 1 m
        rows = "".join(f"{r},{Hs},{SWL if Hs > 0.5 else 120}\n" for Hs in (0.5, 3) for r in (10, 30))
        path = written(tmp_path, ('kind = "splash-zone"', off), rows=rows, head="radius [m],Hs [m],SWL [t]\n")
        lift = replace(load_plan(path), T_POP=3600.0, T_C=0.0)
        answer = spectral_persistence(lift, Waves(states, beta="180 deg"), load_alpha_table())
        found[name] = answer["alternatives"][0]["operability"]
        assert any("static load and leads of the load chart" in note for note in answer["notes"])
    assert found == {"strong": 1.0, "weak": 0.0}


class TestLeads:
    """Angles of the wire: of a pendulum under a moving tip, on a crane that heels."""

    OMEGA = np.linspace(0.1, 2.5, 49)

    def lift(self, tmp_path, H, **chart_of):
        """A plan on a vessel with motions H (6,) [m/m, rad/m] of all waves from all sides; the boom points to port."""
        flat = np.broadcast_to(np.asarray(H, complex)[:, None, None], (len(DOFS), 36, len(self.OMEGA))).copy()
        vessel = Rao("made up", self.OMEGA, np.radians(np.arange(0.0, 360.0, 10.0)), flat)
        lift = load_plan(written(tmp_path))
        crane = CraneChart(lift.load_chart.chart, pedestal=(-15.0, -40.0), **chart_of)
        return replace(lift, vessel=vessel, load_chart=crane, at=TipPoint(-15.0, -24.0, 36.0))

    def largest(self, lift, Tp=10.0, Hs=2.0):
        seas = Seas(np.array([Hs]), np.array([Tp]), np.array([math.pi]))
        found = leads(lift, lift.phases[0], seas, 1800.0, {"off_lead": 0.9, "side_lead": 0.9})
        return {name: float(x[0]) for name, x in found.items()}

    @pytest.mark.slow
    def test_a_tip_that_sways_in_the_plane_of_the_boom_gives_off_lead_and_across_it_side_lead(self, tmp_path):
        sway = self.largest(self.lift(tmp_path, [0, 1, 0, 0, 0, 0]))
        surge = self.largest(self.lift(tmp_path, [1, 0, 0, 0, 0, 0]))
        assert sway["off_lead"] > 0.01
        assert sway["side_lead"] == pytest.approx(0.0, abs=1e-9)
        assert surge["side_lead"] == pytest.approx(sway["off_lead"])
        assert surge["off_lead"] == pytest.approx(0.0, abs=1e-9)

    @pytest.mark.slow
    def test_static_heel_is_off_lead_of_a_boom_over_the_side_and_trim_side_lead(self, tmp_path):
        lift = self.lift(tmp_path, np.zeros(6), heel=math.radians(2.0), trim=math.radians(1.0))
        still = self.largest(lift)
        assert still == pytest.approx({"off_lead": math.radians(2.0), "side_lead": math.radians(1.0)})
        assert calm(lift, lift.phases[0])["off_lead"] == pytest.approx(math.radians(2.0))

    @pytest.mark.slow
    def test_damping_makes_a_resonant_swing_smaller(self, tmp_path):
        free, damped = (
            self.largest(self.lift(tmp_path, [0, 1, 0, 0, 0, 0], swing_damping=z))["off_lead"] for z in (0.05, 0.3)
        )
        assert damped < 0.6 * free

    @pytest.mark.slow
    @pytest.mark.parametrize("omega", [0.3, 0.55, 0.6, 1.4])
    def test_the_swing_is_that_of_a_pendulum_integrated_in_time(self, tmp_path, omega):
        from stillhook.plan.tiers.closed_form import _transfer

        lift, L, zeta = self.lift(tmp_path, [0, 1, 0, 0.004, 0, 0]), 28.0, 0.05
        tip = lift.tip_of(lift.phases[0])
        at, head_sea = np.array([omega]), np.array([math.pi])
        transfer = _transfer(lift, lift.load_chart, tip, at, head_sea, in_air(L, zeta, at))["off_lead"][0, 0]
        sway, roll = 1.0 - 36.0 * 0.004, 0.004

        def swing(t, y):
            tip_at, tip_speed = sway * math.cos(omega * t), -sway * omega * math.sin(omega * t)
            hang, rate = y[0] - tip_at, y[1] - tip_speed
            return [y[1], -G / L * hang - 2.0 * zeta * math.sqrt(G / L) * rate]

        end = 400.0
        t = np.linspace(end - 2.0 * math.pi / omega, end, 400)
        y = solve_ivp(swing, (0.0, end), [0.0, 0.0], t_eval=t, rtol=1e-8, atol=1e-8).y[0]
        lead = (y - sway * np.cos(omega * t)) / L - roll * np.cos(omega * t)
        assert np.abs(lead).max() == pytest.approx(abs(transfer), rel=SPECTRA)

    @pytest.mark.slow
    def test_under_water_nothing_is_judged(self, tmp_path):
        lift = load_plan(written(tmp_path))
        assert leads(lift, lift.phases[1], lift.environment.table(), 1800.0, {}) == {}
