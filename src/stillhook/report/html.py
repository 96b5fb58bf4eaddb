"""A document as one HTML file with its tables and pictures inside, which needs nothing else to be read."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from html import escape

from stillhook.report.document import Bullets, Cell, Column, Document, Figure, Part, Section, Table, Text, Verdict
from stillhook.report.formatting import typeset

STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:64em;margin:2em auto;padding:0 1em;color:#1c2226}
h1{font-size:1.5em;color:#14324a}h2{font-size:1.2em;margin-top:2em;color:#14324a}h3{font-size:1em;margin:1.5em 0 .3em}
h4{font-size:.95em;margin:1.2em 0 .3em}
table{border-collapse:collapse;font-size:.9em;margin:1em 0}h3+table,h4+table{margin-top:.3em}
td,th{padding:.25em .7em;border-bottom:1px solid #ddd;text-align:left;vertical-align:top}
th{background:#e9eef2;color:#14324a}
th.number,td.number{text-align:right}td.number,td.word{white-space:nowrap}
td.text{min-width:9em}td.code{font-family:monospace;word-break:break-all}td small{display:block;color:#5c6b77}
table.facts td:first-child{color:#5c6b77;white-space:nowrap}
img{max-width:100%}figcaption{font-size:.85em;color:#5c6b77}figure{margin:1.5em 0}
.mark{background:#fff3cd;padding:.6em 1em}.subtitle{color:#5c6b77}
.verdict{border:2px solid #5c6b77;border-radius:3px;padding:.3em 1em;margin:1em 0}
.verdict.yes{border-color:#1b5e20}.verdict.no{border-color:#9b1c1c}
.verdict p:first-child{font-size:1.1em;font-weight:600}
.yes>p:first-child,td .yes{color:#1b5e20}.no>p:first-child,td .no{color:#9b1c1c}td .yes,td .no{font-weight:600}"""


def html(document: Document) -> str:
    """The page. Signatures and what belongs to paper only are left out."""
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
    text = "".join(_part(part, 4))
    if isinstance(part, Table) and len(part.rows) > FOLDED:
        return f"<details><summary>{len(part.rows)} rows</summary>{text}</details>"
    return text


def _page(document: Document) -> Iterator[str]:
    title = _escaped(document.heading)
    yield f'<!doctype html>\n<html lang="en"><meta charset="utf-8"><title>{title}</title><style>{STYLE}</style>'
    yield f"<body><h1>{title}</h1>"
    if document.subtitle:
        yield f'<p class="subtitle">{_escaped(document.subtitle)}</p>'
    if document.marks:
        yield f'<p class="mark">{_escaped(". ".join(mark.rstrip(".") for mark in document.marks))}.</p>'
    for part in (*document.front, *document.sections):
        yield from _part(part, 2)
    number = f"No. {document.number}, {document.date}. " if document.number else ""
    yield f"<p><small>{_escaped(number)}Made by {_escaped(document.made_by)}.</small></p></body></html>\n"


def _part(part: Part, level: int) -> Iterator[str]:
    """level: of the headings of sections."""
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
        case Figure(png, caption):
            image = f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"
            caption = _escaped(caption)
            yield f'<figure><img alt="{caption}" src="{image}"><figcaption>{caption}</figcaption></figure>'
        case Section(title, parts):
            yield f"<h{level}>{_escaped(title)}</h{level}>"
            for inner in parts:
                yield from _part(inner, level + 1)


def _colour(passed: bool | None) -> str:
    return {None: "", True: " yes", False: " no"}[passed]


def _table(table: Table, level: int) -> Iterator[str]:
    if table.title:
        yield f"<h{level}>{_escaped(table.title)}</h{level}>"
    kinds = table.kinds
    yield "<table>" if table.header else '<table class="facts">'
    if table.header:
        heads = zip(table.heads(), kinds, strict=True)
        yield f"<tr>{''.join(f'<th class={kind.value}>{_escaped(head)}</th>' for head, kind in heads)}</tr>"
    for i, row in enumerate(table.rows):
        bold = [i in table.bold_rows or k in table.bold_columns for k in range(len(row))]
        yield f"<tr>{''.join(map(_cell, row, kinds, bold))}</tr>"
    yield "</table>"


def _cell(cell: Cell, kind: Column, bold: bool) -> str:
    if isinstance(cell, Verdict):
        content = f'<span class="{_colour(cell.passed).strip()}">{_escaped(cell.word)}</span>'
    else:
        first, *notes = cell.split("\n")
        content = f"<b>{_escaped(first)}</b>" if bold else _escaped(first)
        content += _notes(notes)
    return f"<td class={kind.value}>{content}</td>"


def _notes(lines: Sequence[str]) -> str:
    return "".join(f"<small>{_escaped(line)}</small>" for line in lines)


def _escaped(text: str) -> str:
    return escape(typeset(text))
