"""Pages whose tables are computed: what stands between `<!-- name -->` and `<!-- end -->` of a page is written here.

A page's script computes numbers. What is said of them is data: the claims of the page (what is printed, how ours is
shown, when it is reproduced), its sentences, rows of its tables where they are templates, and the variants that it
tries stand in `claims/<script>.toml`; the head of a table stands in the page itself. Templates are as those of
`format`, with expressions of the numbers that the script gives: `{lead:.2f} s`. Formats beside Python's: `%`, `.1%`
or `+%` makes a part a percentage, `27 %`, `27.3 %` or `−27 %`; `;`, `|` or `/` at the end is for each of several
values, which a comma, the next cell or a slash parts; `−` prints a minus as it is set; a unit may follow, `{x:.1f
mm|}`. A colon that is no format stands in brackets.
"""

from __future__ import annotations

import math
import re
import string
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from io import BytesIO
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

HERE = Path(__file__).resolve().parent
FIGURES = HERE / "figures"
CLAIMS = HERE / "claims"
DPI = 90
COLOURS = 64
JOINTS = {";": ", ", "|": " | ", "/": " / "}
CLAIM = ("claim", "theirs", "ours", "verdict")

Rows = Iterable[Any]


class Table(NamedTuple):
    """Rows under a head that is computed."""

    head: Sequence[str]
    rows: Rows


AS_IT_STANDS = "\0"
"""A block that is left as the page has it."""
Block = str | Mapping[str, Any] | Table | Rows
"""Text; the numbers of a template (of the claims, where the block is `claims`, or claim -> theirs, ours and verdict
where the script makes these texts); or rows under the head in the page, as cells or, where the row has a template, as
its numbers."""
Blocks = Mapping[str, Block]


def table(head: Iterable[str], rows: Rows) -> str:
    """A table in Markdown."""
    names = list(head)
    return "\n".join([_line(names), _line(["---"] * len(names)), *map(_line, rows)])


def _line(cells: Iterable[object]) -> str:
    return "| " + " | ".join(map(str, cells)) + " |"


def percent(part: float, *, sign: bool = False, digits: int = 0) -> str:
    """27 %, or with a sign −27 %."""
    return minus(f"{100.0 * part:{'+' if sign else ''}.{digits}f} %")


def minus(text: str) -> str:
    """With signs as they are printed."""
    return text.replace("-", "−")


class Template(string.Formatter):
    """Texts with expressions of names."""

    def __init__(self, names: Mapping[str, Any]) -> None:
        self.names = {"math": math, "np": np, "percent": percent, **names}

    def get_field(self, field_name: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> tuple[Any, str]:
        return eval(field_name, self.names), field_name

    def format_field(self, value: Any, format_spec: str) -> str:
        if format_spec[-1:] in JOINTS:
            joint = JOINTS[format_spec[-1]]
            return joint.join(self.format_field(each, format_spec[:-1]) for each in value)
        spec, space, unit = format_spec.partition(" ")
        if spec.endswith("%"):
            return percent(value, sign=spec.startswith("+"), digits=int(spec.strip("+%.") or 0))
        text = format(value, spec.removesuffix("−"))
        return (minus(text) if spec.startswith("+") or spec.endswith("−") else text) + space + unit


@cache
def sayings(script: str) -> dict[str, Any]:
    """Claims and sentences of a page, by the name of its script."""
    file = CLAIMS / f"{script}.toml"
    return tomllib.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}


def claims(script: str, numbers: Mapping[str, Any], names: Mapping[str, Any] | None = None) -> list[tuple[str, ...]]:
    """Claim, theirs, ours, verdict of every claim of a page. holds: when it counts as reproduced; otherwise: what is
    said where not; verdict: what is said of a claim that has no such criterion; cells: an expression of theirs, ours
    and verdict."""
    template = Template({**(names or {}), **numbers})
    values, fill = template.names, template.format
    rows = []
    for claim in sayings(script)["claim"]:
        if "cells" in claim:
            rows.append((claim["claim"], *eval(claim["cells"], values)))
            continue
        if "holds" not in claim:
            verdict = fill(claim["verdict"])
        elif eval(claim["holds"], values):
            verdict = fill(claim.get("verdict", "reproduced"))
        else:
            verdict = fill(claim["otherwise"])
        rows.append((fill(claim["claim"]), fill(claim["printed"]), fill(claim["ours"]), verdict))
    return rows


