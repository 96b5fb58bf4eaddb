"""Friction from tests: motor loss models, crane tests, system friction, their uncertainty, and what to test next.

>>> from stillhook import identify
>>> result = identify.friction("my-tests/campaign.toml")  # doctest: +SKIP
"""

from typing import TYPE_CHECKING

from stillhook.base.lazy import attached

if TYPE_CHECKING:
    from stillhook.identify.curve import friction_curve
    from stillhook.identify.motor.identify import MotorLoss, identify_motor
    from stillhook.identify.motor.map import LossMap, mapped_loss, read_map
    from stillhook.identify.motor.synthetic_map import synthetic_map
    from stillhook.identify.system_friction.campaign.file import Campaign, load_campaign
    from stillhook.identify.system_friction.campaign.synthetic import campaign_plan, write_campaign
    from stillhook.identify.system_friction.fitting.draws import draw_cranes
    from stillhook.identify.system_friction.identify import Friction, friction
    from stillhook.identify.system_friction.motor_refit import second_loop
    from stillhook.logs.log import Log, read_log

_HOMES = {
    "Campaign": "identify.system_friction.campaign.file",
    "Friction": "identify.system_friction.identify",
    "Log": "logs.log",
    "LossMap": "identify.motor.map",
    "MotorLoss": "identify.motor.identify",
    "campaign_plan": "identify.system_friction.campaign.synthetic",
    "draw_cranes": "identify.system_friction.fitting.draws",
    "friction": "identify.system_friction.identify",
    "friction_curve": "identify.curve",
    "identify_motor": "identify.motor.identify",
    "load_campaign": "identify.system_friction.campaign.file",
    "mapped_loss": "identify.motor.map",
    "read_log": "logs.log",
    "read_map": "identify.motor.map",
    "second_loop": "identify.system_friction.motor_refit",
    "synthetic_map": "identify.motor.synthetic_map",
    "write_campaign": "identify.system_friction.campaign.synthetic",
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
