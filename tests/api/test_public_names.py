"""Every public name has a docstring with an example, and the example runs as it is printed."""

from __future__ import annotations

import doctest
import inspect
from types import ModuleType
from typing import Any

import pytest

import stillhook

NAMES = [name for name in dir(stillhook) if not name.startswith("_")]
FLAGS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS


def example(name: str) -> doctest.DocTest:
    """The example in the docstring of a public name; of a module, that of the module itself."""
    thing: Any = getattr(stillhook, name)
    text = inspect.getdoc(thing) or ""
    return doctest.DocTestParser().get_doctest(text, {"__name__": "example"}, name, None, None)


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_has_an_example(name: str) -> None:
    assert example(name).examples


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_examples_run_as_they_are_printed(name: str) -> None:
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=FLAGS)
    assert runner.run(example(name), out=said.append).failed == 0, "".join(said)


def test_modules_of_the_face_are_modules() -> None:
    faces = {"analysis", "identify", "metrics", "plan", "response", "validate"}
    assert {n for n in NAMES if isinstance(getattr(stillhook, n), ModuleType)} == faces
