"""What adaptation leaves over of the shaft torque, learned from logs (level 4).

>>> import sys
>>> from stillhook.live.residual import TERMS
>>> len(TERMS), "lightgbm" in sys.modules
(8, False)
"""

from stillhook.base.lazy import public

__getattr__, __dir__, __all__ = public(__name__)
