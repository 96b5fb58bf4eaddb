"""Units as other programs spell them, and what they are in ours."""

from __future__ import annotations

from stillhook.units import KINDS

STAMPS = "UTC"  # the unit of a column of times that holds ISO 8601 stamps
PURE = {"1": 1.0, "%": 0.01}  # units of pure numbers
SCALES = {
    "psi": ("bar", 0.0689476),
    "psig": ("bar", 0.0689476),
    "in": ("mm", 25.4),
    "in/s": ("mm/s", 25.4),
    "ft": ("m", 0.3048),
    "lbs": ("N", 4.448222),
    "lbf": ("N", 4.448222),
    "mbar": ("bar", 0.001),
    "V": (None, None),
    "mA": (None, None),
}
"""What people write, the unit of ours that comes nearest, and the factor between them; None for raw sensor values."""
_SAME = {
    "rpm": "rev/min",
    "r/min": "rev/min",
    "1/min": "rev/min",
    "°": "deg",
    "°c": "degC",
    "c": "degC",
    "l/min": "L/min",
    "lpm": "L/min",
    "cc/rev": "cm^3/rev",
    "cm3/rev": "cm^3/rev",
    "sec": "s",
    "nm": "N m",
    "kg·m": "kg m",
    "m/s2": "m/s^2",
    "tonne": "t",
    "te": "t",
}
"""Spellings found in files, in lower case, and ours."""


def our_unit(unit: str, kind: str) -> str | None:
    """The unit as Stillhook spells it, where it is one of the kind; spellings such as rpm are known. None otherwise."""
    allowed_units = KINDS[kind].allowed if kind else tuple(PURE)
    tidy = " ".join(unit.strip().strip("[]()").split())
    if not kind and tidy in ("", "-"):
        return "1"
    return tidy if tidy in allowed_units else next((o for o in (_SAME.get(tidy.lower()),) if o in allowed_units), None)


def hint(unit: str, kind: str) -> str:
    """What to write for a unit that is not ours."""
    unit_name, factor = SCALES.get(unit.strip(), (None, None))
    if unit_name is not None and kind and unit_name in KINDS[kind].allowed:
        return f' Write unit = "{unit_name}", scale = {factor}.'
    return (
        f' Choose one of these and the factor to it as scale, such as unit = "{KINDS[kind].display if kind else "1"}",'
        " scale = 0.1."
    )
