"""Volumetric losses of a motor (C_1, C_2) and of a pump (table over displacement and speed), with the share that goes
to the housing and the part that is the compression of the oil.

Moslatt 2020 section 2.5.2.4: leakage is laminar and counts the external, the internal and the compression loss as one
conductance (paper F: "the terms involved are the external, internal, and compression losses").
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import IdentifyError
from stillhook.identify.component.leak_table import LeakData, Unit
from stillhook.identify.component.result import DEFAULT, Change, Component, ComponentSettings, Parameter
from stillhook.identify.motor.map import levels
from stillhook.physics.hydraulics.lines import INTERNAL_SHARE
from stillhook.physics.hydraulics.pump import LEAK_KNOTS
from stillhook.report.formatting import percent_fixed
from stillhook.report.kit import axis, display, legend, panels, with_unit
from stillhook.report.plots.colours import COLOURS
from stillhook.statistics.estimate import NORMAL_95, Estimate
from stillhook.statistics.left_out import Labels, Linear, linear_fit, rms, rms_held_out, stretches
from stillhook.units import in_display, show

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_SPEEDS = 6
"""Speeds of a pump's table; with more, or scattered ones, the leak is a straight line over speed."""
BAD_FIT = 0.25
"""Root mean square of the residuals over the mean leak beyond which a law is not that of this unit."""
UNSEEN = 0.03
"""Deviation of a pump's conductance that no residual shows [-]: each of its settings is measured once, one after the
other, and mineral oil of 40 degC leaks by some 4 % more per kelvin (viscosity of HLP 46)."""

OF_MOTOR = (
    ("C_1", "total leak of one motor at standstill", "leakage"),
    ("C_2", "rise of that leak with shaft speed", "leakage_per_speed"),
)


def motor_leakage(data: LeakData, settings: ComponentSettings = DEFAULT) -> Component:
    r"""C_1 and C_2 of a motor: :math:`Q = (C_1 + C_2 n)\,\Delta p` (Moslatt 2020 eqs 2.17 and 2.18).

    Errors: IdentifyError where the table has one speed only.
    """
    _only(data, Unit.MOTOR)
    if levels(data.omega).max() == 0:
        raise IdentifyError(
            f"{data.source}: one speed only ({show(float(data.omega[0]), 'rotation')}), from which C_1 and C_2 cannot"
            " be distinguished. Give a second speed."
        )
    X = data.head[:, None] * np.column_stack([np.ones(len(data)), data.omega])
    fit = linear_fit(X, data.leak, groupings(data))
    parameters = [Parameter(*words, e, _sign(e)) for words, e in zip(OF_MOTOR, fit.estimates(), strict=True)]
    negative = [p.name for p in parameters if p.estimate.value < 0.0]
    notes = [f"{' and '.join(negative)} below zero: eq. 2.18 is not the law of this unit in this range"] * bool(
        negative
    )
    changes: dict[str, Change] = {f"{settings.circuit}.motor.{p.name}": (p.estimate.value, p.kind) for p in parameters}
    return _component(data, settings, X, fit, parameters, notes, changes, usable=not negative)


