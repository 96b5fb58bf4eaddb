"""The simulated crane of winches with a reference plant: drawn by seed, with sensors, drifting zeros and faults of its
logger."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import motor_speed_max
from stillhook.errors import ValidateError
from stillhook.library.examples import MARK
from stillhook.physics.hydraulics.lines import capacitance
from stillhook.spec.crane import Crane, passive_of
from stillhook.spec.scenario import Scenario
from trials.campaigns.defects import Defect, Setting, setting, with_defect
from trials.campaigns.plc_log import AHC_COLUMNS, Clock, Sensors, ahc_sensors, filtered
from trials.campaigns.schedule import Plan, Run
from trials.reference_plant.laws import gap_motor, gap_pump
from trials.reference_plant.pack import simulate_reference
from trials.reference_plant.parameters import (
    M_N2,
    active_leak,
    gas_bank,
    numbers,
    reference_friction,
    working,
)


class OfReferencePlant:
    """The reference crane of a seed, with a defect; see `trials.campaigns.write.SimulatedCrane`."""

    columns, basis = AHC_COLUMNS, ""

    def __init__(
        self, plan: Plan, seed: int, defect: Defect | None, size: float | None, *, apart: bool, real: Crane | None
    ) -> None:
        if real is not None:
            raise ValidateError(
                f'real: winch type "{real.plant.value}" has a reference plant with parameters of its own. State a'
                " defect."
            )
        self.twin = plan.crane
        counts = {"motors": self.twin.active.motor.count, "passive_motors": passive_of(self.twin).motor.count}
        made = setting(seed, apart=apart, **counts)
        self.made = made if defect is None else with_defect(made, self.twin, defect, size)

    @property
    def delay(self) -> float:
        return self.made.delay

    @property
    def clock(self) -> Clock:
        return self.made.clock

    @property
    def gap(self) -> float:
        return self.made.faults.gap

    def run(self, case: Scenario) -> Run:
        run = simulate_reference(self.twin, case, self.made.reference)
        signals = {c.name: run[c.name].values for c in AHC_COLUMNS}
        return Run(case, run["time"].values, signals, str(run["status"].item()))

    def sensors(self, runs: Sequence[Run]) -> Sensors:
        fastest = motor_speed_max(self.twin, self.twin.active.motor.alpha_min)
        return ahc_sensors(self.twin, fastest, self.made.calibration)

    def measured(
        self, true: dict[str, FloatArray], inputs: Mapping[str, FloatArray], t: FloatArray
    ) -> dict[str, FloatArray]:
        cell, faults = self.made.reference, self.made.faults
        F = filtered(true["F_w"], self.twin.control.t_cycle / cell.tau_cell)
        true["F_w"] = cell.cell_gain * F + cell.cell_zero + inputs["n_F"]
        true |= {name: true[name] + drift.at(t) for name, drift in self.made.drift.items()}
        return true | {"p_a": true["p_a"] + faults.zero_a}

    def faulty(self, signals: dict[str, FloatArray]) -> dict[str, FloatArray]:
        signals["F_w"] = signals["F_w"] / self.made.faults.cell_unit
        if self.made.faults.swapped > 0.0:
            signals["p_a"], signals["p_b"] = signals["p_b"], signals["p_a"]
        return signals

    def text(self, seed: int, defect: str, sensors: Sensors) -> str:
        return f"# {MARK}. The reference crane of the logs.\n{reference_text(self.twin, seed, defect, self.made)}"


def reference_text(twin: Crane, seed: int, defect: str, made: Setting) -> str:
    """TOML: seed, defect in words, [crane] the parameters of the reference crane, [follows] what they are in the twin's
    parameters, numbers that tuning must find, [log] delays and clock; SI."""
    reference, a, f = made.reference, twin.active, made.faults
    law, bank = reference_friction(twin, reference), gas_bank(twin, reference)
    leak, at = active_leak(twin, reference), working(twin)
    C = float(gap_pump(at.stroke, leak) + gap_motor(at.speed, leak))
    where = f"at {at.stroke!r} of the pumps' stroke, motors at {at.speed!r} rad/s, {at.pressure!r} Pa"
    lines = [
        f"seed = {seed}",
        f"defect = {json.dumps(defect)}",
        f"twin = {json.dumps(twin.name)}",
        "\n[crane]",
    ]
    for n in numbers(reference):
        source = f"kind = {json.dumps(n.source.kind.value)}, source = {json.dumps(n.source.text)}"
        lines.append(f"{n.name} = {{ value = {n.value!r}, {source} }}  # {n.meaning}")
    lines += [
        "\n[follows]",
        f"C_h = {reference.capacitance * capacitance(a.line.V, a.line.bulk_modulus)!r}  # m^3/Pa, each line",
        f"leakage = {C!r}  # m^3/s/Pa, {where}",
        f"J_m_eff = {reference.inertia * twin.inertia.J_m_eff!r}  # kg m^2, full drum",
        f"gas_volume = {bank.V_mid!r}  # m^3, with the piston at mid stroke",
        f"gas_mass = {bank.n * M_N2!r}  # kg",
        f"friction_mean = {law.mean_reference!r}  # N m, over the loads and speeds of the tests",
        f"friction_mean_of_twin = {law.mean_twin!r}  # N m",
        f"friction_difference = {law.difference!r}  # rms of the relative difference in shape",
        "\n[log]",
        f"delay = {made.delay!r}  # s, of the motion unit; the campaign states {made.stated_delay!r}",
        f"clock_drift = {made.clock.drift!r}  # part by which stamps run fast",
        f"clock_jitter = {made.clock.jitter!r}  # s, latest stamp",
        f"swapped = {str(f.swapped > 0.0).lower()}",
        f"gap = {f.gap!r}  # s, in the middle of the longest log",
        f"cell_unit = {f.cell_unit!r}",
        f"zero_a = {f.zero_a!r}  # Pa",
        "\n[log.gain]",
        *(f"{name} = {c.gain!r}" for name, c in made.calibration.items()),
        "\n[log.drift]",
    ]
    for name, d in made.drift.items():
        lines.append(f"{name} = {{ size = {d.size!r}, period = {d.period!r}, phase = {d.phase!r} }}")
    return "\n".join(lines) + "\n"
