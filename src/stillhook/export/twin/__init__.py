"""The winch as C99 for other programs: its variables, its source, its library."""

from stillhook.errors import ExportError
from stillhook.export.twin.compile import PLATFORMS, check_platform, compile_library, first_of, own_platform
from stillhook.export.twin.generate import CONTENTS, COUPLINGS, Export, export
from stillhook.export.twin.ports import Port

__all__ = [
    "CONTENTS",
    "COUPLINGS",
    "PLATFORMS",
    "Export",
    "ExportError",
    "Port",
    "check_platform",
    "compile_library",
    "export",
    "first_of",
    "own_platform",
]
