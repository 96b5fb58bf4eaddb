"""Pictures and PDFs where what makes them is installed, and figures as PNG."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, TypeVar

from stillhook.base.extras import how_to_get, installed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

T = TypeVar("T")
RESOLUTION = 120
"""Of pictures [dots per inch]."""


def can_draw() -> bool:
    """Whether pictures can be drawn."""
    return installed("matplotlib")


def can_set() -> bool:
    """Whether a PDF can be set."""
    return installed("typst")


def drawn(draw: Callable[[], Mapping[str, T]]) -> dict[str, T]:
    """Pictures or figures by name, as `draw` gives them; none where they cannot be drawn."""
    return dict(draw()) if can_draw() else {}


def left_out(*, pdf: bool = False) -> str:
    """A line on what a command leaves out, and how to get it; empty where it leaves out nothing. pdf: whether one
    belongs to what it writes."""
    parts = [] if can_draw() else ["Pictures"]
    parts += ["the PDF"] if pdf and not can_set() else []
    if not parts:
        return ""
    line = f"{' and '.join(parts)} {'are' if parts != ['the PDF'] else 'is'} left out. Install what makes them:"
    return f"{line[0].upper()}{line[1:]} {how_to_get('matplotlib')}."


def png(figure: Figure, resolution: int = RESOLUTION) -> bytes:
    """A figure as PNG at this resolution in dots per inch, for a file and for a page."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # heavy

    memory = io.BytesIO()
    figure.set_dpi(resolution)
    FigureCanvasAgg(figure).print_png(memory)  # type: ignore[no-untyped-call]  # savefig draws twice, once for the layout
    return memory.getvalue()


def pngs(figures: Mapping[str, Figure], resolution: int = RESOLUTION) -> dict[str, bytes]:
    """Figures as PNG by name, in their order, at this resolution in dots per inch."""
    return {name: png(figure, resolution) for name, figure in figures.items()}
