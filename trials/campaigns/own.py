"""Synthetic campaigns of winches without a reference plant: the twin's own engine goes through the tests, with hidden
deviations of its crane, delay, sensors and clock.

Such logs obey the twin's own equations: they test the procedure, not the physics. Title, remark and every page say so.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_folder, check_folder
from stillhook.control.interface import SPEED
from stillhook.engine.arguments import SERIES_STEP, steps_per_cycle
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.pack.winch import motor_speed_max, wire_speed_max
from stillhook.engine.runner import Ending
from stillhook.engine.scenario.problem import Result, run_cases, summarise
from stillhook.errors import ValidateError
from stillhook.library import crane_toml, load_crane
from stillhook.library.examples import CAMPAIGN_FILE, LOG_FOLDER, MARK, REFERENCE_FILE
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.spec.scenario import Sensors as CaseSensors
from stillhook.units import KINDS
from stillhook.validate.ahc.measures import judged_signal
from stillhook.validate.ahc.replay import with_gains
from stillhook.validate.data_set.campaign import Kind
from stillhook.validate.dynamics.model import C_H, C_LEAK, VISCOUS, bent, scaled
from stillhook.winches.records import CommonSignals, Tick
from trials.campaigns import reference
from trials.campaigns.defects import CLOCK, DEFECTS, FRICTION, STATED_DELAY, Defect, defect_of, defect_text
from trials.campaigns.plc_log import (
    AHC_COLUMNS,
    BITS,
    Calibration,
    Clock,
    Column,
    Sensor,
    Sensors,
    WrittenCampaign,
    ahc_sensors,
    check_campaign_folder,
    log_file,
    logged,
    write_log,
)
from trials.campaigns.reference import CRANE_FILE, NOISE, READ, campaign_text
from trials.campaigns.schedule import Plan, PlannedTest, Sea, sea_trials
from trials.reference_plant import plant as reference_plant

OWN = "the twin's own equations: it tests the procedure, not the physics"
"""What is said of such logs wherever they appear."""
INERTIA, CIRCUIT, DELAY = 0.03, {C_H: 0.03, C_LEAK: 0.05}, 5e-3
"""Half widths of the even distributions of inertia and circuit about 1 and of the delay [s] (assumed: such a number of
a crane file is known to some per cent)."""
CALIBRATION = 0.003
"""Half width of the calibration error of a sensor, part of the reading (assumed: class of a transmitter)."""
CELL, CELL_ZERO = 0.004, 2e3
"""The same of the load cell, and of what it shows without load [N] (assumed: class of a load pin)."""
SENSOR_NOISE, ROOM = 1e-3, 1.2
"""Standard deviation of a sample of a drive's signal, part of its range, and that range over the largest value of the
tests (assumed: transducer and 12-bit input card)."""
UNSEEN = ("T_f", "F_f")
"""Friction of a winch, which no sensor shows."""
DRY = ("dry", "breakaway", VISCOUS)
POSSIBLE = (Defect.FRICTION, Defect.GEAR, Defect.MRU_DELAY, Defect.K_1, Defect.CLOCK, Defect.GAP, Defect.LOAD_CELL)
"""Defects that have a meaning for every winch; friction and gear for those with motors."""
WITH_MOTORS = (Defect.FRICTION, Defect.GEAR)


class Deviations(NamedTuple):
    """Hidden deviations of the crane and its log from twin and campaign file: factors [-] and times [s]."""

    friction: float
    inertia: float
    circuit: Mapping[str, float]
    gear: float
    K_1: float
    delay: float
    clock: Clock
    cell_gain: float
    cell_zero: float  # [N]
    cell_unit: float
    gap: float

    def crane(self, crane: Crane) -> Crane:
        """The crane with its deviations, its PLC with the gains of the twin."""
        logs = dict.fromkeys(DRY, math.log(self.friction)) | {n: math.log(x) for n, x in self.circuit.items()}
        changed = scaled(bent(with_gains(crane), logs), self.inertia, "inertia.J_gear", "inertia.J_drum")
        return scaled(scaled(changed, self.gear, "i_hD"), self.K_1, "control.K_1")


def deviations(crane: Crane, seed: int, defect: Defect | None = None, size: float | None = None) -> Deviations:
    """The deviations of a seed, and one defect. Errors: ValidateError for a defect without a meaning for the winch."""
    rng = np.random.default_rng([seed, 3])

    def about_one(half: float) -> float:
        return 1.0 + half * float(rng.uniform(-1.0, 1.0))

    out = Deviations(
        friction=about_one(FRICTION),
        inertia=about_one(INERTIA),
        circuit={name: about_one(half) for name, half in CIRCUIT.items() if "active" in crane.circuits},
        gear=1.0,
        K_1=1.0,
        delay=STATED_DELAY + DELAY * float(rng.uniform(-1.0, 1.0)),
        clock=Clock(drift=CLOCK * float(rng.uniform(-1.0, 1.0)), jitter=1e-3 * float(rng.uniform(0.5, 2.0))),
        cell_gain=about_one(CELL),
        cell_zero=CELL_ZERO * float(rng.uniform(-1.0, 1.0)),
        cell_unit=1.0,
        gap=0.0,
    )
    return out if defect is None else _with_defect(out, crane, defect, size)


def _with_defect(d: Deviations, crane: Crane, defect: Defect, size: float | None) -> Deviations:
    possible = [x for x in POSSIBLE if x not in WITH_MOTORS or _has_motors(crane)]
    if defect not in possible:
        raise ValidateError(
            f'The defect {defect} has no meaning in logs of winch type "{crane.plant.value}", which are simulated by'
            f" its own equations. Choose one of {', '.join(possible)}."
        )
    x, (least, most) = DEFECTS[defect].size if size is None else size, DEFECTS[defect].allowed
    if not least <= x <= most:
        raise ValidateError(
            f"size = {x:g}: the defect {defect} allows {least:g} to {most:g}. Choose a size in this range."
        )
    changes: Mapping[Defect, Mapping[str, object]] = {
        Defect.FRICTION: {"friction": d.friction * (1.0 + x)},
        Defect.GEAR: {"gear": 1.0 + x},
        Defect.MRU_DELAY: {"delay": STATED_DELAY + x},
        Defect.K_1: {"K_1": 1.0 + x},
        Defect.CLOCK: {"clock": replace(d.clock, drift=d.clock.drift + x)},
        Defect.GAP: {"gap": x},
        Defect.LOAD_CELL: {"cell_unit": x},
    }
    return d._replace(**changes[defect])  # type: ignore[arg-type]


def _has_motors(crane: Crane) -> bool:
    return any(row.name == "omega_m" for row in crane.plant.type.rows)


def trials(crane: str | Crane) -> Plan:
    """`sea_trials`; of a winch without a reference plant those that have a meaning for it.

    A drive that takes a speed is tested in its own mode, and without a closed circuit there are no quick turns to tune
    it on. A winch slower than nov-250t gets longer waves of the same height, so that it follows them as easily.
    """
    plan = sea_trials(crane)
    if plan.crane.plant == reference_plant.OF:
        return plan
    winch = plan.crane.plant.type
    stretch = max(1.0, wire_speed_max(load_crane("nov-250t")) / wire_speed_max(plan.crane))

    def adapted(test: PlannedTest) -> PlannedTest:
        if test.kind is not Kind.AHC or test.sea is None:
            return test
        sea = Sea(test.sea.lowest, test.sea.highest, stretch * test.sea.period, test.sea.ramp)
        return replace(test, sea=sea, mode=winch.default_mode if winch.control == SPEED else test.mode)

    tests = [t for t in plan.tests if t.kind is not Kind.DYNAMICS or "active" in plan.crane.circuits]
    return replace(plan, tests=tuple(adapted(t) for t in tests), source=f"{plan.source}; by {OWN}")


@dataclass(frozen=True)
class Run:
    """One test as it was run: its case, result and status."""

    case: Scenario
    result: Result
    status: str


def write_campaign(
    out: str | Path,
    *,
    plan: Plan | None = None,
    seed: int = 0,
    defect: Defect | str | None = None,
    size: float | None = None,
    apart: bool = False,
    real: Crane | None = None,
    threads: int = 2,
) -> WrittenCampaign:
    """Write a synthetic validation campaign of any winch type: by the reference plant where the type has one
    (`trials.campaigns.reference.write_campaign`, which says what the parameters are), else by the type's own
    engine. real: crane that the logs are of in place of the plan's, which its PLC takes it for: any number of the crane
    file may differ, so that it shows whether validation detects it; not where the type has a reference plant.

    Errors: ValidateError, SpecError, SimulationError of one line; nothing is left half-written.
    """
    plan = plan or sea_trials()
    _check_real(plan, real)
    if plan.crane.plant == reference_plant.OF:
        return reference.write_campaign(
            out,
            plan=plan,
            seed=seed,
            defect=defect,
            size=size,
            apart=apart,
            threads=threads,
        )
    if apart:
        raise ValidateError(
            f'apart: only campaigns of a reference plant have it, and winch type "{plan.crane.plant.value}" has none.'
            " Leave it out."
        )
    folder, named = Path(out), None if defect is None else defect_of(defect)
    reference.check_seed(seed, named, size)
    made = deviations(plan.crane, seed, named, size)
    check_campaign_folder(folder)
    check_folder(folder, (CRANE_FILE,))
    files = [log_file(t.name) for t in plan.tests]
    crane = made.crane(plan.crane if real is None else _under_plc_of(plan.crane, real))

    with ThreadPoolExecutor(threads) as pool:
        runs = list(pool.map(lambda i: _run(crane, plan, i, seed, made), range(len(plan.tests))))
    columns = columns_of(plan.crane)
    sensors = _sensors(plan.crane, columns, runs, np.random.default_rng([seed, 4]))
    with atomic_folder(folder) as part:
        (part / LOG_FOLDER).mkdir()
        for i, (done, file) in enumerate(zip(runs, files, strict=True)):
            _write(part / file, plan, i, seed, made, done, columns, sensors)
        if not plan.crane_name:
            (part / CRANE_FILE).write_text(crane_toml(plan.crane), encoding="utf-8")
        words = f'crane "{crane.name}" in place of the twin; ' if real is not None else ""
        words += "none" if named is None else f"{named}: {defect_text(named, size)}"
        (part / REFERENCE_FILE).write_text(_reference(plan, seed, words, made, sensors), encoding="utf-8")
        text = campaign_text(plan, seed, STATED_DELAY, files, sensors, columns, OWN)
        (part / CAMPAIGN_FILE).write_text(text, encoding="utf-8")
    notes = [
        f'test "{t.name}": went beyond limits: {done.status}'
        for t, done in zip(plan.tests, runs, strict=True)
        if done.status != "ok"
    ]
    return WrittenCampaign.of(folder, files, sensors, notes)


def _check_real(plan: Plan, real: Crane | None) -> None:
    if real is None:
        return
    if plan.crane.plant == reference_plant.OF:
        raise ValidateError(
            f'real: winch type "{real.plant.value}" has a reference plant with parameters of its own. State a defect.'
        )
    if real.plant != plan.crane.plant:
        raise ValidateError(
            f'real: "{real.name}" is of winch type "{real.plant.value}", the twin of "{plan.crane.plant.value}".'
            " Choose a crane of the twin's type."
        )


def _under_plc_of(twin: Crane, real: Crane) -> Crane:
    """The real crane, whose PLC has the settings and gains that follow from the twin's crane file."""
    return real.model_copy(update={"control": with_gains(twin).control})


