"""The reference crane of a synthetic campaign as a file: every parameter of the reference plant with its source, and
derived values."""

from __future__ import annotations

import json
from collections.abc import Iterator

from stillhook.physics.hydraulics.line import capacitance
from stillhook.validate.synthetic.reference.circuits import M_N2, active_leak, gas_bank, working
from stillhook.validate.synthetic.reference.crane import numbers
from stillhook.validate.synthetic.reference.friction import reference_friction
from stillhook.validate.synthetic.scatter import Setting
from stillhook.validate.synthetic.schedule import Plan
from stillhook.winches.reference.leak import gap_motor, gap_pump


def reference_text(plan: Plan, seed: int, defect: str, made: Setting) -> str:
    """TOML: seed, defect in words, [crane] the parameters of the reference crane, [follows] numbers that tuning must
    find, [log] delays and clock; SI."""
    return "\n".join([*_head(plan, seed, defect), *_crane(made), *_follows(plan, made), *_log(made)]) + "\n"


def _head(plan: Plan, seed: int, defect: str) -> Iterator[str]:
    yield f"seed = {seed}"
    yield f"defect = {json.dumps(defect)}"
    yield f"twin = {json.dumps(plan.crane.name)}"


def _crane(made: Setting) -> Iterator[str]:
    yield "\n[crane]"
    for n in numbers(made.reference):
        source = f"kind = {json.dumps(n.source.kind.value)}, source = {json.dumps(n.source.text)}"
        yield f"{n.name} = {{ value = {n.value!r}, {source} }}  # {n.meaning}"


def _follows(plan: Plan, made: Setting) -> Iterator[str]:
    """The reference crane in the twin's parameters."""
    a, reference, law = plan.crane.active, made.reference, reference_friction(plan.crane, made.reference)
    yield "\n[follows]"
    yield f"C_h = {reference.capacitance * capacitance(a.line.V, a.line.bulk_modulus)!r}  # m^3/Pa, each line"
    leak, at = active_leak(plan.crane, reference), working(plan.crane)
    C = float(gap_pump(at.stroke, leak) + gap_motor(at.speed, leak))
    yield (
        f"leakage = {C!r}  # m^3/s/Pa, at {at.stroke!r} of the pumps' stroke, motors at {at.speed!r} rad/s,"
        f" {at.pressure!r} Pa"
    )
    yield f"J_m_eff = {reference.inertia * plan.crane.inertia.J_m_eff!r}  # kg m^2, full drum"
    bank = gas_bank(plan.crane, reference)
    yield f"gas_volume = {bank.V_mid!r}  # m^3, with the piston at mid stroke"
    yield f"gas_mass = {bank.n * M_N2!r}  # kg"
    yield f"friction_mean = {law.mean_reference!r}  # N m, over the loads and speeds of the tests"
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
    yield f"zero_a = {f.zero_a!r}  # Pa"
    yield "\n[log.gain]"
    yield from (f"{name} = {c.gain!r}" for name, c in made.calibration.items())
    yield "\n[log.drift]"
    yield from (
        f"{name} = {{ size = {d.size!r}, period = {d.period!r}, phase = {d.phase!r} }}"
        for name, d in made.drift.items()
    )