def pump_leakage(data: LeakData, settings: ComponentSettings = DEFAULT) -> Component:
    """Leak conductance of a pump at a fifth to all of its displacement and the measured speeds, linear between them
    (Moslatt 2020 tables 2.5 and 2.6); below a fifth the value there is held."""
    _only(data, Unit.PUMP)
    label, knots = levels(data.omega), np.array(LEAK_KNOTS)
    nodes = np.array([data.omega[label == i].mean() for i in range(int(label.max()) + 1)])
    if len(nodes) > MOST_SPEEDS:
        nodes = np.array([data.omega.min(), data.omega.max()])
    B, S = _hats(np.maximum(data.D / data.D_max, knots[0]), knots), _hats(data.omega, nodes)
    X = data.head[:, None] * (B[:, :, None] * S[:, None, :]).reshape(len(data), -1)
    measured = np.linalg.norm(X, axis=0) > 1e-9 * np.linalg.norm(X)
    X = X[:, measured]
    fit = linear_fit(X, data.leak, groupings(data))
    parameters, notes, table = [], list[str](), np.full((len(knots), len(nodes)), np.nan)
    table.ravel()[measured] = fit.theta
    for (part, omega), e in zip(np.argwhere(measured.reshape(table.shape)), fit.estimates(), strict=True):
        per_cent, n = f"{100 * knots[part]:.0f}", nodes[omega]
        words = f"leak at {per_cent} % of {show(data.D_max, 'displacement', 4)}, {show(n, 'rotation', 4)}"
        both = Estimate.around(e.value, math.hypot(e.half, NORMAL_95 * UNSEEN * e.value), e.n)
        parameters.append(Parameter(f"C_{per_cent}@{in_display(n, 'rotation'):.0f}", words, "leakage", both, _sign(e)))
    for column, n in zip(table.T, nodes, strict=True):
        known = np.isfinite(column)
        if not known.all():
            missing = ", ".join(f"{100 * x:.0f} %" for x in knots[~known])
            notes.append(
                f"not measured at {missing} of the displacement, {show(n, 'rotation', 4)}: taken from the nearest"
                " measured settings"
            )
            column[:] = np.interp(knots, knots[known], column[known])
    if negative := bool((table < 0.0).any()):
        notes.append("a conductance below zero: the flows are of the order of their errors there")
    if len(nodes) == 1:
        notes.append("one speed: the leak is held at every speed of the pump")
    path = f"{settings.circuit}.pump"
    changes: dict[str, Change] = {
        f"{path}.leak": (f"identified from {data.source}", None),
        f"{path}.table.D_ref": (data.D_max, "displacement"),
        f"{path}.table.omega": (tuple(nodes.tolist()), "rotation"),
    }
    rows = zip(knots, table, strict=True)
    changes |= {f"{path}.table.C_{100 * part:.0f}": (tuple(row.tolist()), "leakage") for part, row in rows}
    return _component(data, settings, X, fit, parameters, notes, changes, usable=not negative)


def _only(data: LeakData, unit: Unit) -> None:
    if data.unit is not unit:
        raise IdentifyError(f"{data.source}: was read as the table of a {data.unit}. Read it as that of a {unit}.")


def _sign(e: Estimate) -> str:
    if math.isnan(e.half):
        return "no interval: nothing is left over"
    return "" if e.low > 0.0 else "not above zero for certain"


def _hats(x: FloatArray, nodes: FloatArray) -> FloatArray:
    """Weights (n, nodes) of linear interpolation, held at the ends."""
    return np.column_stack([np.interp(x, nodes, row) for row in np.eye(len(nodes))])


def groupings(data: LeakData) -> dict[str, Labels]:
    """What may deviate alike: a level of each setting, and what was measured one after the other."""
    return {name: levels(x) for name, (x, _) in data.settings.items()} | {"order": stretches(len(data))}


def _compression(data: LeakData, settings: ComponentSettings) -> tuple[list[Parameter], list[str]]:
    r"""The compression loss of a unit, by its bulk modulus where that is stated, else from how a motor's leak changes
    with displacement.

    .. math:: Q_c = \frac{\omega}{2\pi}\,\frac{\Delta p}{\beta}\,\big(V_{dead} + \pi (D_{max} \pm D)\big)

    What is compressed each turn: of a pump the full cylinders (+), of a motor those at the end of the stroke that goes
    out (-), each with what stays in it. Source: Merritt 1967 chapter 4; Ivantysynova 2003, chapter 3.
    """
    pump = data.unit is Unit.PUMP
    V = (settings.V_dead or 0.0) + math.pi * (data.D_max + (data.D if pump else -data.D))
    x = data.head * data.omega / (2.0 * math.pi) * V
    if settings.bulk_modulus is not None:
        share = float(np.sum(x) / settings.bulk_modulus / np.sum(data.leak))
        words = "part of the leak that is compression, by the stated bulk modulus"
        status = "calculated, not fitted" + (": above the leak itself, check V_dead" if share > 1.0 else "")
        return [Parameter("compression_share", words, "", Estimate(share), status)], []
    if pump or levels(data.D).max() < 2:
        why = "a pump's table over displacement and speed holds it" if pump else "fewer than three displacements"
        return [], [f"compression not determined ({why}): state component.bulk_modulus and V_dead to have its part"]
    X = np.column_stack([data.head, data.head * data.omega, x])
    e, words = linear_fit(X, data.leak, groupings(data)).estimate(2), "inverse bulk modulus, if a leak alone does not"
    words += " change with displacement"
    if not e.low > 0.0:
        status = "not determined: the leak does not change with displacement as compression does"
        return [Parameter("beta_inverse", words, "gain_per_pressure", e, status)], []
    beta, low, high = (show(1.0 / x, "pressure", 3) for x in (e.value, e.high, e.low))
    return [Parameter("beta_inverse", words, "gain_per_pressure", e)], [f"bulk modulus {beta} ({low} to {high})"]


