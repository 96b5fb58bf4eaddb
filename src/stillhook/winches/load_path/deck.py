"""A payload in air above the deck of another vessel or of a platform, or on it: `payload`, and the push of the deck."""

from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple

from stillhook.base.variable import Row
from stillhook.physics.load_path.deck import Deck, Push, deck_height, deck_push
from stillhook.physics.records import replace
from stillhook.physics.scalar import fmax, fmin, scalar
from stillhook.winches.load_path.interface import NEVER, happened
from stillhook.winches.load_path.payload import LiftStats, Momentum, depth_ahead, fold_step, momentum, on_ground

__all__ = ["Deck", "LiftStats", "Momentum", "Push", "deck_push", "depth_ahead", "fold_step", "momentum", "on_ground"]

NAME = "deck"
HIT = 0.01
"""Speed of a touch that counts as a hit [m/s]: below it is what spring and wire leave of a bounce."""
CLEAR = 0.05
"""Height over the deck from which a payload hangs free of it [m]: slings that are slack below it are no snap load."""


class Stats(NamedTuple):
    """Over one stage, from every step: t_off time at which the payload first left the deck, t_again of its first hit
    after that [s]; gap least height over the deck as it came closer again after that, 0 of a hit [m]; hits their number
    and v_again the speed of the fastest [m/s]; F largest push [N]; loss work that the
    damper of the deck took [J]."""

    t_off: float
    t_again: float
    gap: float
    hits: float
    v_again: float
    F: float
    loss: float


SUMMED, LOWEST = ("hits", "loss"), ("t_off", "t_again", "gap")
NUMBERS: Mapping[str, Row] = {
    "t_lift_off": Row("s", "time", "", "time at which the payload first left the deck"),
    "t_second_hit": Row("s", "time", "", "time at which the payload first hit the deck again after it had left it"),
    "z_clear_min": Row(
        "m", "length", "", "least height of the payload over the deck as both came closer again after it had left it"
    ),
    "second_hits": Row("1", "", "", "hits of the deck after the payload had left it"),
    "v_second_hit_max": Row("m/s", "speed", "", "highest speed of payload against deck at these hits"),
    "F_deck_max": Row("N", "force", "", "largest push of the deck on the payload"),
    "energy_deck": Row("J", "energy", "", "energy that the payload lost in its contact with the deck"),
}


class Signals(NamedTuple):
    z_deck: Annotated[float, Row("m", "length", "up positive", "height of the deck above still water")]
    F_deck: Annotated[float, Row("N", "force", "up positive", "push of the deck on the payload")]


def blank() -> Stats:
    """Statistics of nothing yet."""
    return Stats(NEVER, NEVER, NEVER, 0.0, 0.0, 0.0, 0.0)


def numbers(stats: Stats) -> dict[str, Any]:
    """The numbers of NUMBERS, NaN for what did not happen."""
    happen = (happened(x) for x in (stats.t_off, stats.t_again, stats.gap))
    values = (*happen, stats.hits, stats.v_again if stats.hits else float("nan"), stats.F, stats.loss)
    return dict(zip(NUMBERS, values, strict=True))


touched = replace(LiftStats, "t_landed", "v_landed", "v_hit", "bottom", "slack", "slack_landed")
pushed, pressed = replace(Push, "F", "left"), replace(Momentum, "A", "R")


@scalar
def pressing(p, push, h):
    """`Momentum` of a step [s] with the deck's push on the payload."""
    return pressed(p, p.A + 0.5 * h * push.slope, p.R + 0.5 * h * (push.F + push.slope * push.v))


@scalar
def on_deck(grounded, z, deck, tau):
    """1 once the payload stands on the deck, until it hangs free of it; z height of its underside [m]."""
    gap = z - deck_height(deck, tau)
    return 1.0 if gap < 0.0 or (grounded > 0.0 and gap < CLEAR) else 0.0


@scalar
def fold_deck(a, before, ls, t, h, z_0, v_0, a_0, z, deck, tau, push, grounded):
    """Statistics of deck and lift (before: without this step, ls: with it), and the push as it was, with one more step:
    t [s] at its end, tau into the cycle at its beginning, z_0, v_0, a_0 of the payload at its beginning and z at its
    end. A hit has the speed with which the payload flew towards the deck."""
    g_0, g_1 = z_0 - deck_height(deck, tau), z - deck_height(deck, tau + h)
    hits, leaves = g_0 >= 0.0 and g_1 < 0.0, g_0 < 0.0 and g_1 >= 0.0
    part = g_0 / (g_0 - g_1) if hits or leaves else 1.0
    t_at = t - (1.0 - part) * h
    v_touch = deck.v + (tau + part * h) * deck.a - (v_0 + part * h * a_0)
    first = hits and grounded == 0.0 and ls.t_landed >= NEVER
    again = hits and push.left > 0.0 and v_touch >= HIT
    F = push.F - push.slope * ((z - z_0) / h - push.v)
    c_0, c_1 = fmax(-g_0, 0.0), fmax(-g_1, 0.0)
    slack = (ls.slack - before.slack) * on_deck(grounded, z, deck, tau + h)
    stats = Stats(
        t_off=fmin(a.t_off, t_at) if leaves else a.t_off,
        t_again=fmin(a.t_again, t_at) if again else a.t_again,
        gap=fmin(a.gap, fmax(g_1, 0.0)) if push.left > 0.0 and g_1 < g_0 else a.gap,
        hits=a.hits + (1.0 if again else 0.0),
        v_again=fmax(a.v_again, v_touch) if again else a.v_again,
        F=fmax(a.F, F),
        loss=a.loss + F * (g_0 - g_1) - 0.5 * deck.k * (c_1 * c_1 - c_0 * c_0),
    )
    lift = touched(
        ls,
        t_at if first else ls.t_landed,
        v_touch if first else ls.v_landed,
        fmax(ls.v_hit, v_touch) if hits else ls.v_hit,
        fmax(ls.bottom, F),
        ls.slack - slack,
        ls.slack_landed + slack,
    )
    return stats, lift, pushed(push, F, 1.0 if leaves else push.left)
