"""What the live twin remembers: a journal that acknowledges, hourly Parquet files, and one table over both.

>>> from stillhook.live.history import History, archive, read
>>> with History("history", ["p_a", "omega_m"]) as history:  # doctest: +SKIP
...     history.append(1.7e9, [[210e5, 91.0]])
>>> archive("history")  # doctest: +SKIP
>>> read("history", signals=["p_a"], every="1 s")  # doctest: +SKIP
"""

from stillhook.base.lazy import public

__getattr__, __dir__, __all__ = public(__name__)
