"""A document as one HTML file with its tables and figures inside, which needs nothing else to be read: contents
next to the text, figures that open and zoom, light and dark, and a form for print."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterator, Sequence
from functools import cache
from html import escape
from importlib.resources import files

from stillhook.report.document import (
    Bullets,
    Cell,
    Column,
    Columns,
    Document,
    Figure,
    Grey,
    Part,
    Section,
    Table,
    Text,
    Verdict,
)
from stillhook.report.formatting import typeset

PAGE = "document.html"
ZOOM = (
    '<dialog aria-label="Figure"><p><span></span><button value="-">-</button><button value="0">Reset</button>'
    '<button value="+">+</button><button value="close">Close</button></p><div class="stage"></div></dialog>'
)
DEPTH = 3
"""Level of the last headings that the contents list."""


@cache
def _style_and_script() -> tuple[str, str]:
    """Style and script of every page."""
    parts = re.fullmatch(
        r"<style>(.*)</style>\s*<script>(.*)</script>\s*",
        (files("stillhook.report") / PAGE).read_text(encoding="utf-8"),
        re.DOTALL,
    )
    assert parts is not None
    return parts[1], parts[2]


def html(document: Document) -> str:
    """The page. Signatures and what belongs to paper only are left out. It loads nothing, and runs no script but its
    own."""
    return "".join(_page(document))


def fragment(document: Document) -> str:
    """Title and parts for a notebook, without style and page; long tables folded."""
    parts = "".join(map(_folded, (*document.front, *document.sections)))
    return f"<div><b>{_escaped(document.heading)}</b>{parts}</div>"


FOLDED = 12
"""Rows beyond which a table is folded in a notebook."""


def _folded(part: Part) -> str:
    if isinstance(part, Section):
        return f"<h4>{_escaped(part.title)}</h4>{''.join(map(_folded, part.parts))}"
    text = "".join(_part(part, 4, {}))
    if isinstance(part, Table) and len(part.rows) > FOLDED:
        return f"<details><summary>{len(part.rows)} rows</summary>{text}</details>"
    return text


def _page(document: Document) -> Iterator[str]:
    title, (style, script) = _escaped(document.heading), _style_and_script()
    allowed = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{allowed}'"
    yield f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
    yield '<meta name="viewport" content="width=device-width,initial-scale=1">'
    yield f'<meta http-equiv="Content-Security-Policy" content="{policy}"><style>{style}</style></head>\n<body>'
    anchors = _anchors(document)
    yield from _contents(document, anchors)
    yield f'<main><section id="top"><h1>{title}</h1>'
    if document.subtitle:
        yield f'<p class="subtitle">{_escaped(document.subtitle)}</p>'
    if document.marks:
        yield f'<p class="mark">{_escaped(". ".join(mark.rstrip(".") for mark in document.marks))}.</p>'
    for part in document.front:
        yield from _part(part, 2, anchors)
    yield "</section>"
    for part in document.sections:
        yield from _part(part, 2, anchors)
    number = f"No. {document.number}, {document.date}. " if document.number else ""
    yield f"<p><small>{_escaped(number)}Made by {_escaped(document.made_by)}.</small></p></main>"
    yield f"{ZOOM}<script>{script}</script></body></html>\n"


def _anchors(document: Document) -> dict[int, str]:
    """Of the sections, by their identity."""
    return {id(part): f"s{i}" for i, part in enumerate(p for p in document.parts if isinstance(p, Section))}


def _contents(document: Document, anchors: dict[int, str]) -> Iterator[str]:
    """The list of sections next to the text."""

    def entries(parts: Sequence[Part], level: int) -> Iterator[str]:
        found = [part for part in parts if isinstance(part, Section)] if level <= DEPTH else []
        if found:
            yield "<ol>"
            for part in found:
                yield f'<li><a href="#{anchors[id(part)]}">{_escaped(part.title)}</a>'
                yield from entries(part.parts, level + 1)
                yield "</li>"
            yield "</ol>"

    yield f'<nav aria-label="Contents"><a href="#top">{_escaped(document.title)}</a>'
    yield from entries(document.sections, 2)
    yield "</nav>"


def _part(part: Part, level: int, anchors: dict[int, str]) -> Iterator[str]:
    """level: of the headings of sections; anchors: of sections, by their identity."""
    match part:
        case Text(text):
            yield f"<p>{_escaped(text)}</p>"
        case Bullets(lines):
            yield f"<ul>{''.join(f'<li>{_escaped(line)}</li>' for line in lines)}</ul>"
        case Verdict(word, passed, paragraphs):
            body = "".join(f"<p>{_escaped(text)}</p>" for text in (word, *paragraphs))
            yield f'<div class="verdict{_colour(passed)}">{body}</div>'
        case Table():
            yield from _table(part, level)
        case Figure():
            yield from _figure(part)
        case Columns(parts, widths):
            columns = " ".join(f"minmax(0,{width:g}fr)" for width in widths)
            yield f'<div class="columns" style="grid-template-columns:{columns}">'
            for inner in parts:
                yield "<div>"
                yield from _part(inner, level, anchors)
                yield "</div>"
            yield "</div>"
        case Section(title, parts):
            yield f'<section id="{anchors[id(part)]}"><h{level}>{_escaped(title)}</h{level}>'
            for inner in parts:
                yield from _part(inner, level + 1, anchors)
            yield "</section>"


def _figure(figure: Figure) -> Iterator[str]:
    """A figure that opens and zooms: drawn as lines where it is there as SVG, else as a picture."""
    caption = _escaped(figure.caption)
    if figure.svg:
        image = _inline(figure.svg, caption)
    else:
        image = f'<img alt="{caption}" src="data:image/png;base64,{base64.b64encode(figure.png).decode("ascii")}">'
    words = f'<button>Enlarge</button><span class="caption">{caption}</span>'
    yield f"<figure>{image}<figcaption>{words}</figcaption></figure>"


BEFORE_SVG = re.compile(r"^.*?(?=<svg)|<!--.*?-->|<metadata>.*?</metadata>| xmlns(:xlink)?=\"[^\"]*\"", re.DOTALL)
GROUP = re.compile(r'<g id="[^"]*"')
BOX = re.compile(r'<svg [^>]*?(viewBox="[^"]*")[^>]*>')
INKS = {"#000000": "currentColor", "#ffffff": "var(--paper)"}
"""Colours of matplotlib's frames and paper, which follow the page."""


