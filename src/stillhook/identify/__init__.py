"""Friction from tests: motor loss models, crane tests, system friction, their uncertainty, and what to test next.

>>> from stillhook import identify
>>> result = identify.friction("my-tests/campaign.toml")  # doctest: +SKIP
"""

from stillhook.base.lazy import public

__getattr__, __dir__, __all__ = public(__name__)
