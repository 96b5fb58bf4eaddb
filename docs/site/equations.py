"""Equations as MathML, which browsers set and print by themselves: no script, no fonts, no network."""

from __future__ import annotations

import re
from html import escape

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

ACCENTED = re.compile(
    r"<munderover>\s*(<mi>[^<]*</mi>)\s*(.*?)\s*(<mo stretchy=\"false\">[^<]*</mo>)\s*</munderover>", re.DOTALL
)
"""A letter with an accent and an index, as docutils sets it: with the index under the letter."""

DIGITS = re.compile(r"(\\[cdt]?frac) ?(\d)(\d)")
"""A fraction of two digits without braces, which docutils reads as one number."""


def mathml(node: nodes.math | nodes.math_block) -> str:
    """The equation of a node; one that cannot be set is a warning with its place, and is shown as it is written."""
    try:
        text = DIGITS.sub(r"\1{\2}{\3}", node.astext())
        equation = str(tex2mathml(text, as_block=isinstance(node, nodes.math_block)))
        return ACCENTED.sub(r"<msub><mover>\1\3</mover>\2</msub>", equation)
    except MathError as error:
        logging.getLogger(__name__).warning("equation %r: %s", node.astext(), error, location=node)
        return f"<code>{escape(node.astext())}</code>"


def inline(translator: HTML5Translator, node: nodes.math) -> None:
    """An equation within a sentence."""
    translator.body.append(mathml(node))
    raise nodes.SkipNode


def display(translator: HTML5Translator, node: nodes.math_block) -> None:
    """An equation on a line of its own."""
    translator.body.append(f'<div class="math">{mathml(node)}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Entry point of the extension."""
    app.add_html_math_renderer("mathml", inline_renderers=(inline, None), block_renderers=(display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
