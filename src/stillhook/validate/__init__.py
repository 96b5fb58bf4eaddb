"""Validation of a twin: logs of a crane's tests compared with the twin, step by step, by written
criteria.

Source: Moslatt 2020 paper F and sections 2.5-2.6.

>>> from stillhook import validate
>>> result = validate.validate("sea-trial/campaign.toml")  # doctest: +SKIP
>>> result.passed, [line.message for line in result.lines if line.failed]  # doctest: +SKIP
>>> validate.save_validation(result, "validation")  # doctest: +SKIP
"""

from stillhook.base.lazy import public

__getattr__, __dir__, __all__ = public(__name__)
