"""A page that a colleague can read without the program: one HTML file with its tables and pictures inside."""

from __future__ import annotations

import base64
import io
from collections.abc import Collection, Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING

from stillhook._version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESOLUTION = 120
"""Of pictures [dots per inch]."""
SHORT = 20  # characters: in a table of words a cell of no more is not folded
STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:64em;margin:2em auto;padding:0 1em;color:#222}
h1{font-size:1.5em}h2{font-size:1.2em;margin-top:2em}table{border-collapse:collapse;font-size:.9em;margin:1em 0}
td{white-space:nowrap}td:last-child{white-space:normal}
td,th{padding:.25em .7em;border-bottom:1px solid #ddd;text-align:right;vertical-align:top}
td:first-child,th:first-child{text-align:left}
img{max-width:100%}figcaption{font-size:.85em;color:#555}
figure{margin:1.5em 0}tr.chosen td{font-weight:600}
table.words td,table.words th{white-space:normal;text-align:left}table.words td.short{white-space:nowrap}
h3{font-size:1em;margin:1.5em 0 .3em}
.synthetic{background:#fff3cd;padding:.6em 1em}
.no,tr.no td{color:#a00;font-weight:600}.yes{color:#060;font-weight:600}"""


def page(title: str, parts: Iterable[str], *, synthetic: str = "") -> str:
    """The whole page; parts are HTML, synthetic a remark at the top about data that were not measured."""
    warning = f'<p class="synthetic">{escape(synthetic)}</p>' if synthetic else ""
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{STYLE}</style>'
    foot = f"<p><small>Made by Stillhook {escape(__version__)}.</small></p>"
    return (
        "<!doctype html>\n<html"
        f' lang="en">{head}<body><h1>{escape(title)}</h1>{warning}{"".join(parts)}{foot}</body></html>\n'
    )


def heading(text: str) -> str:
    return f"<h2>{escape(text)}</h2>"


def subheading(text: str) -> str:
    return f"<h3>{escape(text)}</h3>"


def paragraph(text: str, *, no: bool = False, yes: bool = False) -> str:
    """A paragraph; no, yes: the answer is "no", or "yes", and shows."""
    return f"<p{' class=no' if no else ' class=yes' if yes else ''}>{escape(text)}</p>"


def bullets(lines: Iterable[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>"


def table(
    header: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    chosen: int | None = None,
    no: Collection[int] = (),
    words: bool = False,
) -> str:
    """A table of texts; the chosen row is set bold, the rows `no` in red; words: columns of words, which fold, in place
    of numbers."""
    head = "".join(f"<th>{escape(h)}</th>" for h in header)
    body = "".join(
        f"<tr{_row_class(i in no, i == chosen)}>" + "".join(_cell(c, words) for c in row) + "</tr>"
        for i, row in enumerate(rows)
    )
    return f"<table{' class=words' if words else ''}><tr>{head}</tr>{body}</table>"


def _row_class(no: bool, chosen: bool) -> str:
    return " class=no" if no else " class=chosen" if chosen else ""


def _cell(text: str, words: bool) -> str:
    return f"<td{' class=short' if words and len(text) <= SHORT else ''}>{escape(text)}</td>"


def png(figure: Figure, resolution: int = RESOLUTION) -> bytes:
    """A figure as PNG at this resolution in dots per inch, for a file and for a page."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # heavy

    memory = io.BytesIO()
    figure.set_dpi(resolution)
    FigureCanvasAgg(figure).print_png(memory)  # type: ignore[no-untyped-call]  # savefig draws twice, once for the layout
    return memory.getvalue()


def picture(data: bytes, caption: str) -> str:
    """A PNG, inside the page."""
    image = f'<img alt="{escape(caption)}" src="data:image/png;base64,{base64.b64encode(data).decode("ascii")}">'
    return f"<figure>{image}<figcaption>{escape(caption)}</figcaption></figure>"
