"""Derivatives of a winch's own rates, for closed forms of its poles."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np


def jacobian(rates: Callable[[Any], Any], at: Any, steps: Mapping[str, float]) -> np.ndarray:
    """d(rates)/d(state) about a state, of the fields in `steps`, by central differences of these sizes."""

    def slope(name: str, h: float) -> list[float]:
        more, less = (rates(at._replace(**{name: getattr(at, name) + d})) for d in (h, -h))
        return [(getattr(more, field) - getattr(less, field)) / (2.0 * h) for field in steps]

    return np.array([slope(name, h) for name, h in steps.items()]).T
