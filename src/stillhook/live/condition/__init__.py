"""The condition of a crane over years, from dated campaigns: numbers with trends, crane files by date, and whether its
certificate counts for planning.

>>> from stillhook.live.condition import follow_condition, save_condition
>>> condition = follow_condition(["2026/campaign.toml", "2027/campaign.toml"], out="condition")  # doctest: +SKIP
>>> save_condition(condition, "condition")  # doctest: +SKIP
"""

from stillhook.base.lazy import public

__getattr__, __dir__, __all__ = public(__name__)
