"""A complete synthetic campaign as files: a simulated crane goes through the tests, and its PLC logs them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import accumulate
from pathlib import Path
from typing import Protocol

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_folder, check_folder
from stillhook.engine.inputs import CycleInputs
from stillhook.errors import ValidateError
from stillhook.library import crane_toml
from stillhook.library.examples import CAMPAIGN_FILE, LOG_FOLDER, MARK, REFERENCE_FILE
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.spec.scenario import Sensors as CaseSensors
from stillhook.units import quote, show
from stillhook.winches.records import Tick
from trials.campaigns.defects import STATED_DELAY, Defect, Setting, defect_of, defect_text
from trials.campaigns.own import OfTwin
from trials.campaigns.plc_log import (
    Clock,
    Column,
    Sensors,
    WrittenCampaign,
    check_campaign_folder,
    log_file,
    logged,
    mapping_lines,
    write_log,
)
from trials.campaigns.reference import OfReferencePlant
from trials.campaigns.schedule import Plan, Run, sea_trials
from trials.reference_plant import plant as reference_plant

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


class SimulatedCrane(Protocol):
    """The crane behind the logs. columns of its log; delay of its motion unit [s]; gap in the longest log [s]; basis:
    what the logs are simulated by, where that must be said."""

    @property
    def columns(self) -> Sequence[Column]: ...
    @property
    def basis(self) -> str: ...
    @property
    def delay(self) -> float: ...
    @property
    def clock(self) -> Clock: ...
    @property
    def gap(self) -> float: ...

    def run(self, case: Scenario) -> Run:
        """One test."""

    def sensors(self, runs: Sequence[Run]) -> Sensors:
        """The sensors of the columns."""

    def measured(
        self, true: dict[str, FloatArray], inputs: Mapping[str, FloatArray], t: FloatArray
    ) -> dict[str, FloatArray]:
        """What the sensors measure of the true signals [SI]; inputs: what the PLC reads every cycle, by the fields of
        `Tick`; t since the campaign began [s]."""

    def faulty(self, signals: dict[str, FloatArray]) -> dict[str, FloatArray]:
        """Signals as the log holds them, with the faults of the logger [SI]."""

    def text(self, seed: int, defect: str, sensors: Sensors) -> str:
        """The crane as TOML."""


def write_campaign(
    out: str | Path,
    *,
    plan: Plan | None = None,
    seed: int = 0,
    defect: Defect | str | None = None,
    size: float | None = None,
    apart: bool = False,
    real: Crane | None = None,
    made: Setting | None = None,
    threads: int = 2,
) -> WrittenCampaign:
    """Write a synthetic validation campaign of any winch type: `campaign.toml`, `logs/*.csv` and `reference.toml`,
    which the campaign does not name. The logs are of the reference plant where the type has one, else of the type's own
    engine.

    Parameters
    ----------
    out: folder, without a campaign in it yet. plan: the tests and the twin under test (default: `sea_trials()` of
    nov-250t). seed: another seed is another crane, sea and noise; the same seed gives the same bytes, whatever the
    threads. defect: None for a crane that its twin matches well, or one of `Defect`; size of the defect (default: the
    one of `DEFECTS`). apart: oil capacitance, leakage and inertia lie 10 to 30 % off the twin's, for tuning, of a
    reference plant alone. real: crane that the logs are of in place of the plan's, which its PLC takes it for: any
    number of the crane file may differ; not where the type has a reference plant. made: reference crane with its
    sensors in place of that of the seed, such as one that has aged; where the type has a reference plant.

    Errors: ValidateError, SpecError, SimulationError of one line; nothing is left half-written.
    """
    folder, plan = Path(out), plan or sea_trials()
    named = None if defect is None else defect_of(defect)
    if type(seed) is not int or seed < 0:
        raise ValidateError(f"seed = {quote(seed)}: it must be an integer of 0 or more.")
    if size is not None and named is None:
        raise ValidateError(f"size = {quote(size)}: a size needs a defect. State the defect.")
    check_campaign_folder(folder)
    check_folder(folder, (CRANE_FILE,))
    of = OfReferencePlant if plan.crane.plant == reference_plant.OF else OfTwin
    crane: SimulatedCrane = of(plan, seed, named, size, apart=apart, real=real)
    if made is not None and isinstance(crane, OfReferencePlant):
        crane.made = made

    def run(i: int) -> Run:
        noise_seed = int(np.random.SeedSequence([seed, i]).generate_state(1)[0])
        sensors = CaseSensors(delay=f"{crane.delay!r} s", seed=noise_seed, **NOISE)
        return crane.run(plan.tests[i].case(sensors, seed, i))

    with ThreadPoolExecutor(threads) as pool:
        runs = list(pool.map(run, range(len(plan.tests))))
    sensors = crane.sensors(runs)
    files = [log_file(t.name) for t in plan.tests]
    begins = list(accumulate((t.duration for t in plan.tests), initial=0.0))
    longest = max(plan.tests, key=lambda t: t.duration)
    with atomic_folder(folder) as part:
        (part / LOG_FOLDER).mkdir()
        for i, (test, done) in enumerate(zip(plan.tests, runs, strict=True)):
            time, signals = _log(crane, plan.crane, done, sensors, begins[i], np.random.default_rng([seed, i, 2]))
            keep = abs(time - 0.5 * test.duration) >= (0.5 * crane.gap if test is longest else 0.0)
            write_log(part / files[i], time[keep], {n: x[keep] for n, x in signals.items()}, crane.columns, sensors)
        if not plan.crane_name:
            (part / CRANE_FILE).write_text(crane_toml(plan.crane), encoding="utf-8")
        words = f'crane "{real.name}" in place of the twin; ' if real is not None else ""
        words += "none" if named is None else f"{named}: {defect_text(named, size)}"
        (part / REFERENCE_FILE).write_text(crane.text(seed, words, sensors), encoding="utf-8")
        text = campaign_text(plan, seed, STATED_DELAY, files, sensors, crane.columns, crane.basis)
        (part / CAMPAIGN_FILE).write_text(text, encoding="utf-8")
    notes = [
        f'test "{t.name}": went beyond limits: {done.status}'
        for t, done in zip(plan.tests, runs, strict=True)
        if done.status != "ok"
    ]
    return WrittenCampaign.of(folder, files, sensors, notes)


def _log(
    crane: SimulatedCrane, twin: Crane, run: Run, sensors: Sensors, begins: float, rng: np.random.Generator
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Stamps (n,) [s] and signals (n,) [SI] as the log holds them; begins: time since the campaign began [s]. The tip
    is what the PLC got, encoder and load cell carry the noise that it saw."""
    rows = CycleInputs(twin, run.case).rows(0, len(run.time))
    inputs = {field: rows[:, k] for k, field in enumerate(Tick._fields)}
    true = run.signals | {name: inputs[column] for name, column in READ.items()}
    true["s_w"] = true["s_w"] + inputs["n_s"]
    measured = crane.measured(true, inputs, begins + run.time)
    signals = {c.name: logged(measured[c.name], sensors[c.name], twin.control.t_cycle, rng) for c in crane.columns}
    return np.round(crane.clock.stamps(run.time, rng), 4), crane.faulty(signals)


def campaign_text(
    plan: Plan,
    seed: int,
    stated_delay: float,
    files: Sequence[str],
    sensors: Sensors,
    columns: Sequence[Column],
    basis: str,
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
