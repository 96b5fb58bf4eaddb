"""`stability`: is a crane's position loop stable, and by how much. One margin, of the complete plant on the crane's own
wire; next to it the same with paper C's wire damping and the ends of the crane's own interval, and the published loop.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from stillhook.analysis.loop_stability.governing import (
    PAPER_C,
    Governing,
    PlaceLimit,
    by_engine,
    deciding,
    governing,
    place_limits,
    stribeck_speed,
    with_wire_damping,
)
from stillhook.analysis.loop_stability.margins import Margins
from stillhook.analysis.loop_stability.places import (
    SLOW,
    payloads_of_mode,
    places_of,
    strokes_of,
    tip_speeds,
    wire_range,
)
from stillhook.analysis.loop_stability.stability import SHOWN, Stability, stability
from stillhook.control.registry import DEFAULT_MODE
from stillhook.errors import StillhookError
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode

COMPARED = (0.0, 1.0)
"""Payloads at which wire dampings are compared, over the heaviest of the mode [-]."""
COMPARED_SPEEDS = (SLOW[0], SLOW[2], SLOW[-1])


class WireDamping(NamedTuple):
    """The margin with one damping ratio of the wire, at the payloads and wires at which dampings are compared: zeta [-]
    and whose it is; limit least gain limit of the places that decide [1/m], NaN where none does; no_gain, oscillates
    number of places that no gain stabilises, and that oscillate at K_p, of `places`."""

    zeta: float
    whose: str
    limit: float
    no_gain: int
    oscillates: int
    places: int


class Verdict(NamedTuple):
    """Whether the position loop of a crane in a mode is stable with its K_p [1/m].

    found: the margin of the complete plant over all places; margins: gain, phase and delay margin and sensitivity peak
    at K_p, where the limit is least among the places that decide, None where none does; oscillates: places at which it
    oscillates at K_p; damping: the same with other dampings of the wire; published: the loop of paper E, a reference
    and no verdict, None for a winch type that has none.
    """

    crane: str
    mode: Mode
    K_p: float
    t_cycle: float
    delay: float
    found: Governing
    margins: Margins | None
    oscillates: tuple[PlaceLimit, ...]
    damping: tuple[WireDamping, ...]
    published: Stability | None

    @property
    def ok(self) -> bool:
        """Whether the complete plant dies out at every place."""
        return not self.oscillates and self.margins is not None

    def table(self) -> dict[str, Any]:
        """Name -> value in SI. Places as load [kg], s_w [m], v_tip [m/s], alpha_m [-], and the gains low and high
        between which they die out [1/m], both 0 where none does."""
        least, m = self.found.limit, self.margins
        return {
            "crane": self.crane,
            "mode": self.mode.value,
            "stable": self.ok,
            "K_p": self.K_p,
            "K_p_strong": self.found.K_p,
            "K_p_ms_plc": math.nan if least is None else least.gains.high,
            "omega_c_plc": math.nan if least is None else least.gains.omega_c,
            **{f"{name}_plc": getattr(m, name, math.nan) for name in SHOWN},
            "least_at": None if least is None else _place(least),
            "places": len(self.found.places),
            "decide": len(self.found.decide),
            "no_gain": [_place(p) for p in self.found.no_gain],
            "oscillates": [_place(p) for p in self.oscillates],
            "damping": [d._asdict() for d in self.damping],
            "t_cycle": self.t_cycle,
            "delay": self.delay,
            "published": None if self.published is None else self.published.table(),
        }


def verdict(
    crane: Crane,
    mode: Mode | None = None,
    *,
    alpha_m: float | None = None,
    v_tip: float | None = None,
    delay: float = 0.0,
    loads: Sequence[float] | None = None,
    wires: Sequence[float] | None = None,
) -> Verdict:
    """Whether a crane's position loop is stable; see `Verdict`.

    Parameters: mode, default the usual one of the winch type; alpha_m displacement [-], default where the mode's law
    puts the motors; v_tip one speed of the tip [m/s], looked at in both directions, default slow to full; delay [s] of
    the position feedback; loads payloads [kg]; wires paid out [m].
    Errors: StillhookError for a number outside its range, or where the winch comes to no place.
    """
    if v_tip is not None and not (math.isfinite(v_tip) and v_tip != 0.0):
        raise StillhookError(f"v_tip = {v_tip:g} m/s: a winch at rest sticks. Give a finite speed that is not 0.")
    if not 0.0 <= delay < 10.0:
        raise StillhookError(f"delay = {delay:g} s: allowed is 0 up to 10 s.")
    law = crane.plant.type.default_mode if mode is None else mode
    speeds = tip_speeds(crane) if v_tip is None else (abs(v_tip),)
    result = governing(crane, law, loads=loads, wires=wires, speeds=speeds, alpha_m=alpha_m, delay=delay)
    K_p = crane.control.K_p
    published = None
    if not by_engine(crane) and law is DEFAULT_MODE:
        published = stability(crane, 1.0 if alpha_m is None else alpha_m, delay=delay)
    return Verdict(
        crane=crane.name,
        mode=law,
        K_p=K_p,
        t_cycle=crane.control.t_cycle,
        delay=delay,
        found=result,
        margins=result.margins(K_p),
        oscillates=result.oscillates(K_p),
        damping=wire_dampings(crane, law, alpha_m=alpha_m, v_tip=v_tip, delay=delay, loads=loads, wires=wires),
        published=published,
    )


def wire_dampings(
    crane: Crane,
    mode: Mode,
    *,
    alpha_m: float | None = None,
    v_tip: float | None = None,
    delay: float = 0.0,
    loads: Sequence[float] | None = None,
    wires: Sequence[float] | None = None,
) -> tuple[WireDamping, ...]:
    """The margin with the crane's own damping of the wire, with both ends of its interval, and with that of paper C: at
    the empty hook and the heaviest payload on a short, a middle and a long wire."""
    wire = crane.wire
    named = ((wire.zeta, "crane"), (wire.zeta_low, "least"), (wire.zeta_high, "most"), (PAPER_C, "paper C"))
    whose = {zeta: name for zeta, name in reversed(named) if zeta is not None}
    masses = payloads_of_mode(crane, mode, shares=COMPARED) if loads is None else loads
    lengths = wire_range(crane)[::2] if wires is None else wires
    places = places_of(masses, lengths, COMPARED_SPEEDS if v_tip is None else (abs(v_tip),), strokes_of(crane))
    out = []
    for zeta, name in sorted(whose.items()):
        damped = with_wire_damping(crane, zeta)
        result = place_limits(damped, mode, places, alpha_m=alpha_m, delay=delay)
        limit = min((p.gains.high for p in deciding(result, stribeck_speed(crane))), default=math.nan)
        no_gain = sum(not p.gains.any for p in result)
        swinging = sum(not p.gains.holds(crane.control.K_p) for p in result)
        out.append(WireDamping(zeta, name, limit, no_gain, swinging, len(result)))
    return tuple(out)


def _place(p: PlaceLimit) -> dict[str, float]:
    return {**p.place._asdict(), "alpha_m": p.alpha_m, "K_p_low": p.gains.low, "K_p_high": p.gains.high}
