"""Axes of a map: loads, peak speeds, layers and wave periods, read from texts; one scenario for each of its
cells."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from stillhook.analysis.steady.steady_state import wire_out_on
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import ScenarioError, UnitError
from stillhook.physics.load_path.drum import wire_usable
from stillhook.spec.crane import Crane
from stillhook.units import parse, quote, show

Texts = str | Sequence[str]

LOADS = "20 % to 100 % by 10 %"
"""Loads of paper E's maps, in parts of the safe working load (section 4)."""
SPEEDS = "10 m/min to 120 m/min by 10 m/min"
"""Peak speeds of paper E's maps (section 4)."""
PERIOD = "12 s"
"""Wave period of a map unless another is given; assumed: figure 6 is not printed as numbers, 12 s is one of paper E's
two quay tests."""
MOST = 1000
"""Values along one axis: more than any screen shows, and a slip of the unit in a range."""

_PERCENT = re.compile(r"([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*%")
_RANGE = re.compile(r"(.+?)\s+to\s+(.+?)\s+by\s+(.+)")


class Axes(NamedTuple):
    """Axes of a map, SI: loads [kg], speeds [m/s], layers and the wire paid out on each [m], periods [s]. Where a map
    has no dimension "layer" or "period", `layers` or `periods` holds None alone."""

    loads: tuple[float, ...]
    speeds: tuple[float, ...]
    layers: tuple[int | None, ...]
    s_w: tuple[float, ...]
    periods: tuple[float | None, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Cells of one controller along load, speed, layer, period."""
        return len(self.loads), len(self.speeds), len(self.layers), len(self.periods)

    @property
    def unused(self) -> tuple[str, ...]:
        return tuple(name for name, axis in (("layer", self.layers), ("period", self.periods)) if axis == (None,))

    def cells(self) -> Iterator[tuple[float, float, float, float | None]]:
        """Load, speed, wire paid out and period of every cell, the last axis fastest."""
        return itertools.product(self.loads, self.speeds, self.s_w, self.periods)


def axes_of(
    crane: Crane,
    loads: Texts = LOADS,
    speeds: Texts = SPEEDS,
    *,
    s_w: str | None = None,
    layers: int | Sequence[int] | None = None,
    periods: Texts | None = None,
) -> Axes:
    """Axes from what a person writes; see `quantities` for the texts.

    The wire is paid out to the middle of the outermost layer, of every layer that is named, or to s_w. One layer as a
    plain number sets the wire and adds no dimension; a list of layers adds one, and so does a list of periods.
    Errors: ScenarioError, UnitError of one line.
    """
    if s_w is not None and layers is not None:
        raise ScenarioError("s_w and layers: both define the wire paid out. Give only one of them.")
    masses = quantities(loads, "mass", "loads", percent_of=crane.SWL)
    if masses[-1] > crane.SWL * (1.0 + 1e-12):
        raise ScenarioError(
            f'loads: {show(masses[-1], "mass")} exceeds the SWL {show(crane.SWL, "mass")} of "{crane.name}" '
            f"({100.0 * masses[-1] / crane.SWL:.5g} %). Lower the load or choose another crane."
        )
    peaks = quantities(speeds, "speed", "speeds")
    if peaks[0] <= 0.0:
        raise ScenarioError(f"speeds: {show(peaks[0], 'speed')} must be above 0.")
    over_layers = layers is not None and not isinstance(layers, int)
    chosen: Sequence[int] = (
        [crane.drum.layers] if layers is None else [layers] if isinstance(layers, int) else list(layers)
    )
    if not chosen:
        raise ScenarioError("layers: empty. Name at least one, counted from the bare drum.")
    if twice := next((n for n in chosen if chosen.count(n) > 1), None):
        raise ScenarioError(f"layers: {twice} is named twice. Name each layer once.")
    wire = (_wire(crane, s_w),) if s_w is not None else tuple(wire_out_on(crane, n) for n in chosen)
    return Axes(
        loads=masses,
        speeds=peaks,
        layers=tuple(chosen) if over_layers else (None,),
        s_w=wire,
        periods=(None,) if periods is None else quantities(periods, "time", "periods"),
    )


def _wire(crane: Crane, s_w: str) -> float:
    """Wire paid out, as given [m]."""
    value, most = parse(s_w, "length", "s_w"), float(wire_usable(drum_record(crane)))
    if not 0.0 <= value <= most:
        raise ScenarioError(
            f's_w {show(value, "length")}: "{crane.name}" can pay out 0 m to {show(most, "length")}. Give a value in'
            " between."
        )
    return value


def quantities(texts: Texts, kind: str, where: str, *, percent_of: float | None = None) -> tuple[float, ...]:
    """Rising values of one kind in SI, from texts with units.

    A text is a quantity ("50 t"), several with commas between them, or an even range "10 m/min to 120 m/min by 10
    m/min", both ends included. With `percent_of` a value may be given as part of it, in per cent.
    Errors: ScenarioError, UnitError of one line that names `where`.
    """
    if isinstance(texts, str):
        items = [part.strip() for part in texts.split(",") if part.strip()]
    elif isinstance(texts, Sequence):
        items = list(texts)
    else:
        raise ScenarioError(f"{where} = {quote(texts)}: give a text with units, or a list of texts.")
    if not items:
        raise ScenarioError(f"{where}: empty. Give at least one value with its unit.")
    values = [x for item in items for x in _values(item, kind, where, percent_of)]
    for a, b in itertools.pairwise(values):
        if not a < b:
            raise ScenarioError(
                f"{where}: {show(b, kind)} comes after {show(a, kind)}. Write each value once, the smallest first."
            )
    return tuple(values)


def _values(item: object, kind: str, where: str, percent_of: float | None) -> Iterator[float]:
    """The values of one item: a quantity, or an even range."""
    span = _RANGE.fullmatch(item.strip()) if isinstance(item, str) else None
    if span is None:
        if isinstance(item, str) and " to " in item:
            raise ScenarioError(
                f'{where} = {quote(item)}: a range needs its step. Write "A to B by STEP", each with its unit.'
            )
        yield value_of(item, kind, where, percent_of)
        return
    a, b, step = (value_of(text, kind, where, percent_of) for text in span.groups())
    count = (b - a) / step if step > 0.0 and b >= a else -1.0
    if count >= MOST:
        raise ScenarioError(f"{where}: {quote(item)}: {count + 1.0:.6g} values; at most {MOST}. Choose a longer step.")
    n = round(count)
    if n < 0 or abs(a + n * step - b) > 1e-9 * max(abs(b), step):
        raise ScenarioError(
            f"{where}: {quote(item)}: the range is not a multiple of the step. Change one of the three."
        )
    yield from (a + (b - a) * i / n if n else a for i in range(n + 1))


def value_of(item: object, kind: str, where: str, percent_of: float | None) -> float:
    """A value of 0 or more in SI from a text with its unit, or in per cent of `percent_of`."""
    percent = _PERCENT.fullmatch(item.strip()) if percent_of is not None and isinstance(item, str) else None
    if percent is not None and percent_of is not None:
        try:
            value = float(percent[1]) / 100.0 * percent_of
        except ValueError:
            raise UnitError(f'{where} = {quote(item)}: not a number and %. Write "50 %".') from None
    else:
        value = parse(item, kind, where)
    if value < 0.0:
        raise ScenarioError(f"{where} = {quote(item)}: below 0. Give 0 or more.")
    return value
