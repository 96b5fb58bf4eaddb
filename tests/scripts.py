"""Scripts of the documentation as modules."""

import importlib
import sys
from pathlib import Path
from types import ModuleType

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGES = DOCS / "validation"


def script(path: Path) -> ModuleType:
    """A script as a module under its name; it finds those beside it."""
    folder = str(path.parent)
    if folder not in sys.path:
        sys.path.append(folder)
    return importlib.import_module(path.stem)
