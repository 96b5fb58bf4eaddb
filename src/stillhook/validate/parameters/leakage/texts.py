"""What is said of the leakage: its form, and the crane file's point."""

from __future__ import annotations

from stillhook.library.leakage import point_text
from stillhook.units import number, show
from stillhook.validate.parameters.leakage.choice import IN_WORDS, LeakChoice
from stillhook.validate.parameters.leakage.fits import RISE
from stillhook.validate.parameters.leakage.rows import SLIP_PRESSURE, outside_of

RANGE = (
    f"the interval holds for a conductance that changes by at most {100.0 * RISE:.0f} % of itself up to"
    f" {show(SLIP_PRESSURE, 'pressure', 3)}"
)
"""For which leaks the interval is made."""


def form_says(leak: LeakChoice) -> str:
    """Reason why the crane file's form is refuted, in words."""
    log_form, file_form = IN_WORDS[leak.chosen.form], IN_WORDS[leak.file_form]
    if leak.chosen.form is leak.file_form:
        log_form, file_form = f"{log_form} in other parts", "not as stated"
    others = [form for form in leak.remaining_forms if form is not leak.chosen.form]
    apart = f" (not distinguished from {' or '.join(others)})" if others else ""
    return (
        f"the form of the leakage does not fit: it {log_form} in the log{apart}, {file_form} in the crane file;"
        f" structural error of its law, scaled to these data: {100.0 * leak.bend:.1f} %; in its form the data give"
        f" {100.0 * leak.in_file_form.value:+.1f} %, so no value in that form is offered"
    )


def file_point_says(leak: LeakChoice) -> str:
    """How far the crane file's point is from the data, in words."""
    at, span = leak.file_at, leak.span
    parts = [
        _apart(at.p, span.p, "pressure"),
        _apart(at.alpha_p, span.alpha_p, ""),
        _apart(at.n_m, span.n_m, "rotation"),
    ]
    outside = [part for part in parts if part]
    where = f"outside the data by {', '.join(outside)}" if outside else "inside the range of the data"
    return f"the crane file's point ({point_text(at)}) is {where}"


def _apart(x: float | None, ends: tuple[float, float], quantity: str) -> str:
    """Distance of a coordinate from its range, "129 bar (data 22 to 96 bar)"; "" inside."""
    far = abs(outside_of(x, ends))
    if far == 0.0:
        return ""
    if not quantity:
        return f"alpha_p {number(far, 2)} (data {number(ends[0], 2)} to {number(ends[1], 2)})"
    low, high = (show(end, quantity, 3) for end in ends)
    return f"{show(far, quantity, 3)} (data {low} to {high})"
