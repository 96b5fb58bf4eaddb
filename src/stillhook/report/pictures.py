"""Figures as pictures, left out with one line where the extra `report` is missing.

Many are drawn by two processes: drawing holds Python's lock, so that threads gain nothing."""

from __future__ import annotations

import contextlib
import io
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from stillhook.base.extras import how_to_get, installed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

T = TypeVar("T")
RESOLUTION = 120
"""Of pictures [dots per inch]."""
WORTH = 12
"""Figures from which on a second process pays for its start."""
_BOOT = (
    "import sys, pickle; sys.path[:] = pickle.load(sys.stdin.buffer); from stillhook.report.pictures import serve;"
    " serve()"
)


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
    """Figures as PNG by name, in their order, at this resolution in dots per inch; the same bytes from one process as
    from two.

    What the second process does not draw is drawn in this one.
    """
    names = list(figures)
    theirs = names[1::2] if len(names) >= WORTH and (os.cpu_count() or 1) > 1 else []
    with _second_process({n: figures[n] for n in theirs}, resolution) as pictures:
        done = {n: png(figures[n], resolution) for n in names if n not in theirs}
    done |= pictures
    return {n: done[n] if n in done else png(figures[n], resolution) for n in names}


@contextlib.contextmanager
def _second_process(figures: Mapping[str, Figure], resolution: int) -> Any:
    """Figures drawn by the second process, complete when the block ends."""
    pictures: dict[str, bytes] = {}
    message = _message(figures, resolution) if figures else b""
    if not message:
        yield pictures
        return
    try:
        process = subprocess.Popen(
            [sys.executable, "-I", "-c", _BOOT],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
    except OSError:
        yield pictures
        return

    def communicate() -> None:
        with contextlib.suppress(OSError, EOFError, ValueError, pickle.UnpicklingError):
            pictures.update(pickle.loads(process.communicate(message)[0]))

    reader = threading.Thread(target=communicate, daemon=True)
    reader.start()
    try:
        yield pictures
        reader.join()
    finally:
        process.kill()
        reader.join()


def _message(figures: Mapping[str, Figure], resolution: int) -> bytes:
    """Empty where a figure cannot be sent."""
    import matplotlib

    settings = {k: v for k, v in matplotlib.rcParams.items() if not k.startswith("backend")}
    try:
        return pickle.dumps(list(sys.path)) + pickle.dumps((settings, dict(figures), resolution))
    except (pickle.PicklingError, AttributeError, TypeError):
        return b""


def serve() -> None:
    """The second process: figures in, pictures out."""
    import matplotlib

    settings, figures, resolution = pickle.load(sys.stdin.buffer)
    matplotlib.rcParams.update(settings)
    pickle.dump({name: png(figure, resolution) for name, figure in figures.items()}, sys.stdout.buffer)
