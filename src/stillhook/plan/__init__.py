"""In which weather may this lift be done, what limits it, how long is the wait, and what does a better controller gain?

>>> from stillhook import plan
>>> result = plan.plan("template-to-1500m", tier="frequency")  # doctest: +SKIP
>>> result.data["Hs_limit"].sel(credit="credited", alternative="ssc")  # doctest: +SKIP
>>> plan.save_plan(result, "plan")  # doctest: +SKIP
>>> plan.save_report(result, "plan")  # doctest: +SKIP
"""

from stillhook.base.lazy import public

__getattr__, __dir__, __all__ = public(__name__)
