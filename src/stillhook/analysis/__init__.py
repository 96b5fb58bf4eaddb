"""Analyses of a crane with the twin: stability, envelopes, maps, tuning, uncertainty, comparisons.

>>> import stillhook
>>> crane = stillhook.load_crane("nov-250t")
>>> round(stillhook.analysis.stability(crane).K_p_ms, 6)
2.026039
"""

from stillhook.base.lazy import public

__getattr__, __dir__, __all__ = public(__name__)