def columns_of(crane: Crane) -> tuple[Column, ...]:
    """What the PLC of such a winch logs: the signals of the motion unit and of every winch, and those of its drive."""
    rows = {row.name: row for row in crane.plant.type.rows}
    there = set(CommonSignals._fields) | set(rows)
    left_out = () if "active" in crane.circuits else ("u_m",)
    common = [c for c in AHC_COLUMNS if c.name in there and c.name not in left_out]
    if left_out:
        common = [c._replace(heading="Speed command") if c.name == "u_p" else c for c in common]
    named = {c.name for c in common}
    own = [
        Column(row.name, row.name, KINDS[row.kind].display if row.kind else "1", row.kind)
        for row in rows.values()
        if judged_signal(row) and row.name not in named and row.name not in UNSEEN
    ]
    return (*common, *own)


def _run(crane: Crane, plan: Plan, i: int, seed: int, made: Deviations) -> Run:
    noise_seed = int(np.random.SeedSequence([seed, i]).generate_state(1)[0])
    case = plan.tests[i].case(CaseSensors(delay=f"{made.delay!r} s", seed=noise_seed, **NOISE), seed, i)
    [result] = run_cases([crane], [case], n_sub=steps_per_cycle(crane, None, SERIES_STEP), lanes=1, every=1)
    if result.ending is not Ending.DONE or result.series is None:
        raise ValidateError(
            f'test "{case.name}": the simulation of the crane diverges at {result.t_end:.4g} s. Check the crane file.'
        )
    return Run(case, result, str(summarise(crane, case, result)["status"]))


