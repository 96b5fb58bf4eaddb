"""What a figure shows, as numbers and texts: curves, bars, fields, limits and labels of its axes; not its style."""

import contextlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

NOTHING = b"<svg></svg>"
"""Stands for a drawn figure in what is written: drawing takes longer than what is drawn."""


@contextlib.contextmanager
def figures() -> Iterator[list[Any]]:
    """Figures that are written within, once each, in their order, as `shown` has them; none is drawn."""
    written: list[Any] = []
    known: list[Figure] = []

    def note(figure: Figure, target: Any) -> None:
        if not any(figure is each for each in known):
            known.append(figure)
            written.append(shown(figure))
        if hasattr(target, "write"):
            target.write(NOTHING)
        else:
            Path(target).write_bytes(NOTHING)

    def of(print_method: Any) -> Any:
        def by_canvas(canvas: Any, target: Any, **options: Any) -> None:
            if "draw" in vars(canvas.figure):  # matplotlib itself asks for the sizes of texts
                print_method(canvas, target, **options)
            else:
                note(canvas.figure, target)

        return by_canvas

    with (
        patch.object(Figure, "savefig", lambda figure, target, **_: note(figure, target)),
        patch.object(FigureCanvasAgg, "print_png", of(FigureCanvasAgg.print_png)),
        patch.object(FigureCanvasSVG, "print_svg", of(FigureCanvasSVG.print_svg)),
    ):
        yield written


def shown(figure: Figure) -> dict[str, Any]:
    """Of each of its axes, and the texts beside them."""
    texts = [text.get_text() for text in figure.texts]
    return {"texts": texts, "axes": numbered(map(_axes, figure.axes))}


def numbered(parts: Iterable[Any]) -> dict[str, Any]:
    """Parts by their number: a long list would be stored by what its parts have in common."""
    return {f"{i}": part for i, part in enumerate(parts, 1)}


def _axes(axes: Axes) -> dict[str, Any]:
    legend = axes.get_legend()
    found = {
        "labels": [axes.get_title(loc=where) for where in ("left", "center", "right")]
        + [axes.get_xlabel(), axes.get_ylabel()],
        "scales": [axes.get_xscale(), axes.get_yscale()],
        "limits": [*map(float, axes.get_xlim()), *map(float, axes.get_ylim())],
        "texts": [[*_numbers(text.get_position()), text.get_text()] for text in axes.texts],
        "legend": [] if legend is None else [text.get_text() for text in legend.get_texts()],
        "lines": [[_numbers(line.get_xdata()), _numbers(line.get_ydata())] for line in axes.lines],
        "patches": [
            _numbers(patch.get_path().vertices @ patch.get_patch_transform().get_matrix()[:2, :2].T)
            for patch in axes.patches
        ],
        "fields": [_numbers(image.get_array()) for image in axes.images],
        "collections": [_collection(each) for each in axes.collections],
    }
    return {name: value for name, value in found.items() if value}


def _collection(of: Any) -> list[Any]:
    array = of.get_array()
    paths = [_numbers(path.vertices) for path in of.get_paths()]
    return [_numbers(of.get_offsets()), paths, [] if array is None else _numbers(array)]


def _numbers(values: Any) -> list[float | None]:
    """In a row; None for what is hidden or no number."""
    array = np.ma.asarray(values)
    if array.dtype.kind == "M":
        array = array.astype("datetime64[s]").astype(float)
    flat = np.ma.filled(array.astype(float), np.nan).ravel()
    return [float(x) if np.isfinite(x) else None for x in flat]
