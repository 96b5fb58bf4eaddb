"""A complete synthetic campaign as files: the reference plant goes through the tests, and its PLC logs them.

The reference crane of a synthetic campaign as a file: every parameter of the reference plant with its source, and
derived values.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_folder, check_folder
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.pack.winch import motor_speed_max
from stillhook.errors import ValidateError
from stillhook.kernels.build import driver
from stillhook.library import crane_toml
from stillhook.library.examples import CAMPAIGN_FILE, LOG_FOLDER, MARK, REFERENCE_FILE
from stillhook.physics.hydraulics.lines import capacitance
from stillhook.spec.crane import Crane, passive_of
from stillhook.spec.scenario import Scenario
from stillhook.spec.scenario import Sensors as CaseSensors
from stillhook.units import quote, show
from stillhook.winches.records import Tick
from trials.campaigns.defects import Defect, Setting, defect_of, defect_text, setting, with_defect
from trials.campaigns.plc_log import (
    AHC_COLUMNS,
    Column,
    Sensors,
    WrittenCampaign,
    ahc_sensors,
    check_campaign_folder,
    filtered,
    log_file,
    logged,
    mapping_lines,
    write_log,
)
from trials.campaigns.schedule import Plan, sea_trials
from trials.reference_plant import plant as reference_plant
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


def reference_text(plan: Plan, seed: int, defect: str, made: Setting) -> str:
    """TOML: seed, defect in words, [crane] the parameters of the reference crane, [follows] what they are in the twin's
    parameters, numbers that tuning must find, [log] delays and clock; SI."""
    reference, a, f = made.reference, plan.crane.active, made.faults
    law, bank = reference_friction(plan.crane, reference), gas_bank(plan.crane, reference)
    leak, at = active_leak(plan.crane, reference), working(plan.crane)
    C = float(gap_pump(at.stroke, leak) + gap_motor(at.speed, leak))
    where = f"at {at.stroke!r} of the pumps' stroke, motors at {at.speed!r} rad/s, {at.pressure!r} Pa"
    lines = [
        f"seed = {seed}",
        f"defect = {json.dumps(defect)}",
        f"twin = {json.dumps(plan.crane.name)}",
        "\n[crane]",
    ]
    for n in numbers(reference):
        source = f"kind = {json.dumps(n.source.kind.value)}, source = {json.dumps(n.source.text)}"
        lines.append(f"{n.name} = {{ value = {n.value!r}, {source} }}  # {n.meaning}")
    lines += [
        "\n[follows]",
        f"C_h = {reference.capacitance * capacitance(a.line.V, a.line.bulk_modulus)!r}  # m^3/Pa, each line",
        f"leakage = {C!r}  # m^3/s/Pa, {where}",
        f"J_m_eff = {reference.inertia * plan.crane.inertia.J_m_eff!r}  # kg m^2, full drum",
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


CRANE_FILE = "crane.toml"
READ = {"s_tip": "s_m", "v_tip": "v_m", "a_tip": "a_m"}
"""Signals of the motion unit, and the columns of the drive that hold what the PLC got."""
NOISE: Mapping[str, str] = {
    "noise_s_tip": "1 mm",
    "noise_v_tip": "2 mm/s",
    "noise_a_tip": "0.01 m/s^2",
    "noise_s_w": "0.3 mm",
    "noise_F": "2 kN",
    "step_s_tip": "1 mm",
    "step_v_tip": "1 mm/s",
    "step_s_w": "1 mm",
    "step_F": "0.5 kN",
}
"""What the PLC reads with (assumed: a good motion unit and encoder, a load pin of some 0.1 % of its range)."""


def write_campaign(
    out: str | Path,
    *,
    plan: Plan | None = None,
    seed: int = 0,
    defect: Defect | str | None = None,
    size: float | None = None,
    apart: bool = False,
    threads: int = 2,
) -> WrittenCampaign:
    """Write a synthetic validation campaign: `campaign.toml`, `logs/*.csv` and `reference.toml`, which the campaign
    does not name.

    Parameters
    ----------
    out: folder, without a campaign in it yet. plan: the tests and the twin under test (default: `sea_trials()` of
    nov-250t). seed: another seed is another crane, sea and noise; the same seed gives the same bytes, whatever the
    threads. defect: None for a crane that its twin matches well, or one of `Defect`; size of the defect (default: the
    one of `DEFECTS`). apart: oil capacitance, leakage and inertia lie 10 to 30 % off the twin's, for tuning.

    Errors: ValidateError, SpecError, SimulationError of one line; nothing is left half-written.
    """
    folder, plan = Path(out), plan or sea_trials()
    named = None if defect is None else defect_of(defect)
    _check(plan, seed, named, size)
    check_campaign_folder(folder)
    check_folder(folder, (CRANE_FILE,))
    counts = {"motors": plan.crane.active.motor.count, "passive_motors": passive_of(plan.crane).motor.count}
    made = setting(seed, apart=apart, **counts)
    if named is not None:
        made = with_defect(made, plan.crane, named, size)
    sensors = ahc_sensors(plan.crane, motor_speed_max(plan.crane, plan.crane.active.motor.alpha_min), made.calibration)
    files = [log_file(t.name) for t in plan.tests]
    driver(reference_plant.NAME, 1)
    with atomic_folder(folder) as part:
        (part / LOG_FOLDER).mkdir()

        def work(i: int) -> list[str]:
            return _test(plan, i, seed, made, sensors, part / files[i])

        with ThreadPoolExecutor(threads) as pool:
            notes = [note for notes_of_test in pool.map(work, range(len(plan.tests))) for note in notes_of_test]
        if not plan.crane_name:
            (part / CRANE_FILE).write_text(crane_toml(plan.crane), encoding="utf-8")
        defect_words = "none" if named is None else f"{named}: {defect_text(named, size)}"
        (part / REFERENCE_FILE).write_text(
            f"# {MARK}. The reference crane of the logs.\n{reference_text(plan, seed, defect_words, made)}",
            encoding="utf-8",
        )
        (part / CAMPAIGN_FILE).write_text(
            campaign_text(plan, seed, made.stated_delay, files, sensors), encoding="utf-8"
        )
    return WrittenCampaign.of(folder, files, sensors, notes)


def check_seed(seed: int, defect: Defect | None, size: float | None) -> None:
    """Errors: ValidateError for a seed that is no integer of 0 or more, or a size without a defect."""
    if type(seed) is not int or seed < 0:
        raise ValidateError(f"seed = {quote(seed)}: it must be an integer of 0 or more.")
    if size is not None and defect is None:
        raise ValidateError(f"size = {quote(size)}: a size needs a defect. State the defect.")


def _check(plan: Plan, seed: int, defect: Defect | None, size: float | None) -> None:
    check_seed(seed, defect, size)
    if plan.crane.plant != reference_plant.OF:
        raise ValidateError(
            f'"{plan.crane.name}" is {plan.crane.plant}: example campaigns need an active/passive winch. Choose such a'
            " crane."
        )


def _test(plan: Plan, i: int, seed: int, made: Setting, sensors: Sensors, path: Path) -> list[str]:
    """Run one test and write its log; returns limits that it went beyond."""
    test = plan.tests[i]
    noise_seed = int(np.random.SeedSequence([seed, i]).generate_state(1)[0])
    case = test.case(CaseSensors(delay=f"{made.delay!r} s", seed=noise_seed, **NOISE), seed, i)
    run = simulate_reference(plan.crane, case, made.reference)
    rng = np.random.default_rng([seed, i, 2])
    begins = sum(t.duration for t in plan.tests[:i])
    signals = _as_logged(plan.crane, case, run, made, sensors, begins, rng)
    time = np.round(made.clock.stamps(run["time"].values, rng), 4)
    gap = made.faults.gap if test is max(plan.tests, key=lambda t: t.duration) else 0.0
    keep = abs(time - 0.5 * test.duration) >= 0.5 * gap
    write_log(path, time[keep], {name: values[keep] for name, values in signals.items()}, AHC_COLUMNS, sensors)
    status = str(run["status"].item())
    return [] if status == "ok" else [f'test "{test.name}": went beyond limits: {status}']


def _as_logged(
    crane: Crane, case: Scenario, run: Any, made: Setting, sensors: Sensors, begins: float, rng: np.random.Generator
) -> dict[str, FloatArray]:
    """What the log holds of every signal [SI]; begins time since the campaign began [s]. The tip is what the PLC got,
    encoder and load cell carry the noise that it saw."""
    t_cycle, faults = crane.control.t_cycle, made.faults
    rows = CycleInputs(crane, case).rows(0, run.sizes["time"])
    inputs = {field: rows[:, i] for i, field in enumerate(Tick._fields)}
    reference = {c.name: run[c.name].values for c in AHC_COLUMNS}
    reference |= {name: inputs[column] for name, column in READ.items()}
    reference["s_w"] = reference["s_w"] + inputs["n_s"]
    cell, F = made.reference, filtered(reference["F_w"], t_cycle / made.reference.tau_cell)
    reference["F_w"] = cell.cell_gain * F + cell.cell_zero + inputs["n_F"]
    reference |= {name: reference[name] + drift.at(begins + run["time"].values) for name, drift in made.drift.items()}
    reference["p_a"] = reference["p_a"] + faults.zero_a
    out = {c.name: logged(reference[c.name], sensors[c.name], t_cycle, rng) for c in AHC_COLUMNS}
    out["F_w"] = out["F_w"] / faults.cell_unit
    if faults.swapped > 0.0:
        out["p_a"], out["p_b"] = out["p_b"], out["p_a"]
    return out


def campaign_text(
    plan: Plan,
    seed: int,
    stated_delay: float,
    files: Sequence[str],
    sensors: Sensors,
    columns: Sequence[Column] = AHC_COLUMNS,
    basis: str = "",
) -> str:
    """The campaign file, as `load_campaign` reads it. It does not name the defect. basis: what the logs were simulated
    by, for the title and a remark."""
    lines = [
        f"# {MARK}. {plan.source}.",
        f'title = "SYNTHETIC{f" (by {basis})" if basis else ""} {plan.title}, seed {seed}"',
        f"date = {plan.date.isoformat()}",
        f'crane = "{plan.crane_name or CRANE_FILE}"',
        f'delay = "{show(stated_delay, "time", 12)}"',
        "synthetic = true",
        *([f'remarks = ["The logs were simulated by {basis}."]'] if basis else []),
        "",
        "[signals]",
        *mapping_lines(columns, sensors),
    ]
    for test, file in zip(plan.tests, files, strict=True):
        lines += ["", "[[test]]", f'name = "{test.name}"', f'log = "{file}"', f'kind = "{test.kind}"']
        lines.append(f'load = "{show(test.load, "mass", 12)}"')
        w = test.water
        if w is not None:
            area, mass, volume = show(w.area, "area", 12), show(w.added_mass, "mass", 12), f"{w.volume:.12g} m^3"
            lines.append(
                f'water = {{ volume = "{volume}", added_mass = "{mass}", C_D = {w.C_D:.12g}, area = "{area}" }}'
            )
    return "\n".join(lines) + "\n"