def _component(
    data: LeakData,
    settings: ComponentSettings,
    X: FloatArray,
    fit: Linear,
    parameters: list[Parameter],
    notes: list[str],
    changes: dict[str, Change],
    *,
    usable: bool,
) -> Component:
    compressed, more = _compression(data, settings)
    notes += more
    mean = float(np.mean(data.leak))
    left, apart = rms(fit.residual) / mean, rms_held_out(X, data.leak, groupings(data), mean)
    if not apart:
        notes.append("nothing can be left out: as many settings as numbers, which are those of the table")
    if left > BAD_FIT:
        notes.append(f"the law misses the table by {percent_fixed(left, 0)} of the mean leak: check columns and units")
    ends = (f"{show(float(x.min()), kind, 4)} to {show(float(x.max()), kind, 4)}" for x, kind in data.settings.values())
    notes.append(f"measured at {', '.join(ends)}")
    if share := _internal(data):
        changes[f"{settings.circuit}.internal_share"] = (min(max(share[0].estimate.value, 0.0), 1.0), None)
    else:
        notes.append("no case-drain flow: internal and external leak cannot be distinguished")
    return Component(
        component=f"{data.unit}-leakage",
        source=data.source,
        rows=len(data),
        parameters=(*parameters, *compressed, *share),
        held_out=apart,
        notes=(*data.findings, *notes),
        twin=(
            "the twin takes the total: leak and compression as one laminar conductance (Moslatt 2020 section 2.5.2.4)",
            f"{percent_fixed(INTERNAL_SHARE, 0)} of it goes from port to port where no case drain was measured;"
            " compression is in that part, though none of its oil goes to the housing",
        ),
        changes=changes,
        figures=lambda: {f"{data.unit}-leakage": _figure(data, X @ fit.theta)},
        settings=settings,
        usable=usable and left <= BAD_FIT,
    )


def _internal(data: LeakData) -> list[Parameter]:
    """The part that goes from port to port, where the case drain was measured."""
    if data.case is None or not (has := np.isfinite(data.case)).any():
        return []
    Q = (data.leak * data.head if data.dp is None else data.leak)[has]
    groups = {name: of[has] for name, of in groupings(data).items()}
    e = linear_fit(Q[:, None], data.case[has], groups).estimate(0)
    internal = Estimate.around(1.0 - e.value, e.half, e.n)
    status = "" if 0.0 <= internal.value <= 1.0 else "outside 0 to 1: check the case-drain flow"
    return [Parameter("internal_share", "part of the leak that goes from port to port", "", internal, status)]


def _figure(data: LeakData, fitted: FloatArray) -> Figure:
    """Conductance over speed by displacement (Moslatt 2020 figure 2.20), and fitted over measured leak."""
    figure, axes = panels(1, 2, (11.0, 4.6), f"{data.source}: leakage of a {data.unit}")
    left, right = axes[0]
    n, C, F = display(data.omega, "rotation"), *(display(x / data.head, "leakage") for x in (data.leak, fitted))
    label = levels(data.D)
    for i, colour in zip(range(int(label.max()) + 1), COLOURS, strict=False):
        of = np.flatnonzero(label == i)[np.argsort(data.omega[label == i])]
        left.plot(n[of], C[of], "o", color=colour, ms=4.0, label=show(float(data.D[of].mean()), "displacement", 3))
        left.plot(n[of], F[of], "-", color=colour, lw=1.0)
    axis(left, with_unit("speed", "rotation"), with_unit("leak conductance", "leakage"), zero="y")
    legend(left)
    kind = "leakage" if data.dp is None else "flow"
    measured, law = display(data.leak, kind), display(fitted, kind)
    top = float(max(measured.max(), law.max()))
    right.plot(measured, law, "o", color=COLOURS[0], ms=4.0)
    right.plot([0.0, top], [0.0, top], "-", color="#999999", lw=1.0)
    axis(right, with_unit("measured leak", kind), with_unit("fitted leak", kind))
    return figure
