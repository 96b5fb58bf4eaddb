"""Colours of pictures: the palette, and one colour for each controller in all of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Okabe and Ito's palette: distinguishable by colour-blind readers and in print."""
GREY = "#777777"
BLUE, RED, GREEN, PINK, ORANGE, SKY, BLACK = COLOURS
CONTROLLERS: Mapping[str, str] = {
    "none": BLACK,
    "cap-80": ORANGE,
    "ns": SKY,
    "hs": BLUE,
    "ssc": RED,
    "strong-ssc": PINK,
    "ssc-cubic": GREEN,
    "level-1": BLUE,
    "level-2": RED,
    "position": RED,
}
"""By the name of the controller or of the alternative of a plan. Controllers of one winch have different ones."""
TUNED = "-tuned"


def colours_of(labels: Iterable[str]) -> dict[str, str]:
    """A colour for every label: that of the controller whose name it is, in any case; a tuned one has that of its
    start, unless both are there. Others take what is left in the order in which they come."""
    names = {label: label.strip().lower().replace(" ", "-") for label in labels}
    known = set(names.values())
    plain = {
        label: start if (start := name.removesuffix(TUNED)) not in known else name for label, name in names.items()
    }
    result = {label: CONTROLLERS[name] for label, name in plain.items() if name in CONTROLLERS}
    free = [colour for colour in COLOURS if colour not in result.values()] or list(COLOURS)
    others = [label for label in names if label not in result]
    return result | {label: free[i % len(free)] for i, label in enumerate(others)}
