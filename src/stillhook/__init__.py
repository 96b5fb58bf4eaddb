"""Stillhook keeps the hook still: a digital twin of hydraulic active-heave-compensated crane winches.

>>> import stillhook
>>> crane = stillhook.load_crane("nov-250t")
>>> case = stillhook.Scenario(load="100 t", s_w="100 m", tip=stillhook.Sine(amplitude="2.8 m", period="12 s"), mode="ssc")
>>> run = stillhook.simulate(crane, case)
>>> float(run.e_c_pp)  # doctest: +SKIP
"""

from typing import TYPE_CHECKING

from stillhook._lazy import attached
from stillhook._version import __version__

if TYPE_CHECKING:
    from stillhook import analysis, identify, metrics, plan, response, validate
    from stillhook.analysis.compare import compare
    from stillhook.crane import Crane
    from stillhook.engine.lower import lower
    from stillhook.engine.simulate import simulate
    from stillhook.errors import StillhookError
    from stillhook.io.lift_file import load_lift
    from stillhook.io.motion_file import read_tip_motion
    from stillhook.io.results import load_run, save_run
    from stillhook.io.vessel_file import read_vessel
    from stillhook.library.load import cranes, load_crane
    from stillhook.library.payloads import read_payload
    from stillhook.lift.lowering import Lowering
    from stillhook.plan.plan_file import load_plan
    from stillhook.scenario import Mode, Scenario
    from stillhook.sea.motion import Profile, Sine, Still
    from stillhook.sea.recorded import Recorded
    from stillhook.sea.sea_text import parse_sea

_HOMES = {
    "Crane": "crane",
    "Lowering": "lift.lowering",
    "Mode": "scenario",
    "Profile": "sea.motion",
    "Recorded": "sea.recorded",
    "Scenario": "scenario",
    "Sine": "sea.motion",
    "Still": "sea.motion",
    "StillhookError": "errors",
    "analysis": "",
    "compare": "analysis.compare",
    "cranes": "library",
    "identify": "",
    "load_crane": "library",
    "load_lift": "io.lift_file",
    "load_plan": "plan.plan_file",
    "load_run": "io.results",
    "lower": "engine.lower",
    "metrics": "",
    "parse_sea": "sea.sea_text",
    "plan": "",
    "read_payload": "library.payloads",
    "read_tip_motion": "io.motion_file",
    "read_vessel": "io.vessel_file",
    "response": "",
    "save_run": "io.results",
    "simulate": "engine.simulate",
    "validate": "",
}
__all__ = [
    "Crane",
    "Lowering",
    "Mode",
    "Profile",
    "Recorded",
    "Scenario",
    "Sine",
    "Still",
    "StillhookError",
    "__version__",
    "analysis",
    "compare",
    "cranes",
    "identify",
    "load_crane",
    "load_lift",
    "load_plan",
    "load_run",
    "lower",
    "metrics",
    "parse_sea",
    "plan",
    "read_payload",
    "read_tip_motion",
    "read_vessel",
    "response",
    "save_run",
    "simulate",
    "validate",
]

__getattr__, __dir__ = attached(__name__, _HOMES)
