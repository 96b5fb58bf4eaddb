"""The validation pages show what the package computes today, with pictures small enough for a repository."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

PAGES = Path(__file__).resolve().parents[2] / "docs" / "validation"
LARGEST_PICTURE = 150_000  # bytes


def _make() -> ModuleType:
    spec = importlib.util.spec_from_file_location("validation_make", PAGES / "make.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


MAKE = _make()


@pytest.mark.thorough
@pytest.mark.parametrize("script", [*MAKE.scripts(), None], ids=lambda s: s or "front page")
def test_tables_are_what_the_package_computes_now(script: str | None):
    assert MAKE.outdated(script) == ""


@pytest.mark.parametrize("path", sorted((PAGES / "figures").glob("*.png")), ids=lambda p: p.name)
def test_picture_is_small_and_shown_on_a_page(path: Path):
    assert path.stat().st_size < LARGEST_PICTURE
    assert any(f"figures/{path.name}" in page.read_text(encoding="utf-8") for page in PAGES.glob("*.md"))
