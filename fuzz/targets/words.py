"""Texts that a person types: quantities, seas, motions, ranges, limits, moments, headings."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from fuzz.targets.registry import Form, Target, text
from stillhook import load_crane
from stillhook.analysis.axes import axes_of, quantities
from stillhook.analysis.controllers import controllers
from stillhook.analysis.drives.sizing import drives
from stillhook.cli.parser import motion_of
from stillhook.errors import StillhookError
from stillhook.formats.table.corrections import corrections_of
from stillhook.formats.weather.times import parse_zone
from stillhook.live.history.moments import moment
from stillhook.plan.definition.lift_plan import expanded
from stillhook.sea.motion.words import parse_motion
from stillhook.sea.spectra.text import parse_sea, parse_wave, sea_text
from stillhook.units import KINDS, parse, parse_ratio, quote
from stillhook.weather.limit_text import parse_limit

CRANE = load_crane("nov-250t")


def _words(*examples: str) -> Callable[[], Iterator[bytes]]:
    return lambda: (example.encode() for example in examples)


def _quantity(data: bytes) -> object:
    """Kind and text; an unknown kind is length."""
    kind, written = _two(data)
    return parse(written, kind if kind in KINDS else "length", "field")


def _sea(data: bytes) -> object:
    return parse_sea(sea_text(parse_sea(text(data))))


def _two(data: bytes) -> tuple[str, str]:
    first, _, second = text(data).partition("|")
    return first, second


def _range(data: bytes) -> object:
    """A field's validator, whose ValueError is a refusal of the file."""
    try:
        return expanded(text(data), "Hs")
    except ValueError as problem:
        raise StillhookError(str(problem)) from None


def _tip(data: bytes) -> object:
    motion, duration = _two(data)
    return motion_of(motion, duration or None)


TARGETS = (
    Target(
        "quantity",
        Form.WORDS,
        _quantity,
        seeds=_words(*(f"{name}|{x} {kind.display}" for name, kind in KINDS.items() for x in ("12.5", "-3e2"))),
        share=4,
    ),
    Target("ratio", Form.WORDS, lambda d: parse_ratio(text(d), "gear"), seeds=_words("35.4:1", "35.4")),
    Target("quote", Form.WORDS, lambda d: quote(text(d)), seeds=_words("any", 'é \\ "')),
    Target(
        "wave",
        Form.WORDS,
        lambda d: parse_wave(text(d)),
        seeds=_words("jonswap Hs=2 m Tp=9 s gamma=3.3", "pm Hs=1 m Tz=5.7 s", "torsethaugen Hs=2 m Tp=8 s"),
        share=3,
    ),
    Target(
        "sea",
        Form.WORDS,
        _sea,
        share=3,
        seeds=_words(
            "jonswap Hs=2 m Tp=9 s gamma=3.3 heading=180 deg",
            "jonswap Hs=2 m Tp=9 s heading=30 deg spread=4 + pm Hs=1 m Tp=14 s heading=90 deg",
            "torsethaugen Hs=2 m Tp=9 s heading=150 deg",
            "jonswap Hs=2 m Tz=9 s norm=printed heading=0 deg",
        ),
    ),
    Target(
        "motion",
        Form.WORDS,
        lambda d: parse_motion(text(d), "tip"),
        share=3,
        seeds=_words("sine 2 m 12 s", "still", "sine 2 m 13 s + sine 0.5 m 6 s 90 deg"),
    ),
    Target("motion-of-command", Form.WORDS, _tip, seeds=_words("sine 2 m 12 s|300 s", "still|", "missing.csv|1 h")),
    Target(
        "quantities",
        Form.WORDS,
        lambda d: quantities(text(d), "mass", "loads", percent_of=1e5),
        share=2,
        seeds=_words("50 t, 100 t", "10 t to 120 t by 10 t", "20 %, 50 %"),
    ),
    Target(
        "axes",
        Form.WORDS,
        lambda d: axes_of(CRANE, *_two(d)),
        seeds=_words("50 t, 100 t|10 m/min to 60 m/min by 10 m/min"),
    ),
    Target(
        "range",
        Form.WORDS,
        _range,
        share=2,
        seeds=_words("1 m to 6 m by 0.5 m", "1, 2, 3 m", "0.5-3 m step 0.5", "1 m; 2 m", "2,5 m"),
    ),
    Target(
        "limit",
        Form.WORDS,
        lambda d: parse_limit(text(d)),
        share=2,
        seeds=_words(
            "Hs <= 1.5 m", "Tp 5..12 s", "Hs <= 3 m for beta 150..210 deg", "wind <= 10 m/s for Hs >= 1 m and Tp 6..9 s"
        ),
    ),
    Target("zone", Form.WORDS, lambda d: parse_zone(text(d), "time_zone"), seeds=_words("UTC+3", "CET", "UTC-09:30")),
    Target(
        "column",
        Form.WORDS,
        lambda d: corrections_of(text(d).split("|")),
        seeds=_words("heave=MRU_Heave_m [m] down", "p_a=PT101|time=t"),
    ),
    Target(
        "moment",
        Form.WORDS,
        lambda d: moment(text(d), "--start", 0.0),
        seeds=_words("2026-11-28T13:00", "2026-11-28", "1764340000"),
    ),
    Target("controllers", Form.WORDS, lambda d: controllers(text(d)), seeds=_words("ns,hs,ssc", "ssc", "x.toml")),
    Target("drives", Form.WORDS, lambda d: drives(text(d)), seeds=_words("secondary,electric", "cylinder")),
)
