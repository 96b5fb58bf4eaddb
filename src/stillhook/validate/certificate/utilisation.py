"""The figure of a certificate: how much of its limit each judged line uses."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from stillhook.report import kit
from stillhook.report.document import Figure
from stillhook.report.plots.colours import GREEN, GREY, RED
from stillhook.validate.criteria.results import StepNumber, Verdict
from stillhook.validate.report.document import View

if TYPE_CHECKING:
    from matplotlib import figure as matplotlib_figure

LINES, BEYOND = 7, 2.0
"""Lines at most, the most used first, and the utilisation at which bars end."""
WIDTH, ROW, FRAME = 7.5, 0.17, 0.45
"""Width, height of a line, and of the frame [inch]."""
RESOLUTION = 150
"""Of the picture [dots per inch]."""
COLOURS = {Verdict.SHOWN.value: GREEN, Verdict.REFUTED.value: RED}
"""Of verdicts; others are grey."""
CAPTION = """\
Utilisation of the limit (far end of the 95 % interval, else the value, over the limit): the {n} judged lines after \
step 0 with the highest; at 1 the limit is reached. Green: shown; red: refuted; grey: open."""


def most_used(data: View) -> list[View]:
    """Judged lines after step 0 that have a utilisation, the highest first."""
    lines = [x for x in data["lines"] if x["judged"] and x["used"] is not None and x["step"] != StepNumber.DATA]
    return sorted(lines, key=lambda x: -float(x["used"]))[:LINES]


def utilisation(data: View) -> list[Figure]:
    """The figure, as a part of a document; none where nothing can be drawn, or no line has a utilisation."""
    lines = most_used(data)
    if not lines or not kit.can_draw():
        return []
    import matplotlib  # heavy

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        drawn = kit.caption(_draw(lines), CAPTION.format(n=len(lines)))
        return [kit.printed({"utilisation": drawn}, RESOLUTION)["utilisation"]]


def _draw(lines: list[View]) -> matplotlib_figure.Figure:
    figure, ax = kit.panel((WIDTH, FRAME + ROW * len(lines)), grid="x")
    used = [min(float(x["used"]), BEYOND) for x in lines]
    colours = [COLOURS.get(x["verdict"], GREY) for x in lines]
    kit.bars(ax, range(len(lines)), used, horizontal=True, color=colours)
    kit.threshold(ax, 1.0, along="y")
    names = [textwrap.shorten(f"{x['key']}: {x['title']}", 74, placeholder=" ...") for x in lines]
    ax.set_yticks(range(len(lines)), names, fontsize="x-small")
    ax.set_ylim(len(lines) - 0.4, -0.6)
    ax.set_xlim(0.0, max(1.1, 1.05 * max(used)))
    ax.tick_params(labelsize="x-small")
    return figure
