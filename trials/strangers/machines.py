"""Cranes, payloads and load charts that are legal and not the library's."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from stillhook import Crane, cranes, load_crane
from stillhook.library.crane_file import changed
from stillhook.library.write import file_value, leaves, toml_value
from stillhook.spec.crane import effective_inertia, wire_capacity

Random = np.random.Generator
Ranges = Mapping[str, tuple[float, float]]
COMMON: Ranges = {
    "SWL": (0.75, 1.0),
    "hook_mass": (0.5, 1.6),
    "wire.E": (0.5, 1.0),
    "wire.fill": (0.95, 1.2),
    "wire.mass_per_length": (0.85, 1.15),
    "wire.L_0": (0.6, 1.6),
    "friction.system.Y_2": (0.6, 1.5),
    "friction.system.Y_5": (0.6, 1.5),
    "inertia.J_drum": (0.9, 1.2),
    "control.K_p": (0.3, 1.2),
    "control.tau_F": (0.6, 2.0),
    "brake.t_wait": (0.5, 3.0),
    "brake.t_open": (0.7, 1.5),
    "brake.t_close": (0.7, 1.5),
}
"""Factors on numbers that every winch has [-], least and most."""
OF_TYPE: Mapping[str, Ranges] = {
    "active-passive": {
        "hpu.P_max": (0.7, 1.3),
        "active.line.V": (0.5, 1.5),
        "active.line.bulk_modulus": (0.7, 1.0),
        "active.relief.p": (0.92, 1.0),
        "active.boost.Q_max": (0.7, 1.5),
        "active.motor.servo.omega_n": (0.8, 1.8),
        "active.pump.servo.omega_n": (0.7, 1.4),
        "passive.line.V": (0.6, 1.4),
        "passive.accumulator.gas.V_0": (0.9, 1.5),
        "passive.accumulator.R_piston": (0.5, 1.5),
    },
    "pure-active": {
        "hpu.P_max": (0.8, 1.5),
        "active.line.V": (0.5, 1.5),
        "active.line.bulk_modulus": (0.7, 1.0),
        "active.boost.Q_max": (0.7, 1.5),
        "active.motor.servo.omega_n": (0.8, 1.8),
        "active.pump.servo.omega_n": (0.7, 1.4),
    },
    "secondary": {
        "secondary.line.V": (0.7, 1.4),
        "secondary.unit.servo.omega_n": (0.8, 1.5),
        "secondary.accumulator.gas.V_0": (0.9, 1.5),
        "secondary.pump.C_leak": (0.5, 2.0),
        "secondary.drive.K": (0.6, 1.1),
    },
    "cylinder": {
        "cylinder.line.V": (0.7, 1.3),
        "cylinder.line.bulk_modulus": (0.7, 1.0),
        "cylinder.m": (0.8, 1.3),
        "cylinder.friction.F_c": (0.5, 1.5),
        "cylinder.pump.C_leak": (0.5, 2.0),
        "cylinder.pump.servo.omega_n": (0.7, 1.4),
        "cylinder.passive.accumulator.gas.V_0": (0.95, 1.3),
    },
    "electric": {
        "electric.supply.P_max": (0.8, 1.5),
        "electric.store.C": (0.7, 2.0),
        "electric.speed.K": (0.6, 1.2),
        "electric.motor.J": (0.8, 1.3),
        "electric.motor.R": (0.8, 1.3),
    },
    "open-circuit": {
        "hpu.P_max": (0.8, 1.5),
        "open.line.V": (0.7, 1.4),
        "open.line.bulk_modulus": (0.7, 1.0),
        "open.valve.servo.omega_n": (0.7, 1.4),
        "open.counterbalance.tau_pilot": (0.7, 1.4),
        "open.pump.C_leak": (0.5, 2.0),
        "open.pump.tau": (0.7, 1.4),
    },
}
"""The same of each type of winch."""
CHANGED = 0.5
"""Part of the numbers that a stranger's crane has of its own."""
STEEL = 7850.0
"""Density of steel [kg/m^3]."""


