"""Stillhook keeps the hook still: a digital twin of hydraulic active-heave-compensated crane winches.

>>> import stillhook
>>> crane = stillhook.load_crane("nov-250t")
>>> tip = stillhook.Sine(amplitude="2.8 m", period="12 s")
>>> case = stillhook.Scenario(load="100 t", s_w="100 m", tip=tip, mode="ssc")
>>> run = stillhook.simulate(crane, case)
>>> float(run.e_c_pp)  # doctest: +SKIP
"""

from typing import TYPE_CHECKING

from stillhook._version import __version__
from stillhook.base.lazy import attached

if TYPE_CHECKING:
    from stillhook import analysis, identify, metrics, plan, response, validate
    from stillhook.analysis.compare import compare
    from stillhook.engine.lowering.lower import lower
    from stillhook.engine.scenario.simulate import simulate
    from stillhook.errors import StillhookError
    from stillhook.formats.lift.file import load_lift
    from stillhook.formats.motion.open import read_tip_motion
    from stillhook.formats.results import load_run, save_run
    from stillhook.formats.vessel.open import read_vessel
    from stillhook.library.crane_file.load import cranes, load_crane
    from stillhook.library.payloads import read_payload
    from stillhook.plan.file import load_plan
    from stillhook.sea.motion.motion import Profile, Sine, Still
    from stillhook.sea.motion.recorded import Recorded
    from stillhook.sea.spectra.text import parse_sea
    from stillhook.spec.crane import Crane
    from stillhook.spec.lift.lowering import Lowering
    from stillhook.spec.scenario import Mode, Scenario

_HOMES = {
    "Crane": "spec.crane",
    "Lowering": "spec.lift.lowering",
    "Mode": "spec.scenario",
    "Profile": "sea.motion.motion",
    "Recorded": "sea.motion.recorded",
    "Scenario": "spec.scenario",
    "Sine": "sea.motion.motion",
    "Still": "sea.motion.motion",
    "StillhookError": "errors",
    "analysis": "",
    "compare": "analysis.compare",
    "cranes": "library",
    "identify": "",
    "load_crane": "library",
    "load_lift": "formats.lift.file",
    "load_plan": "plan.file",
    "load_run": "formats.results",
    "lower": "engine.lowering.lower",
    "metrics": "",
    "parse_sea": "sea.spectra.text",
    "plan": "",
    "read_payload": "library.payloads",
    "read_tip_motion": "formats.motion.open",
    "read_vessel": "formats.vessel.open",
    "response": "",
    "save_run": "formats.results",
    "simulate": "engine.scenario.simulate",
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
