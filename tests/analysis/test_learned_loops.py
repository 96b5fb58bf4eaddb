"""Margins of a controller that learns: with what it remembers after a sea, on every winch type and by every path."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from stillhook import Mode, Scenario, Session, load_crane
from stillhook.analysis.loop_stability.governing import place_limits
from stillhook.analysis.loop_stability.linearisation import SEA, SEA_GAIN, SEA_TIME, learned
from stillhook.analysis.loop_stability.places import Place
from stillhook.analysis.loop_stability.stability import full_stability
from stillhook.library import changed

ROOT = Path(__file__).parents[2]
DOUBLING = """
from typing import NamedTuple

from stillhook.control.interface import DISPLACEMENT, SPEED, Demand
from stillhook.physics.scalar import fmin, scalar

NAME = "doubling"
TITLE = "feedback that is twice as strong after a minute of motion"
DRIVES = (DISPLACEMENT, SPEED)
LEARNS = True


class Memory(NamedTuple):
    seen: float = 0.0  # time in motion over a minute, 1 at most [-]


@scalar
def cycle(r, plc, m):
    seen = fmin(m.seen + plc.t_cycle / 60.0 * (1.0 if abs(r.y.a_tip) > 0.0 else 0.0), 1.0)
    return Demand(r.u_ff + (1.0 + m.seen) * r.u_fb, 1.0), Memory(seen)
"""
"""Its limit is half of that of a law with the plain feedback, once it has learned."""
EXACT = 1e-6


def limits(name: str, mode: str) -> tuple[float, float | None]:
    """Gain limit at a place [1/m], and that of the complete plant at the point alone on closed circuits."""
    crane, v = load_crane(name), 20.0 / 60.0
    if not crane.circuits:
        return place_limits(crane, Mode(mode), [Place(0.0, 100.0, v)])[0].gains.high, None
    (at,) = place_limits(crane, Mode(mode), [Place(0.0, 100.0, v)], alpha_m=1.0)
    point, _ = full_stability(crane, load=0.0, s_w=100.0, v_tip=v, alpha_m=1.0, mode=mode)
    return at.gains.high, point.K_p_ms_plc


@pytest.mark.long
@pytest.mark.parametrize(("name", "plain"), [("nov-250t", "ns"), ("nov-100t-electric", "position")])
def test_a_law_that_learns_to_feed_back_twice_as_much_has_half_the_limit(name: str, plain: str, tmp_path: Path) -> None:
    (tmp_path / "doubling.py").write_text(DOUBLING, encoding="utf-8")
    script = f"import json; from {__name__} import limits; print(json.dumps(limits({name!r}, 'doubling')))"
    paths = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
    extended = os.environ | {"STILLHOOK_EXTENSIONS": str(tmp_path / "doubling.py"), "PYTHONPATH": paths}
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env=extended, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    for found, of_plain in zip(json.loads(done.stdout), limits(name, plain), strict=True):
        assert (found is None and of_plain is None) or found == pytest.approx(0.5 * of_plain, rel=EXACT)


def test_what_is_learned_side_by_side_is_what_a_session_remembers_at_each_place() -> None:
    crane, mode, places = load_crane("nov-250t"), Mode("ff"), [(0.0, 15.0), (100e3, 487.0)]
    found = learned(crane, mode, places)
    calm = changed(crane, {"control": {"K_p": f"{SEA_GAIN} 1/m"}})
    for load, s_w in places:
        session = Session(calm, Scenario(load=f"{load} kg", s_w=f"{s_w} m", mode=mode, tip=SEA))
        session.step(cycles=round(SEA_TIME / crane.control.t_cycle))
        assert found[load, s_w] == tuple(session.state(f"ff_memory.{n}") for n in mode.law.memory._fields)


def test_other_controllers_have_learned_nothing_and_nothing_is_run_for_them() -> None:
    assert learned(load_crane("nov-250t"), Mode.SSC, [(0.0, 15.0)]) == {(0.0, 15.0): None}


def test_one_point_alone_is_judged_as_the_same_place_among_all() -> None:
    """`--full` of a controller that learns: neither claims the margin of what comes into force."""
    crane, mode = load_crane("nov-250t"), Mode("ff")
    (at,) = place_limits(crane, mode, [Place(100e3, 487.0, 1.0)], alpha_m=1.0)
    point, _ = full_stability(crane, load=100e3, s_w=487.0, v_tip=1.0, alpha_m=1.0, mode=mode)
    unlearned, _ = full_stability(crane, load=100e3, s_w=487.0, v_tip=1.0, alpha_m=1.0)
    assert point.K_p_ms_plc == pytest.approx(at.gains.high, rel=EXACT)
    assert point.K_p_ms_plc > 1.05 * unlearned.K_p_ms_plc  # its damping comes with the trust