def crane(rng: Random, name: str) -> Crane:
    """A crane of one of the library's types whose numbers are others, within what such machines have."""
    base = load_crane(str(rng.choice(cranes())))
    tree: dict[str, Any] = {"name": name, "title": f"Stranger's crane {name}, a {base.plant} winch"}
    for path, (least, most) in {**COMMON, **OF_TYPE[str(base.plant)]}.items():
        number = _at(base, path)
        if number is not None and rng.random() < CHANGED:
            _put(tree, path, float(f"{number * rng.uniform(least, most):.4g}"))
    if rng.random() < CHANGED:
        zeta = float(f"{math.exp(rng.uniform(math.log(0.005), math.log(0.15))):.2g}")
        tree.setdefault("wire", {}).update(zeta=zeta, zeta_low=0.5 * zeta, zeta_high=3.0 * zeta)
    tree.setdefault("control", {})["compute_share"] = float(rng.choice([0.3, 0.6, 1.0]))
    J = effective_inertia(_with(base, tree))
    _put(tree, "inertia.J_m_eff", float(f"{J:.5g}"))
    return changed(base, _texts(base, tree))


def _at(spec: Any, path: str) -> float | None:
    """The number at a dotted path, None where the crane has none."""
    for part in path.split("."):
        spec = getattr(spec, part, None)
    return float(spec) if isinstance(spec, int | float) and spec else None


def _put(tree: dict[str, Any], path: str, value: float) -> None:
    *tables, last = path.split(".")
    for table in tables:
        tree = tree.setdefault(table, {})
    tree[last] = value


def _with(spec: Any, tree: Mapping[str, Any]) -> Any:
    """The crane with the numbers put in, unchecked."""
    own = {k: _with(getattr(spec, k), v) if isinstance(v, dict) else v for k, v in tree.items()}
    return spec.model_copy(update=own)


