"""What each layer of wire means for the winch."""

from __future__ import annotations

from typing import Any

from stillhook.crane import Crane
from stillhook.engine.pack import drum_record, inertia_record
from stillhook.physics.drum import K_wire, layer_diameter, shaft_inertia, wire_to_layer


def layer_row(crane: Crane, layer: int) -> dict[str, Any]:
    """Layer number, diameter of its wire's centre [m], K_wire, wire on it [m], wire on the drum with it full [m], wire paid out then [m],
    inertia at the motor shaft then [kg m^2]."""
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
