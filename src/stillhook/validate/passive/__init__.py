"""Step 6: the passive circuit that carries the load, by balances of the logs: gas, stroke, motors, setting, make-up."""

from stillhook.validate.passive.step import PassiveStep, check_passive

__all__ = ["PassiveStep", "check_passive"]
