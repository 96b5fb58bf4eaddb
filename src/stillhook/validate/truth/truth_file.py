"""The truth behind a synthetic campaign as a file: every parameter of the truth plant with its source, and what follows from them."""

from __future__ import annotations

import json
from collections.abc import Iterator

from stillhook.engine.pack import pump_leak
from stillhook.engine.truth import numbers
from stillhook.engine.truth_friction import true_friction
from stillhook.physics.line import capacitance
from stillhook.validate.truth.plan import Plan
from stillhook.validate.truth.scatter import Setting


def truth_text(plan: Plan, seed: int, defect: str, made: Setting) -> str:
    """TOML: seed, defect in words, [crane] the truth's parameters, [follows] numbers that tuning must find, [log] delays and clock; SI."""
    return "\n".join([*_head(plan, seed, defect), *_crane(made), *_follows(plan, made), *_log(made)]) + "\n"


def _head(plan: Plan, seed: int, defect: str) -> Iterator[str]:
    yield f"seed = {seed}"
    yield f"defect = {json.dumps(defect)}"
    yield f"twin = {json.dumps(plan.crane.name)}"


def _crane(made: Setting) -> Iterator[str]:
    yield "\n[crane]"
    for n in numbers(made.truth):
        source = f"kind = {json.dumps(n.source.kind.value)}, source = {json.dumps(n.source.text)}"
        yield f"{n.name} = {{ value = {n.value!r}, {source} }}  # {n.meaning}"


def _follows(plan: Plan, made: Setting) -> Iterator[str]:
    """What the truth amounts to in the twin's terms."""
    a, truth, law = plan.crane.active, made.truth, true_friction(plan.crane, made.truth)
    yield "\n[follows]"
    yield f"C_h = {truth.capacitance * capacitance(a.line.V, a.line.bulk_modulus)!r}  # m^3/Pa, each line"
    yield f"leakage_at_20_percent = {truth.leakage * (pump_leak(a.pump).C_20 + a.motor.count * a.motor.C_1)!r}  # m^3/s/Pa, winch at rest"
    yield f"J_m_eff = {truth.inertia * plan.crane.inertia.J_m_eff!r}  # kg m^2, full drum"
    yield f"friction_mean = {law.mean_truth!r}  # N m, over the loads and speeds of the tests"
    yield f"friction_mean_of_twin = {law.mean_twin!r}  # N m"
    yield f"friction_difference = {law.difference!r}  # rms of the relative difference in shape"


def _log(made: Setting) -> Iterator[str]:
    f = made.faults
    yield "\n[log]"
    yield f"delay = {made.delay!r}  # s, of the motion unit; the campaign states {made.stated_delay!r}"
    yield f"clock_drift = {made.clock.drift!r}  # part by which stamps run fast"
    yield f"clock_jitter = {made.clock.jitter!r}  # s, latest stamp"
    yield f"swapped = {str(f.swapped > 0.0).lower()}"
    yield f"gap = {f.gap!r}  # s, in the middle of the longest log"
    yield f"cell_unit = {f.cell_unit!r}"
    yield "\n[log.gain]"
    yield from (f"{name} = {c.gain!r}" for name, c in made.calibration.items())
