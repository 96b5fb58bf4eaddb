"""Words on a complete campaign: friction unlike any published winch's, a motor loss that is itself uncertain, what was
found in the logs."""

from __future__ import annotations

from collections import Counter

import numpy as np

from stillhook.identify.system_friction.campaign.file import Campaign
from stillhook.identify.system_friction.campaign.measure import Measured
from stillhook.identify.system_friction.diagnosis import Statement
from stillhook.identify.system_friction.fitting.fit import FrictionFit
from stillhook.identify.system_friction.fitting.model import Y, system_friction
from stillhook.identify.system_friction.fitting.points import Points
from stillhook.identify.system_friction.fitting.uncertainty import shift_by_motor
from stillhook.library import frictions
from stillhook.library import system_friction as published
from stillhook.logs.checks.physical_range import SET_VALUES
from stillhook.units import parse, show

UNLIKE = 2.5
"""Factor beyond the published winches' system friction from which a result is called unusual: they differ by two among
themselves."""
UNLIKE_SPEED = parse("500 rev/min", "rotation")  # where break-away friction has faded and viscous friction is small


def unlike(points: Points, y: Y) -> tuple[Statement, ...]:
    """A word where the friction is far from that of every winch in the library, as a wrong unit, scale or motor model
    makes it."""
    fitted = points.fitted()
    T_d, omega = np.array([float(fitted.T_d.max())]), np.array([UNLIKE_SPEED])
    estimate = float(system_friction(omega, T_d, y)[0])
    others = [float(system_friction(omega, T_d, Y.of(published(name)))[0]) for name in frictions()]
    if min(others) / UNLIKE <= estimate <= max(others) * UNLIKE:
        return ()
    text = (
        f"System friction of {show(estimate, 'torque', 3)} a motor at 500 rev/min and"
        f" {show(float(T_d[0]), 'drum_torque', 3)}: published winches have {show(min(others), 'torque', 3)} to"
        f" {show(max(others), 'torque', 3)} there. Check units and scales, number of motors and motor loss."
    )
    return (Statement("unusual", False, text),)


MOTOR_SHARE = 0.5
"""Shift by the motor's loss over a parameter's own standard error from which it is worth reporting."""


def motor_statement(campaign: Campaign, points: Points, fit: FrictionFit) -> tuple[Statement, ...]:
    """How far the motor's own uncertainty moves what was found; silent where nothing says how well its loss is
    known."""
    evidence = campaign.motor_evidence
    if evidence is None:
        return ()
    shift = shift_by_motor(points, fit, evidence.names, evidence.matrix)
    moved = [(n, float(s)) for n, s in zip(fit.names, shift, strict=True) if s > MOTOR_SHARE * fit.sd(n)]
    if not moved:
        return ()
    texts = ", ".join(f"{n} by {s / fit.sd(n):.2g} of its own standard errors" for n, s in moved)
    text = (
        f"The motor loss is itself uncertain; that moves {texts}. It is not in the intervals, which hold for this motor"
        " loss."
    )
    return (Statement("motor loss", False, text),)


def log_statements(measured: tuple[Measured, ...]) -> tuple[Statement, ...]:
    """What was noted about single tests while they were measured, and what was found in their logs."""
    out = [Statement(n.code, n.severe, f'test "{m.test.name}": {n.text}.') for m in measured for n in m.notes]
    for m in measured:
        findings = [f for f in m.log.findings if f.kind != "constant" or f.signal not in SET_VALUES]
        if findings:
            kinds = Counter(f.kind for f in findings)
            counts = f" ({', '.join(f'{n} {kind}' for kind, n in kinds.items())})" if len(findings) > 1 else ""
            more = "; the report lists the others" if len(findings) > 1 else ""
            out.append(
                Statement(
                    "log", False, f'test "{m.test.name}": found in {m.log.source}{counts}: {findings[0].text}{more}.'
                )
            )
    return tuple(out)
