"""The frequency-domain method from a sea to the load: exact rod, winch residual, linearised drag, statistics.

>>> import stillhook
>>> from stillhook import response
>>> file = stillhook.load_lift("anchor-to-3000m")
>>> result = response.lift_response(file, response.Waves(file.sea), depth="2900 m", duration="1 h")  # doctest: +SKIP
>>> float(result.data.sigma_load[0])  # doctest: +SKIP
"""

from stillhook.base.lazy import public

__getattr__, __dir__, __all__ = public(__name__)
