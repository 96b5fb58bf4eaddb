"""The block that makes the tip's motion of a motion unit and a boom, read by an interpreter of its own."""

import itertools

import numpy as np
import pytest
from tests.export.plc.structured_text import Machine

from stillhook.cli import run
from stillhook.export.plc import structured_text, verify
from stillhook.export.plc.tip import tip_block
from stillhook.sea.vessel.motion_unit import MotionUnit
from stillhook.sea.vessel.vessel_tip import VesselTip, lengths

BOOM = "x=1 m, y=-2 m, z=8 m, slew 270 deg, main 25 m 50 deg, knuckle 15 m 60 deg"


@pytest.mark.parametrize("rotations", ["exact", "small-angle"])
def test_the_text_calculates_what_a_run_takes_for_measured(rotations):
    unit = MotionUnit(rotations=rotations)
    moves = {
        "slew": [("5 s", "95 s", "180 deg")],
        "luff": [("5 s", "95 s", "70 deg")],
        "fold": [("9 s", "40 s", "9 deg")],
    }
    tip = VesselTip(BOOM, heave="sine 1 m 8 s", roll="sine 6 deg 11 s", pitch="sine 4 deg 9 s", **moves, unit=unit)
    t = np.linspace(0.0, 100.0, 301)
    columns = [*itertools.chain(*tip._attitude(t), *tip._pose(t))]
    step = Machine(structured_text(tip_block(lengths(tip.boom, exact=unit.exact)))).start()
    ours = np.array([step(*row) for row in np.column_stack(columns).tolist()])
    np.testing.assert_allclose(ours, np.column_stack(tip.measured(t)), rtol=1e-13, atol=1e-13)


def test_the_command_writes_it_next_to_the_controller_of_a_case_with_a_boom(tmp_path):
    case = f'crane = "nov-250t"\n[scenario]\nload = "100 t"\ns_w = "100 m"\n[scenario.tip]\nboom = "{BOOM}"\n'
    (tmp_path / "case.toml").write_text(case + 'unit = { at = ["1 m", "0 m", "3 m"], rotations = "small-angle" }\n')
    assert run(["plc", "export", str(tmp_path / "case.toml"), "--out", str(tmp_path / "plc")]) == 0
    file = tmp_path / "plc" / "nov-250t-tip.st"
    named, found = verify(file)
    assert named == found
    text = file.read_text()
    for line in ("FUNCTION_BLOCK SH_tip", "x : LREAL := 0.0;", "z : LREAL := 5.0;", "exact : LREAL := 0.0;"):
        assert line in text


def test_without_a_boom_there_is_no_such_block(tmp_path):
    assert run(["plc", "export", "nov-250t", "--out", str(tmp_path)]) == 0
    assert not list(tmp_path.glob("*-tip.st"))