def _inline(svg: str, caption: str) -> str:
    """An SVG of matplotlib as a part of a page: without its head, remarks and names of groups, in colours of the page.
    Names of shapes and clips are those of their content: two figures may share them."""
    plain = GROUP.sub("<g", BEFORE_SVG.sub("", svg))
    plain = BOX.sub(rf'<svg role="img" aria-label="{_literal(caption)}" \1>', plain, count=1)
    for ink, colour in INKS.items():
        plain = plain.replace(f": {ink}", f": {colour}")
    return plain.strip()


def _literal(text: str) -> str:
    """A text as a replacement of a pattern."""
    return text.replace("\\", r"\\")


def _colour(passed: bool | None) -> str:
    return {None: "", True: " yes", False: " no"}[passed]


def _table(table: Table, level: int) -> Iterator[str]:
    if table.title:
        yield f"<h{level}>{_escaped(table.title)}</h{level}>"
    kinds = table.kinds
    yield '<div class="scroll"><table>' if table.header else '<div class="scroll"><table class="facts">'
    if table.header:
        heads = zip(table.heads(), kinds, strict=True)
        cells = "".join(f"<th class={kind.value}>{_escaped(head)}</th>" for head, kind in heads)
        yield f"<thead><tr>{cells}</tr></thead>"
    for i, row in enumerate(table.rows):
        bold = [i in table.bold_rows or k in table.bold_columns for k in range(len(row))]
        yield f"<tr>{''.join(map(_cell, row, kinds, bold))}</tr>"
    yield "</table></div>"


def _cell(cell: Cell, kind: Column, bold: bool) -> str:
    if isinstance(cell, Verdict):
        content = f'<span class="{_colour(cell.passed).strip()}">{_escaped(cell.word)}</span>'
    else:
        first, *notes = cell.split("\n")
        content = f"<b>{_escaped(first)}</b>" if bold else _escaped(first)
        content += _notes(notes)
    return (
        f'<td class="{kind.value} grey">{content}</td>'
        if isinstance(cell, Grey)
        else f"<td class={kind.value}>{content}</td>"
    )


def _notes(lines: Sequence[str]) -> str:
    return "".join(f"<small>{_escaped(line)}</small>" for line in lines)


def _escaped(text: str) -> str:
    return escape(typeset(text))
