"""Bounds of what users write: what must be positive may be as small as one likes."""

import importlib
import pkgutil
from collections.abc import Iterator
from typing import Any

import pytest
from pydantic import BaseModel

import stillhook

PARTS = ("physics", "winches", "spec", "analysis", "identify", "plan", "live", "formats", "sea")


def _below(model: type[Any]) -> Iterator[type[Any]]:
    for child in model.__subclasses__():
        yield child
        yield from _below(child)


@pytest.mark.slow
def test_what_must_be_positive_may_be_as_small_as_one_likes() -> None:
    """However small a model winch: a torque of 0.5 N m is one. Only a low weight is more than half of the nominal."""
    for part in PARTS:
        for module in pkgutil.walk_packages([f"{stillhook.__path__[0]}/{part}"], f"stillhook.{part}."):
            importlib.import_module(module.name)
    bounds = {
        f"{model.__name__}.{name}": bound.gt
        for model in {*_below(BaseModel)}
        if model.__module__.startswith("stillhook.")
        for name, field in model.model_fields.items()
        for bound in field.metadata
        if hasattr(bound, "gt")
    }
    assert len(bounds) > 200
    assert {name: bound for name, bound in bounds.items() if bound != 0} == {"WeightTable.low": 0.5}
