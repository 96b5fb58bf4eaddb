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
    from stillhook import analysis, identify, metrics, validate
    from stillhook.analysis.compare import compare
    from stillhook.crane import Crane
    from stillhook.engine.simulate import simulate
    from stillhook.errors import StillhookError
    from stillhook.io.motion_file import read_tip_motion
    from stillhook.io.results import load_run, save_run
    from stillhook.library.load import cranes, load_crane
    from stillhook.scenario import Mode, Scenario
    from stillhook.sea.motion import Profile, Sine, Still
    from stillhook.sea.recorded import Recorded

_HOMES = {
    "Crane": "crane",
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
    "load_run": "io.results",
    "metrics": "",
    "read_tip_motion": "io.motion_file",
    "save_run": "io.results",
    "simulate": "engine.simulate",
    "validate": "",
}
__all__ = [
    "Crane",
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
    "load_run",
    "metrics",
    "read_tip_motion",
    "save_run",
    "simulate",
    "validate",
]

__getattr__, __dir__ = attached(__name__, _HOMES)
