"""Pages whose tables are computed: what stands between `<!-- name -->` and `<!-- end -->` is written by the page's
script."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

HERE = Path(__file__).resolve().parent
FIGURES = HERE / "figures"
DPI = 90
COLOURS = 64


def table(head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table in Markdown."""
    names = list(head)
    lines = [names, ["---"] * len(names), *([str(cell) for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def claims_table(found: Mapping[str, tuple[str, str, str]]) -> str:
    """The claims of a page: claim -> theirs, ours, verdict. The front page repeats them."""
    return table(("claim", "theirs", "ours", "verdict"), [(name, *what) for name, what in found.items()])


def percent(part: float, *, sign: bool = False) -> str:
    """27 %, or with a sign −27 %."""
    return f"{100.0 * part:+.0f} %".replace("-", "−") if sign else f"{100.0 * part:.0f} %"


def verdict(holds: bool, otherwise: str) -> str:
    return "reproduced" if holds else otherwise


def filled(page: str, blocks: Mapping[str, str]) -> str:
    """The page's text with its blocks as computed. A block without a place, or a place without a block, is a
    mistake."""
    text = (HERE / page).read_text(encoding="utf-8")
    places = re.findall(r"<!-- ([\w-]+) -->\n(?:.*?\n)??<!-- end -->", text, flags=re.DOTALL)
    assert sorted(places) == sorted(blocks), f"{page} has places for {places}, its script computes {list(blocks)}"
    for name, block in blocks.items():
        place = re.compile(rf"(?<=<!-- {name} -->\n).*?(?=<!-- end -->)", re.DOTALL)
        text = place.sub(lambda _, block=block: block + "\n", text, count=1)
    return text


def save(figure: Figure, name: str) -> None:
    """A picture in few colours, so that it is small; the same picture gives the same file."""
    FIGURES.mkdir(exist_ok=True)
    whole = BytesIO()
    figure.savefig(whole, dpi=DPI)
    Image.open(whole).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(FIGURES / name, optimize=True)
