"""Where the hook of a test is: `depth` below the water line and `h_tip` of the crane tip above it, from which the
wire's weight follows."""

from __future__ import annotations

from dataclasses import dataclass

from stillhook.engine.pack.wire_weight import wire_carried
from stillhook.errors import StillhookError
from stillhook.formats.toml_fields import Fields
from stillhook.spec.crane import Crane
from stillhook.units import show


@dataclass(frozen=True)
class HookDepth:
    """depth: of the hook below the water line at the start of the test [m]; h_tip: height of the crane tip above the
    water line [m]; None where the file does not state it. place, error: for messages."""

    depth: float | None
    h_tip: float | None
    place: str
    error: type[StillhookError]

    def wire_out(self) -> float:
        """Wire from tip to hook where nothing else states it [m]. Errors: one of the campaign file where depth or h_tip
        is missing."""
        if self.depth is None or self.h_tip is None:
            other = "h_tip" if self.h_tip is None else "depth"
            has = "depth" if self.h_tip is None else "h_tip"
            raise self.error(
                f"{self.place}{has}: alone it does not determine the wire out. Give {other} too, or s_w, or map"
                " the signal"
                " s_w."
            )
        return self.depth + self.h_tip

    def tip_height(self, s_w: float) -> float:
        """Height of the crane tip above the water line [m]; s_w: wire from tip to hook at the start of the test [m].

        Errors: one of the campaign file where depth, h_tip and s_w are one too many, or the hook is deeper than the
        wire is long.
        """
        if self.depth is None:
            assert self.h_tip is not None
            return self.h_tip
        out = show(s_w, "length")
        if self.h_tip is not None:
            raise self.error(
                f"{self.place}depth and h_tip: both given where the wire out ({out}) is known as well. Leave one of"
                " them out."
            )
        if self.depth > s_w:
            raise self.error(
                f"{self.place}depth {show(self.depth, 'length')}: more than the wire out, {out}. Check depth and s_w."
            )
        return s_w - self.depth


def hook_depth(test: Fields) -> HookDepth | None:
    """The fields depth and h_tip of a test; None where it has neither. Errors: that of the file for a negative one."""
    if "depth" not in test and "h_tip" not in test:
        return None
    depth, h_tip = test.quantity("depth", "length"), test.quantity("h_tip", "length")
    if depth is not None and depth < 0.0:
        raise test.wrong(
            "depth", "give how far the hook is below the water line, 0 m or more; for a hook in air give h_tip instead."
        )
    if h_tip is not None and h_tip < 0.0:
        raise test.wrong("h_tip", "give how high the crane tip is above the water line, 0 m or more.")
    return HookDepth(depth, h_tip, test.place, test.error)


def wire_text(crane: Crane, s_w: float, h_tip: float) -> str:
    """The wire's part of a load, in words."""
    out = max(s_w, 0.0)
    wet = max(out - h_tip, 0.0)
    mass = show(wire_carried(crane, s_w, h_tip), "mass", 3)
    return (
        f"{mass} of wire ({show(out - wet, 'length', 4)} in air, {show(wet, 'length', 4)} in water less its buoyancy)"
    )
