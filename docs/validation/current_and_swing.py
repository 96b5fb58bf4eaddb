"""Current, wind and swing of a lift: the static wire against another program and closed forms, pendulums against
textbooks, the wind force against a crane maker's examples."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from blocks import Blocks, panel, picture, save
from scipy.special import jn_zeros

from stillhook import load_plan
from stillhook.base.arrays import FloatArray
from stillhook.physics.scalar import G
from stillhook.plan.definition.capacities import in_current
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.tiers.sideways import chain_at
from stillhook.response.sideways import Chain, Line, gust_factor, pendulum, raised, wire_shape
from stillhook.sea.steady_flow import T_MEAN, Current, Wind

PRINTED = {
    ("SF-30", 0.381, 149.0): {0.5: 0.38, 1.0: 5.49, 1.5: 20.35},
    ("Hydro Float 20", 0.254, 34.5): {0.5: 4.10},
}
"""Float, its radius [m] and buoyancy [kg]: speed [m/s] -> knockdown [m]."""
RHO, C_D, GRAVITY, D_WIRE, WIRE = 1027.0, 1.2, 9.8, 0.0065, 0.0772
"""Water, drag of wire and float, gravity, diameter and mass in water per metre of the wire, as in its script."""
LENGTH = 100.0  # m
FINE = 10_000
LIFT = "template-to-1500m"
PROFILE = {
    "depth": ["0 m", "50 m", "300 m", "1500 m"],
    "speed": ["1.2 m/s", "0.9 m/s", "0.5 m/s", "0.2 m/s"],
    "direction": ["270 deg", "270 deg", "300 deg", "340 deg"],
    "sense": "going-to",
    "area": "60 m^2",
}


class Shown(NamedTuple):
    plan: LiftPlan
    depths: FloatArray
    periods: FloatArray


def marched(radius: float, buoyancy: float, U: float, n: int, *, across: bool) -> float:
    """Knockdown by the other program's march from the float down, n pieces of wire; across: with the drag of the
    velocity across the wire, as ours, in place of the horizontal velocity's on the length."""
    dz, q = LENGTH / n, 0.5 * RHO * C_D * U * U
    T_x, T_z, height = q * math.pi * radius**2, buoyancy * GRAVITY, 0.0
    for _ in range(n):
        T = math.hypot(T_x, T_z)
        c, s = T_z / T, T_x / T
        height += dz * c
        F = q * D_WIRE * dz * (c * c if across else 1.0)
        T_x += F * (c if across else 1.0)
        T_z -= WIRE * dz * GRAVITY + (F * s if across else 0.0)
    return LENGTH - height


def knockdown(radius: float, buoyancy: float, U: float) -> float:
    """Ours, upside down."""
    drag = 0.5 * RHO * C_D
    load = drag * math.pi * radius**2
    line = Line(-LENGTH, -1e-6, buoyancy * GRAVITY, -WIRE * GRAVITY, 0.0, drag * D_WIRE, load, -LENGTH)
    return float(raised(line, lambda z: np.broadcast_to(np.array((U, 0.0)), (len(z), 2))) or math.nan)


def moorings() -> Iterator[tuple[str, ...]]:
    for (name, *of), by_speed in PRINTED.items():
        for U, printed in by_speed.items():
            marches = [marched(*of, U, n, across=across) for n, across in ((100, False), (FINE, False), (FINE, True))]
            yield (f"{name}, {U:g} m/s", f"{printed:.2f} m", *(f"{x:.3f} m" for x in (*marches, knockdown(*of, U))))


def small_angles() -> float:
    """Part by which the offset of a wire of 800 m differs from the integral of drag over tension."""
    W, w, f, F, U = 400e3, 300.0, 60.0, 3e3, 0.4
    shape = wire_shape(Line(-800.0, 0.0, W, w, 0.0, f, F, -800.0), lambda z: np.tile((U, 0.0), (len(z), 1)))
    assert shape is not None
    f, F = f * U**2, F * U**2
    return float(shape.offset[0]) / (f / w * 800.0 + (F - f * W / w) / w * math.log1p(w * 800.0 / W)) - 1.0


def chains() -> tuple[FloatArray, FloatArray]:
    """omega^2 l / g of two equal halves, and omega sqrt(L / g) of a heavy wire of 200 masses."""
    halves = (2.0 * math.pi / pendulum(3.0, 7.0, 3.0, 7.0).periods) ** 2 * 3.0 / G
    m = np.full(200, 15.0)
    m[-1] *= 0.5
    wire = Chain(m, np.cumsum(m[::-1])[::-1] * G, np.full(200, 0.5), np.zeros(200), 0.0)
    return halves, 2.0 * math.pi / wire.periods[:2] * math.sqrt(100.0 / G)