def _texts(spec: Any, tree: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers of a tree as texts with SI units, as a file has them."""
    kinds = {item.path: item.quantity for item in leaves(spec, {})}

    def text(branch: Mapping[str, Any], above: str) -> dict[str, Any]:
        out: dict[str, Any] = {}
        for key, value in branch.items():
            path = f"{above}{key}"
            is_number = isinstance(value, float)
            out[key] = (
                text(value, f"{path}.")
                if isinstance(value, dict)
                else file_value(value, kinds.get(path))
                if is_number
                else value
            )
        return out

    return text(tree, "")


def deepest(crane: Crane, mass: float, h_tip: float) -> float:
    """Depth that the crane's wire reaches, and that its own weight leaves to it [m]; payload mass [kg]."""
    reach = 0.85 * wire_capacity(crane.drum, crane.wire) - h_tip - 40.0
    weight = 0.9 * (crane.SWL - mass) / (0.87 * crane.wire.mass_per_length)
    return max(min(reach, weight), 60.0)


SHAPES = ("plate", "disc", "box", "suction-anchor", "spool", "frame", "assembly", "levels")


def payload(rng: Random, name: str, SWL: float) -> tuple[str, float]:
    """A payload file and its mass [kg]; SWL [kg]."""
    m = float(f"{SWL * math.exp(rng.uniform(math.log(0.06), math.log(0.6))):.3g}")
    shape = str(rng.choice(SHAPES))
    lines = [f"name = {toml_value(name)}", f'mass = "{m / 1e3:g} t"']
    if shape == "levels":
        lines += _levels(rng, m)
    elif shape == "assembly":
        part = 0.12 * m
        lines += ['shape = "assembly"', "", "[parts.anchors]", 'shape = "suction-anchor"', "count = 4"]
        lines += [f'mass = "{part / 1e3:g} t"', *_shape(rng, "suction-anchor", part), "", "[parts.frame]"]
        lines += ['shape = "frame"', 'at = "3 m"', f'mass = "{(m - 4.0 * part) / 1e3:g} t"']
        lines += _shape(rng, "frame", m - 4.0 * part)
    else:
        lines += [f'shape = "{shape}"', *_shape(rng, shape, m)]
        if rng.random() < 0.3:
            lines += [f"C_D = {rng.uniform(1.2, 4.0):.2f}"]
    if rng.random() < 0.5:
        lines += [
            "",
            "[seabed]",
            f'settlement = "{rng.uniform(0.05, 1.0):.2f} m"',
            f"zeta = {rng.uniform(0.2, 0.8):.2f}",
        ]
    return "\n".join(lines) + "\n", m


def _shape(rng: Random, shape: str, m: float) -> list[str]:
    """Dimensions of a shape of mass m [kg], as built of stiffened plate or pipe."""
    t = m / 1e3
    if shape in ("plate", "disc", "box"):
        area, open_part = t * rng.uniform(0.5, 1.6), rng.uniform(0.0, 0.25)
        side, aspect = math.sqrt(area), rng.uniform(1.0, 1.8)
        flat = [f'length = "{side * aspect:.2f} m"', f'width = "{side / aspect:.2f} m"']
        if shape == "disc":
            flat = [f'diameter = "{1.128 * side:.2f} m"']
        if shape == "box":
            flat += [f'height = "{rng.uniform(0.4, 0.8) * side:.2f} m"', f'wall = "{rng.uniform(40, 120):.0f} mm"']
            return [*flat, f"perforation = {max(open_part, 0.05):.2f}"]
        return [*flat, f'height = "{rng.uniform(0.3, 0.9):.2f} m"', f"perforation = {open_part:.2f}"]
    if shape == "suction-anchor":
        d = rng.uniform(1.2, 1.5) * t ** (1.0 / 3.0)
        h = d * rng.uniform(1.1, 2.0)
        wall = max(0.5 * m / (STEEL * math.pi * d * h), 0.008)
        sizes = [f'diameter = "{d:.2f} m"', f'height = "{h:.2f} m"', f'wall = "{1e3 * wall:.0f} mm"']
        return [*sizes, f'roof = "{rng.uniform(0.2, 0.4):.2f} m"', f"hatch = {rng.uniform(0.02, 0.08):.3f}"]
    d = rng.uniform(0.3, 0.7)
    length = t / (0.55 * d)
    sizes = [f'diameter = "{d:.2f} m"', f'length = "{max(length, 4.0):.1f} m"']
    return sizes if shape == "spool" else [*sizes, f'height = "{rng.uniform(1.5, 4.0):.2f} m"']


def _levels(rng: Random, m: float) -> list[str]:
    """A payload by numbers over the depth of its underside, as from a model test."""
    top, A, V = round(rng.uniform(2.0, 6.0), 1), m / 1e3 * rng.uniform(0.4, 1.2), m / STEEL
    A33 = 1025.0 * A**1.5 * rng.uniform(0.5, 1.0) / 1e3
    lines = [f'height = "{top:.2f} m"', f"C_D = {rng.uniform(2.0, 4.0):.2f}", 'source = "model test of a stranger"']
    for x in (0.0, 0.3, 0.7, 1.0):
        part = 1.0 - (1.0 - x) ** 2
        lines += ["", "[[levels]]", f'h = "{x * top:.3f} m"', f'V = "{x * V:.4f} m^3"']
        lines += [f'A33 = "{part * A33:.2f} t"', f'A_p = "{(x > 0.0) * A:.2f} m^2"']
    return lines


def load_chart(rng: Random, SWL: float, mass: float) -> tuple[str, float]:
    """A load chart in one of the forms that are read, and a radius at which it carries the payload in low seas [m]."""
    radius = rng.uniform(10.0, 30.0)
    heights = [1.0, 2.0, 3.0, 4.5] if rng.random() < 0.7 else [None]
    daf, leads = rng.random() < 0.6, rng.random() < 0.4
    sep = str(rng.choice([",", ";"]))
    rows = [sep.join(["radius [m]", *([] if heights == [None] else ["Hs [m]"]), "SWL [t]"])]
    rows[0] += f"{sep}DAF [1]" * daf + f"{sep}side_lead [deg]{sep}off_lead [deg]" * leads
    at_radius = max(rng.uniform(0.8, 1.0) * SWL, min(1.15 * mass, SWL))
    lost = rng.uniform(0.05, 0.1)
    for i, Hs in enumerate(heights):
        for r, part in ((0.5 * radius, 1.0), (radius, 1.0), (1.5 * radius, 0.6), (2.0 * radius, 0.4)):
            value = min(at_radius * part, SWL) * (1.0 - lost * i) / 1e3
            cells = [f"{r:.2f}", *([] if Hs is None else [f"{Hs:g}"]), f"{math.floor(10.0 * value) / 10.0:.1f}"]
            cells += [f"{1.25 + 0.08 * i:.2f}"] * daf + ["3", "6"] * leads
            rows.append(sep.join(cells))
    return "\n".join(rows) + "\n", radius
