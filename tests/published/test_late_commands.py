"""Commands that are late by a bus: a longer lead of the feedforward alone gives back what they take from the control
error. The figures are those of the page docs/explanation/control.md#two-leads.

A measured prototype had 4.20 cm in process, 7.36 with commands 20 ms late, 5.84 with one longer lead and 4.45 with the
feedforward's alone, on a crane and a load that are not known; order and differences are held here, on nov-150t.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from tests.contract.test_extensions import python
from tests.scripts import DOCS

LATE = '''"""SSC whose commands reach the drive two cycles late, as over a bus."""

from typing import NamedTuple

from stillhook.control.commands import displacement_min, displacement_ssc, reduction_linear
from stillhook.control.interface import Demand
from stillhook.physics.scalar import scalar

NAME, TITLE = "late-ssc", "SSC with commands two cycles late"
USES = ("u_thr", "alpha_swl")


class Memory(NamedTuple):
    p_1: float = 0.0
    p_2: float = 0.0
    m_1: float = 1.0
    m_2: float = 1.0


@scalar
def cycle(r, plc, m):
    alpha_min = displacement_min(r.F, r.y.K_wire, plc.motors)
    u_m = displacement_ssc(reduction_linear(r.u_ff, plc.motors.u_thr), alpha_min)
    return Demand(m.p_2, m.m_2), Memory(r.u_ff + r.u_fb, m.p_1, u_m, m.m_1)
'''
RUNS = """
import json
import stillhook
from stillhook.analysis import strong_ssc
from stillhook.library import changed

crane = stillhook.load_crane("nov-150t")
near, far = (strong_ssc(crane, command_delay=late).changes["control"] for late in ("0 s", "20 ms"))
late = {name: value for name, value in far.items() if name != "t_lead_ff"}
runs = {
    "in process": ("ssc", near),
    "late": ("late-ssc", late),
    "both": ("late-ssc", late | {"t_lead": far["t_lead_ff"]}),
    "feedforward": ("late-ssc", far),
}
tip = stillhook.Sine(amplitude="1.5 m", period="9 s")
case = stillhook.Scenario(load="60 t", s_w="100 m", tip=tip, duration="120 s", warm_up="66 s")
cranes = {name: changed(crane, {"control": control}) for name, (_, control) in runs.items()}
errors = {n: float(stillhook.simulate(cranes[n], case.with_mode(mode)).e_c_pp) for n, (mode, _) in runs.items()}
servo = {"servo": {"dead_time": "20 ms"}}
units = {"active": {"pump": servo, "motor": servo}}
dead = {n: changed(crane, {"control": control, **units}) for n, (mode, control) in runs.items() if mode == "late-ssc"}
later = {n: float(stillhook.simulate(each, case.with_mode("ssc")).e_c_pp) for n, each in dead.items()}
own = strong_ssc(changed(crane, units)).changes["control"]
print(json.dumps({"errors": errors, "near": near, "far": far, "dead time": later, "own": own}))
"""
COSTS = 0.005
"""What a bus may cost with split leads [m]: the limit that hardware in the loop is given."""
PRINTED = 0.0001
"""Half of the last digit of the page [m], and as much again for another compiler's last bits."""


@pytest.fixture(scope="module")
def answer(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, float]]:
    folder: Path = tmp_path_factory.mktemp("late")
    (folder / "late_ssc.py").write_text(LATE, encoding="utf-8")
    run = python("-c", RUNS, extensions=[folder / "late_ssc.py"], folder=folder)
    assert run.returncode == 0, run.stderr
    return dict(json.loads(run.stdout))


@pytest.mark.long
def test_a_longer_lead_of_the_feedforward_alone_gives_back_what_late_commands_take(answer) -> None:
    e = answer["errors"]
    assert e["late"] > e["in process"] + 4.0 * COSTS
    assert e["feedforward"] < e["in process"] + COSTS
    assert e["feedforward"] < e["both"] - 2.0 * COSTS


@pytest.mark.long
def test_errors_of_late_commands_are_those_of_the_page(answer) -> None:
    page = (DOCS / "explanation" / "control.md").read_text(encoding="utf-8")
    row = next(line for line in page.splitlines() if line.startswith("| nov-150t, 60 t"))
    printed = [float(x) / 100.0 for x in re.findall(r"([0-9.]+) cm", row)]
    assert list(answer["errors"].values()) == pytest.approx(printed, abs=PRINTED)


@pytest.mark.slow
def test_a_late_command_takes_gain_and_belongs_to_the_lead_of_the_feedforward_alone(answer) -> None:
    near, far = answer["near"], answer["far"]
    assert float(far["K_p"].split()[0]) < float(near["K_p"].split()[0])
    assert far["t_lead"] == near["t_lead"]
    assert float(far["t_lead_ff"].split()[0]) == pytest.approx(float(near["t_lead"].split()[0]) + 20.0)


@pytest.mark.slow
def test_a_dead_time_of_pumps_and_motors_is_a_bus_to_both(answer) -> None:
    """The twin's controls with a dead time have the errors that the page prints of a controller whose commands come
    two cycles late, and strong SSC the leads that it has for such commands; its gain is lower, for what the motors'
    displacement feeds forward is late too."""
    page = (DOCS / "explanation" / "control.md").read_text(encoding="utf-8")
    row = next(line for line in page.splitlines() if line.startswith("| nov-150t, 60 t"))
    printed = [float(x) / 100.0 for x in re.findall(r"([0-9.]+) cm", row)][1:]
    assert list(answer["dead time"].values()) == pytest.approx(printed, abs=PRINTED)
    own, far = answer["own"], answer["far"]
    assert (own["t_lead"], own["t_lead_ff"]) == (far["t_lead"], far["t_lead_ff"])
    assert 0.9 < float(own["K_p"].split()[0]) / float(far["K_p"].split()[0]) < 1.0