def allowed(load: float, area: float, C_S: float, table: float) -> float:
    """Wind speed [m/s] in which a load [t] has the force of 1.2 m^2 a tonne in the wind of the load chart."""
    fields: dict[str, Any] = {"direction": "0 deg", "sense": "going-to"}
    chart = Wind(**fields, speed=f"{table} m/s", area=f"{1.2 * load} m^2", C_S=1.0).force(10.0)[0]
    unit = Wind(**fields, speed="1 m/s", area=f"{area} m^2", C_S=C_S).force(10.0)[0]
    return math.sqrt(float(chart / unit))


def lift() -> LiftPlan:
    plan = load_plan(LIFT)
    flow = {"current": Current.model_validate(PROFILE)}
    return replace(plan, environment=plan.environment.model_copy(update=flow))


def compute() -> tuple[Blocks, Shown]:
    halves, wire = chains()
    root, zeros = math.sqrt(2.0), 0.5 * jn_zeros(0, 2)
    rows = list(moorings())
    apart = max(abs(float(row[4].split()[0]) / float(row[5].split()[0]) - 1.0) for row in rows)
    q = lambda T: Wind(speed="10 m/s", direction="0 deg", sense="going-to", area="1 m^2").at(10.0, T) ** 2
    plan = lift()
    phase = next(phase for phase in plan.phases if phase.kind == "lowering")
    depths = np.array((30.0, 100.0, 300.0, 700.0, 1100.0, 1450.0))
    periods = np.array([chain_at(plan, phase, -float(d)).periods[:2] for d in depths])
    same = "reproduced"
    claims = {
        "float on 100 m of wire in a current, pushed down": (
            ", ".join(row[1].split()[0] for row in rows) + " m",
            ", ".join(row[5].split()[0] for row in rows) + " m",
            "other drag on the wire: see table",
        ),
        "the same with our drag in the other program's march": (
            ", ".join(row[4].split()[0] for row in rows) + " m",
            f"within {100.0 * apart:.2f} %",
            same,
        ),
        "offset of 800 m of wire at small angles": ("closed form", f"within {100.0 * abs(small_angles()):.1g} %", same),
        "double pendulum of equal halves: `omega² l/g`": (
            f"{2.0 - root:.4f}, {2.0 + root:.4f}",
            ", ".join(f"{x:.4f}" for x in halves),
            same,
        ),
        "heavy wire alone: `omega √(L/g)`, half of the zeros of J₀": (
            ", ".join(f"{x:.4f}" for x in zeros),
            ", ".join(f"{x:.4f}" for x in wire),
            same,
        ),
        "wind that a crane maker allows 85 t of 50 m²; 65 t of 200 m²": (
            "11.73; 5.86 m/s",
            f"{allowed(85.0, 50.0, 1.2, 9.0):.2f}; {allowed(65.0, 200.0, 1.4, 11.1):.2f} m/s",
            same,
        ),
    }
    gusts = [(f"{T:g} s", f"{gust_factor(q, T, 3.0, T_MEAN):.2f}") for T in (6.0, 10.0, 20.0, 60.0)]
    return {"claims": claims, "moorings": rows, "offsets": list(offsets(plan)), "gusts": gusts}, Shown(
        plan, depths, periods
    )


def offsets(plan: LiftPlan) -> Iterator[tuple[str, ...]]:
    phase = next(phase for phase in plan.phases if phase.kind == "lowering")
    for depth in (50.0, 300.0, 700.0, 1450.0):
        shape = in_current(plan, phase, -depth)
        chain = chain_at(plan, phase, -depth)
        yield (
            f"{depth:.0f} m",
            f"{np.hypot(*shape.offset):.1f} m",
            f"{shape.extra:.2f} m",
            *(f"{math.degrees(np.hypot(*shape.lead(end))):.2f} deg" for end in (-1, 0)),
            ", ".join(f"{T:.1f}" for T in chain.periods[:2]) + " s",
        )


def draw(shown: Shown) -> None:
    figure = picture(
        9.0, 4.2, "Template of the example plan in a current of 1.2 m/s at the surface, 0.2 m/s at 1,500 m"
    )
    left, right = figure.subplots(1, 2)
    phase = next(phase for phase in shown.plan.phases if phase.kind == "lowering")
    for depth in (300.0, 700.0, 1450.0):
        shape = in_current(shown.plan, phase, -depth)
        left.plot(np.hypot(*shape.xy.T), shape.z, label=f"{depth:.0f} m")
    panel(left, "Wire at rest", "offset from below the tip [m]", "height [m]")
    for n, name in enumerate(("load below the tip", "wire between tip and hook")):
        right.plot(shown.depths, shown.periods[:, n], marker="o", label=name)
    Tp = shown.plan.environment.Tp
    right.axhspan(min(Tp), max(Tp), color="0.85", label="peak periods of the plan")
    right.set_yscale("log")
    panel(right, "Natural periods", "underside under the surface [m]", "period [s]")
    save(figure, "current-and-swing.png")
