"""Friction from tests: motor loss models, crane tests, system friction, their uncertainty, and what to test next.

>>> from stillhook import identify
>>> result = identify.friction("my-tests/campaign.toml")  # doctest: +SKIP
"""

from typing import TYPE_CHECKING

from stillhook._lazy import attached

if TYPE_CHECKING:
    from stillhook.identify.campaign import Campaign, load_campaign
    from stillhook.identify.curve import friction_curve
    from stillhook.identify.draws import draw_cranes
    from stillhook.identify.from_tests import Friction, friction
    from stillhook.identify.loss_map import LossMap, mapped_loss, read_map
    from stillhook.identify.motor import MotorLoss, identify_motor
    from stillhook.identify.motor_refit import second_loop
    from stillhook.identify.synthetic_map import synthetic_map
    from stillhook.identify.twin_tests import campaign_plan, write_campaign
    from stillhook.io.log import Log, read_log

_HOMES = {
    "Campaign": "identify.campaign",
    "Friction": "identify.from_tests",
    "Log": "io.log",
    "LossMap": "identify.loss_map",
    "MotorLoss": "identify.motor",
    "campaign_plan": "identify.twin_tests",
    "draw_cranes": "identify.draws",
    "friction": "identify.from_tests",
    "friction_curve": "identify.curve",
    "identify_motor": "identify.motor",
    "load_campaign": "identify.campaign",
    "mapped_loss": "identify.loss_map",
    "read_log": "io.log",
    "read_map": "identify.loss_map",
    "second_loop": "identify.motor_refit",
    "synthetic_map": "identify.synthetic_map",
    "write_campaign": "identify.twin_tests",
}
__all__ = [
    "Campaign",
    "Friction",
    "Log",
    "LossMap",
    "MotorLoss",
    "campaign_plan",
    "draw_cranes",
    "friction",
    "friction_curve",
    "identify_motor",
    "load_campaign",
    "mapped_loss",
    "read_log",
    "read_map",
    "second_loop",
    "synthetic_map",
    "write_campaign",
]

__getattr__, __dir__ = attached(__name__, _HOMES)
