"""Parameters of a crane that are followed while it compensates: friction first.

>>> from stillhook import load_crane
>>> from stillhook.live.estimate import FrictionEstimator
>>> estimator = FrictionEstimator(load_crane("nov-250t"))
>>> rows = {"time": [0.0, 0.01], "omega_m": [0.0, 1.0]}
>>> estimator.missing(rows)
('p_a', 'p_b', 'alpha_m', 'F_w', 's_w', 'p_hp', 'alpha_pm')
"""

from stillhook.base.lazy import public

__getattr__, __dir__, __all__ = public(__name__)
