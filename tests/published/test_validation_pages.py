"""The validation pages show what the package computes today, with pictures small enough for a repository."""

from pathlib import Path

import pytest
from tests.scripts import PAGES, script

LARGEST_PICTURE = 150_000  # bytes


MAKE = script(PAGES / "make.py")


@pytest.mark.thorough
@pytest.mark.parametrize("script", [*MAKE.scripts(), None], ids=lambda s: s or "front page")
def test_tables_are_what_the_package_computes_now(script: str | None):
    assert MAKE.outdated(script) == ""


@pytest.mark.parametrize("path", sorted((PAGES / "figures").glob("*.png")), ids=lambda p: p.name)
def test_picture_is_small_and_shown_on_a_page(path: Path):
    assert path.stat().st_size < LARGEST_PICTURE
    assert any(f"figures/{path.name}" in page.read_text(encoding="utf-8") for page in PAGES.glob("*.md"))