def _sensors(crane: Crane, columns: Sequence[Column], runs: Sequence[Run], rng: np.random.Generator) -> Sensors:
    """Sensors of the columns; those of the drive's own signals have a range that the tests leave room in."""
    r_eff = 0.5 * crane.drum.d_max / crane.i_hD
    fastest = motor_speed_max(crane, crane.plant.type.least_displacement(crane))
    known = ahc_sensors(crane, max(fastest, wire_speed_max(crane) / r_eff), {})
    out = {}
    for c in columns:
        if c.name in known:
            out[c.name] = known[c.name]
            continue
        largest = ROOM * max(float(np.abs(run.result.column(c.name)).max()) for run in runs)
        largest = _round_up(largest) if largest > 0.0 else UNUSED
        calibration = Calibration(1.0 + CALIBRATION * float(rng.uniform(-1.0, 1.0)))
        out[c.name] = Sensor(
            -largest, largest, 2.0 * largest / 2**BITS, noise=SENSOR_NOISE * largest, gain=calibration.gain
        )
    return out


UNUSED = 1.0
"""Range of the sensor of a signal that stays 0 in every test, such as a resistor's that never burns [SI]."""


def _round_up(x: float) -> float:
    """The next number with two digits."""
    unit = 10.0 ** (math.floor(math.log10(max(x, 1e-9))) - 1)
    return math.ceil(x / unit) * unit


