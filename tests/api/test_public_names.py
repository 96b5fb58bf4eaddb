"""Every public name has a docstring with an example, and the example runs as it is printed."""

from __future__ import annotations

import doctest
import inspect
import re
from collections.abc import Callable
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


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_examples_run_as_they_are_printed(name: str) -> None:
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=FLAGS)
    assert runner.run(example(name), out=said.append).failed == 0, "".join(said)


def test_modules_of_the_face_are_modules() -> None:
    faces = {"analysis", "identify", "metrics", "plan", "plot", "response", "validate"}
    assert {n for n in NAMES if isinstance(getattr(stillhook, n), ModuleType)} == faces


def public_functions() -> dict[str, Callable[..., Any]]:
    """Functions of the eight faces by their full name."""
    faces = [stillhook, *(thing for name in NAMES if isinstance(thing := getattr(stillhook, name), ModuleType))]
    return {
        f"{face.__name__}.{name}": thing
        for face in faces
        for name in getattr(face, "__all__", dir(face))
        if inspect.isfunction(thing := getattr(face, name))
    }


FUNCTIONS = public_functions()


def sections(function: Callable[..., Any]) -> dict[str, str]:
    """Numpydoc sections of a docstring by title."""
    parts = re.split(r"^(\w+)\n-+$", inspect.getdoc(function) or "", flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def test_there_are_eight_faces() -> None:
    assert len({name.rpartition(".")[0] for name in FUNCTIONS}) == 8


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_documents_its_arguments_and_what_it_returns(name: str) -> None:
    """In sections of numpydoc, in their order, under a summary of one line."""
    function, of = FUNCTIONS[name], sections(FUNCTIONS[name])
    documented = re.findall(r"^\**(\w+) : \S", of.get("Parameters", ""), flags=re.MULTILINE)
    assert sorted(documented) == sorted(inspect.signature(function).parameters)
    assert of.get("Returns", "").strip()
    assert list(of) == [title for title in ("Parameters", "Returns", "Raises", "Notes", "Examples") if title in of]
    assert (inspect.getdoc(function) or "").splitlines()[1] == ""
