"""Paper E's tests at the quay: 250 t crane, empty hook, 15 m of wire, a simulated tip. What is run, what is changed,
what is read off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import causes
import xarray
from blocks import percent

from stillhook.library import changed
from stillhook.sea.motion.motion import Motion
from stillhook.thesis.quay import CRANE, OPEN_LOOP, WARM, case, run
from stillhook.thesis.ringing import rms_above
from stillhook.units import in_display

RING = 0.5  # Hz: above the waves (up to 0.17 Hz), below the circuit's eigenfrequency in any mode (1 to 2 Hz)
OPEN_LOOP_10 = {"active": {"motor": {"variant": "open-loop-feedback", "offset": 0.1, "hysteresis": 0.06}}}
OPEN_LOOP_BLIND = {"active": {"motor": {"variant": "open-loop"}}}


class Row(NamedTuple):
    """One variant: what is changed in the crane (for one mode only where that is named), the tip's motion where it is
    another one, and the rest of the scenario."""

    label: str
    changes: Mapping[str, Any] = {}
    tip: Motion | None = None
    more: Mapping[str, Any] = {}
    only: str = ""


def hs_at(alpha: float) -> dict[str, Any]:
    return {
        "control": {"alpha_hs": alpha},
        "active": {"motor": {"alpha_min": min(alpha, CRANE.active.motor.alpha_min)}},
    }


ROWS = (
    Row("motors in open loop with feedback", OPEN_LOOP),
    Row("open loop with feedback, 10 % offset and 6 % hysteresis", OPEN_LOOP_10),
    Row("motors in open loop without feedback", OPEN_LOOP_BLIND),
    Row("NS 0.70", {"control": {"alpha_ns": 0.7}}),
    Row("NS 0.90", {"control": {"alpha_ns": 0.9}}),
    Row("HS 0.48, 60 % of NS as in paper C", hs_at(0.48), only="hs"),
    Row("friction of crane 1", {"friction": {"library": "crane-1"}}),
    Row("friction of L4593, the largest set", {"friction": {"library": "L4593"}}),
    Row("dry friction without stick-slip (tanh)", more={"friction": "regularised"}),
    Row("lines of 160 L instead of 80 L", {"active": {"line": {"V": "160 L"}}}),
    Row("inertia ×1.5", causes.heavier(CRANE, 1.5)),
    Row(
        "motors that leak three times as much",
        {"active": {"motor": {"C_1": "0.10 L/min/bar", "C_2": "2.6e-5 L/min/bar/(rev/min)"}}},
    ),
    Row("`K_2` 0", {"control": {"K_2": "0 s^2/m"}}),
    Row("`K_p` 0.32 1/m instead of 0.16", {"control": {"K_p": "0.32 1/m"}}),
    Row("`K_1` as printed, 0.68 s/m", {"control": {"K_1": "0.68 s/m"}}),
    Row("motion signal 0.1 s late", more={"sensors": {"delay": "0.1 s"}}),
)


class Found(NamedTuple):
    """What one controller does: oscillation above 0.5 Hz of speed [m/min] and A-side pressure [bar] (rms), error
    peak-to-peak [cm], highest A-side pressure [bar], largest pump and smallest motor displacement [-]."""

    run: xarray.Dataset
    v_w: float
    p_a: float
    e_c_pp: float
    p_a_max: float
    alpha_p: float
    alpha_m: float


def found(row: Row, tip: Motion, mode: str, duration: float) -> Found:
    crane = changed(CRANE, row.changes) if row.changes and row.only in ("", mode) else CRANE
    one = run(crane, case(row.tip or tip, mode, duration, row.more))
    return Found(
        run=one,
        v_w=in_display(rms_above(one, "v_w", frequency=RING, start=WARM), "speed"),
        p_a=in_display(rms_above(one, "p_a", frequency=RING, start=WARM), "pressure"),
        e_c_pp=100.0 * float(one["e_c_pp"]),
        p_a_max=in_display(float(one["p_a_max"]), "pressure"),
        alpha_p=float(one["alpha_p_max"]),
        alpha_m=float(one["alpha_m_min"]),
    )


GROUPS = {
    "motors in open loop with feedback": "motor control",
    "open loop with feedback, 10 % offset and 6 % hysteresis": "motor control",
    "motors in open loop without feedback": "motor control",
    "NS 0.70": "NS",
    "NS 0.90": "NS",
    "HS 0.70": "HS",
    "HS 0.48, 60 % of NS as in paper C": "HS",
    "friction of crane 1": "friction",
    "friction of L4593, the largest set": "friction",
}
"""Rows that exclude each other."""


def alternatives(rows: Sequence[Row], group: str = "tip") -> list[causes.Alternative]:
    """Rows as settings that may be otherwise; those with another tip exclude each other."""
    return [
        causes.varied(
            r.label,
            r.changes,
            only=(r.only,) if r.only else (),
            tip=r.tip,
            more=r.more,
            group=GROUPS.get(r.label, group if r.tip else ""),
        )
        for r in rows
    ]


def runs_of(tip: Motion, modes: Sequence[str], duration: float) -> dict[str, causes.Pair]:
    """Crane and scenario of each mode."""
    return {m: (CRANE, case(tip, m, duration)) for m in modes}


def _oscillation(one: xarray.Dataset) -> dict[str, float]:
    return {name: rms_above(one, name, frequency=RING, start=WARM) for name in ("v_w", "p_a")}


oscillations = causes.from_series(_oscillation, "0.02 s")
"""Oscillation above 0.5 Hz of speed and pressure of every run, rms [m/s, Pa]."""


HEAD = (
    "",
    "`v_w` above 0.5 Hz, rms",
    "`p_a` above 0.5 Hz, rms",
    "error p-p",
    "highest `p_a`",
    "pumps",
    "least `alpha_m`",
)


def numbers(mode: str, f: Found) -> tuple[str, ...]:
    return (
        mode.upper(),
        f"{f.v_w:.2f} m/min",
        f"{f.p_a:.1f} bar",
        f"{f.e_c_pp:.1f} cm",
        f"{f.p_a_max:.0f} bar",
        percent(f.alpha_p),
        f"{f.alpha_m:.3f}",
    )


def beside(all_: Sequence[Found]) -> tuple[str, ...]:
    """Cells of a variant, the controllers side by side: speed, pressure, error, highest pressure."""
    columns = (("v_w", 2), ("p_a", 1), ("e_c_pp", 1), ("p_a_max", 0))
    return tuple(" / ".join(f"{getattr(f, name):.{digits}f}" for f in all_) for name, digits in columns)


def less(new: float, old: float) -> str:
    """The new one against the old one: −25 %."""
    return percent(new / old - 1.0, sign=True)