def _write(
    path: Path,
    plan: Plan,
    i: int,
    seed: int,
    made: Deviations,
    run: Run,
    columns: Sequence[Column],
    sensors: Sensors,
) -> None:
    """The log of one test."""
    rng = np.random.default_rng([seed, i, 2])
    n, t_cycle = len(run.result.series), plan.crane.control.t_cycle  # type: ignore[arg-type]
    rows = CycleInputs(plan.crane, run.case).rows(0, n)
    inputs = {field: rows[:, k] for k, field in enumerate(Tick._fields)}
    true: dict[str, FloatArray] = {c.name: run.result.column(c.name) for c in columns}
    true |= {name: inputs[column] for name, column in READ.items()}
    true["s_w"] = true["s_w"] + inputs["n_s"]
    true["F_w"] = made.cell_gain * true["F_w"] + made.cell_zero + inputs["n_F"]
    signals = {c.name: logged(true[c.name], sensors[c.name], t_cycle, rng) for c in columns}
    signals["F_w"] = signals["F_w"] / made.cell_unit
    test = plan.tests[i]
    t: FloatArray = run.result.dt * np.arange(n, dtype=np.float64)
    time: FloatArray = np.round(made.clock.stamps(t, rng), 4)
    gap = made.gap if test is max(plan.tests, key=lambda t: t.duration) else 0.0
    keep = abs(time - 0.5 * test.duration) >= 0.5 * gap
    write_log(path, time[keep], {name: x[keep] for name, x in signals.items()}, columns, sensors)


def _reference(plan: Plan, seed: int, defect: str, made: Deviations, sensors: Sensors) -> str:
    """TOML: seed, defect in words, the hidden deviations [SI]."""
    lines = [
        f"# {MARK}, by {OWN}. Deviations of the crane of the logs.",
        f"seed = {seed}",
        f"defect = {json.dumps(defect)}",
        f"twin = {json.dumps(plan.crane.name)}",
        "\n[crane]",
        f"friction = {made.friction!r}  # over the twin's",
        f"inertia = {made.inertia!r}  # gears and bare drum, over the twin's",
        *(f"{name} = {x!r}  # over the twin's" for name, x in made.circuit.items()),
        f"gear = {made.gear!r}  # over the twin's",
        f"K_1 = {made.K_1!r}  # of the PLC, over the twin's",
        "\n[log]",
        f"delay = {made.delay!r}  # s, of the motion unit; the campaign states {STATED_DELAY!r}",
        f"clock_drift = {made.clock.drift!r}",
        f"clock_jitter = {made.clock.jitter!r}  # s",
        f"cell_gain = {made.cell_gain!r}",
        f"cell_zero = {made.cell_zero!r}  # N",
        f"cell_unit = {made.cell_unit!r}",
        f"gap = {made.gap!r}  # s",
        "\n[log.gain]",
        *(f"{name} = {s.gain!r}" for name, s in sensors.items() if s.gain != 1.0),
    ]
    return "\n".join(lines) + "\n"
