"""What each layer of wire means for the winch."""

from __future__ import annotations

from typing import Any

from stillhook.engine.pack.winch import drum_record, inertia_record
from stillhook.physics.load_path.drum import (
    K_wire,
    layer_diameter,
    layers_filled,
    shaft_inertia,
    wire_inertia,
    wire_to_layer,
)
from stillhook.spec.crane import Crane


def layer_row(crane: Crane, layer: int) -> dict[str, Any]:
    """Layer number, diameter of its wire's centre [m], K_wire, wire on it [m], wire on the drum with it full [m], wire
    paid out then [m], inertia at the motor shaft then [kg m^2]."""
    drum, n = drum_record(crane), float(layer)
    d, left = layer_diameter(n, drum), wire_to_layer(n, drum)
    return {
        "layer": layer,
        "d_wire_centre": d,
        "K_wire": K_wire(d, drum),
        "wire_length": left - wire_to_layer(n - 1.0, drum),
        "wire_left": left,
        "wire_out": drum.L_full - left,
        "J_m": shaft_inertia(left, n, drum, inertia_record(crane)),
    }


def inertia_parts(crane: Crane, s_w: float) -> dict[str, float]:
    """Inertia at the motor shaft by where it sits, with s_w paid out [m]: motors, gears, drum, wire left, all [kg m^2].

    Source: the split of Moslatt 2020 figure 2.19, whose bars are not printed as numbers.
    """
    drum, part, left = drum_record(crane), inertia_record(crane), drum_record(crane).L_full - s_w
    wire = wire_inertia(left, layers_filled(left, drum), drum) * part.i_i2
    shares = {"J_motor": part.J_motor, "J_gear": part.J_gear, "J_drum": part.J_drum * part.i_i2, "J_wire": wire}
    return {"s_w": s_w, **shares, "J_m": sum(shares.values())}