def as_text(page: ModuleType, name: str, block: Block, before: str) -> str:
    """A block as it stands in a page; before: what stands there now."""
    if isinstance(block, str):
        return before.removesuffix("\n") if block == AS_IT_STANDS else block
    if name == "claims" and isinstance(block, Mapping):
        if "claim" not in sayings(script_of(page)):
            return table(CLAIM, [(claim, *cells) for claim, cells in block.items()])
        return table(CLAIM, claims(script_of(page), block, vars(page)))
    if isinstance(block, Mapping):
        return Template({**vars(page), **block}).format(sayings(script_of(page))["text"][name])
    found = block if isinstance(block, Table) else Table(before.partition("\n")[0][2:-2].split(" | "), block)
    head, row = found.head, sayings(script_of(page)).get("row", {}).get(name)
    rows = [tuple(cells) if row is None else _cells(row, cells, vars(page)) for cells in found.rows]
    assert all(len(cells) == len(head) for cells in rows), f"{script_of(page)}: rows of {name} do not fit {head}"
    return table(head, rows)


def _cells(template: str, row: Any, names: Mapping[str, Any]) -> list[str]:
    """Cells of a row, of its fields by name, or of the row as `x`."""
    fields = row if isinstance(row, Mapping) else getattr(row, "_asdict", dict)()
    return Template({**names, "x": row, **fields}).format(template).split(" | ")


def script_of(page: ModuleType) -> str:
    """Name of a page's script; that of an archived trial says its own."""
    return str(getattr(page, "SCRIPT", page.__name__))


def page_of(script: str) -> str:
    """File name of a page by that of its script."""
    return script.replace("_", "-") + ".md"


def filled(page: ModuleType, blocks: Blocks) -> str:
    """The page's text with its blocks as computed. A block without a place, or a place without a block, is a
    mistake."""
    name_of_page = getattr(page, "PAGE", page_of(script_of(page)))
    text = (HERE / name_of_page).read_text(encoding="utf-8")
    places = re.findall(r"<!-- ([\w-]+) -->\n(?:.*?\n)??<!-- end -->", text, flags=re.DOTALL)
    assert sorted(places) == sorted(blocks), (
        f"{name_of_page} has places for {places}, its script computes {list(blocks)}"
    )
    for name, block in blocks.items():
        place = re.compile(rf"(?<=<!-- {name} -->\n)(.*?)(?=<!-- end -->)", re.DOTALL)
        text = place.sub(lambda hit, n=name, b=block: as_text(page, n, b, hit[1]) + "\n", text, count=1)
    return text


def save(figure: Figure, name: str) -> None:
    """A picture in few colours, so that it is small; the same picture gives the same file."""
    FIGURES.mkdir(exist_ok=True)
    whole = BytesIO()
    figure.savefig(whole, dpi=DPI)
    Image.open(whole).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(FIGURES / name, optimize=True)


def picture(width: float, height: float, title: str = "", size: str | None = None) -> Figure:
    """An empty picture [inches], with a title above all panels."""
    figure = Figure(figsize=(width, height), layout="constrained")
    if title:
        figure.suptitle(title, fontsize=size)
    return figure


def panel(ax: Axes, title: str = "", x: str = "", y: str = "", *, legend: bool = True, small: bool = True) -> None:
    """Title, axes, grid and legend of a panel, the same on all pages."""
    if title:
        ax.set_title(title, fontsize="medium")
    if x:
        ax.set_xlabel(x)
    if y:
        ax.set_ylabel(y)
    ax.grid(alpha=0.3)
    if legend:
        ax.legend(fontsize="small" if small else None, frameon=False)
