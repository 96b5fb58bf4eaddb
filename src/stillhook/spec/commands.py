"""Commands to the active circuit as a record, such as a log has them: what the pumps and motors were told, cycle by
cycle."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import FloatArray
from stillhook.base.encode import decode_array, encode_array
from stillhook.errors import ScenarioError

EDGE = 1e-9  # s: how far a time may lie outside the record by rounding alone


@dataclass(frozen=True, init=False, eq=False)
class Commands:
    """Pump and motor commands at given times, each held until the next one, as a PLC's outputs are.

    Parameters: times [s], strictly increasing (the first one becomes t = 0); u_p pump commands in [-1, 1], hoisting
    positive; u_m motor displacement commands in [0, 1]; source, where they are from. A scenario with commands drives
    the winch by them in place of its PLC.
    Errors: ScenarioError, one line.
    """

    times: FloatArray = field(repr=False)
    u_p: FloatArray = field(repr=False)
    u_m: FloatArray = field(repr=False)
    source: str

    def __init__(self, times: ArrayLike, u_p: ArrayLike, u_m: ArrayLike, *, source: str = "") -> None:
        place = source or "Commands"
        t, p, m = (_column(x, name, place) for x, name in ((times, "times"), (u_p, "u_p"), (u_m, "u_m")))
        if not len(t) == len(p) == len(m) or not len(t):
            raise ScenarioError(
                f"{place}: {len(t)} times, {len(p)} u_p and {len(m)} u_m. Give one of each for every time."
            )
        if (np.diff(t) <= 0.0).any():
            raise ScenarioError(f"{place}: times do not increase. Sort them and remove doubles.")
        for name, x, lo in (("u_p", p, -1.0), ("u_m", m, 0.0)):
            bad = ~((x >= lo) & (x <= 1.0))
            if bad.any():
                i = int(np.argmax(bad))
                raise ScenarioError(
                    f"{place}: {name} = {x[i]:g} at {t[i]:g} s: allowed is {lo:g} to 1. Scale it, or hold it in its"
                    " range."
                )
        t -= t[0]
        for name, x in (("times", t), ("u_p", p), ("u_m", m)):
            x.flags.writeable = False
            object.__setattr__(self, name, x)
        object.__setattr__(self, "source", source)

    def at(self, t: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """u_p and u_m in force at the times t [s]; after the last time the last ones hold."""
        i = np.clip(np.searchsorted(self.times, np.asarray(t) + EDGE, side="right") - 1, 0, len(self.times) - 1)
        return self.u_p[i], self.u_m[i]

    @property
    def duration(self) -> float:
        """Last time of the record [s]."""
        return float(self.times[-1])

    def __eq__(self, other: object) -> bool:
        return self._content == other._content if isinstance(other, Commands) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._content)

    @cached_property
    def _content(self) -> tuple[bytes, bytes, bytes, str]:
        return self.times.tobytes(), self.u_p.tobytes(), self.u_m.tobytes(), self.source

    def to_dict(self) -> dict[str, Any]:
        """Plain data that `from_dict` turns into the same record, exact to the bit."""
        return {"source": self.source, **{n: encode_array(getattr(self, n)) for n in ("times", "u_p", "u_m")}}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """The record that `to_dict` stored. Errors: KeyError, TypeError, ValueError where it is none."""
        return cls(*(decode_array(data[n]) for n in ("times", "u_p", "u_m")), source=str(data["source"]))

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        """A model field of this type takes finished commands only."""
        from pydantic_core import core_schema  # here, as in `stillhook.sea.motion.motion`

        as_dict = core_schema.plain_serializer_function_ser_schema(lambda commands: commands.to_dict())
        return core_schema.is_instance_schema(cls, serialization=as_dict)


def _column(values: ArrayLike, name: str, place: str) -> FloatArray:
    try:
        column = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ScenarioError(f"{place}: {name} are not numbers. Give one number a sample.") from None
    if column.ndim != 1 or not np.isfinite(column).all():
        raise ScenarioError(f"{place}: {name} are not one finite number a sample. Leave the gaps out, or fill them.")
    return column
