"""Synthetic campaigns of winches without a reference plant: the twin's own engine goes through the tests, with hidden
deviations of its crane, delay, sensors and clock.

Such logs obey the twin's own equations: they test the procedure, not the physics. Title, remark and every page say so.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.interface import SPEED
from stillhook.engine.arguments import SERIES_STEP, steps_per_cycle
from stillhook.engine.pack.winch import motor_speed_max, wire_speed_max
from stillhook.engine.runner import Ending
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.errors import ValidateError
from stillhook.library import load_crane
from stillhook.library.examples import MARK
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.units import KINDS
from stillhook.validate.ahc.measures import judged_signal
from stillhook.validate.ahc.replay import with_gains
from stillhook.validate.data_set.campaign import Kind
from stillhook.validate.dynamics.model import C_H, C_LEAK, VISCOUS, bent, scaled
from stillhook.winches.records import CommonSignals
from trials.campaigns.defects import CLOCK, DEFECTS, FRICTION, STATED_DELAY, Defect
from trials.campaigns.plc_log import (
    AHC_COLUMNS,
    BITS,
    Clock,
    Column,
    Sensor,
    Sensors,
    ahc_sensors,
)
from trials.campaigns.schedule import Plan, PlannedTest, Run, Sea, sea_trials
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


class OfTwin:
    """The twin's crane with the hidden deviations of a seed, or another crane under its PLC; see
    `trials.campaigns.write.SimulatedCrane`."""

    basis = OWN

    def __init__(
        self, plan: Plan, seed: int, defect: Defect | None, size: float | None, *, apart: bool, real: Crane | None
    ) -> None:
        self.twin = plan.crane
        if real is not None and real.plant != self.twin.plant:
            raise ValidateError(
                f'real: "{real.name}" is of winch type "{real.plant.value}", the twin of "{self.twin.plant.value}".'
                " Choose a crane of the twin's type."
            )
        if apart:
            raise ValidateError(
                f'apart: only campaigns of a reference plant have it, and winch type "{self.twin.plant.value}" has'
                " none. Leave it out."
            )
        self.seed, self.columns = seed, columns_of(self.twin)
        self.made = deviations(self.twin, seed, defect, size)
        self.crane = self.made.crane(self.twin if real is None else _under_plc_of(self.twin, real))

    @property
    def delay(self) -> float:
        return self.made.delay

    @property
    def clock(self) -> Clock:
        return self.made.clock

    @property
    def gap(self) -> float:
        return self.made.gap

    def run(self, case: Scenario) -> Run:
        n_sub = steps_per_cycle(self.crane, None, SERIES_STEP)
        [result] = run_cases([self.crane], [case], step=n_sub, lanes=1, every=1, keep=unchanged)
        if result.ending is not Ending.DONE or result.series is None:
            raise ValidateError(
                f'test "{case.name}": the simulation of the crane diverges at {result.t_end:.4g} s. Check the crane'
                " file."
            )
        time: FloatArray = result.dt * np.arange(len(result.series), dtype=np.float64)
        signals = {c.name: result.column(c.name) for c in self.columns}
        return Run(case, time, signals, str(result.summary["status"]))

    def sensors(self, runs: Sequence[Run]) -> Sensors:
        """Those of the drive's own signals have a range that the tests leave room in."""
        rng = np.random.default_rng([self.seed, 4])
        r_eff = 0.5 * self.twin.drum.d_max / self.twin.i_hD
        fastest = motor_speed_max(self.twin, self.twin.plant.type.least_displacement(self.twin))
        known = ahc_sensors(self.twin, max(fastest, wire_speed_max(self.twin) / r_eff), {})
        out = {}
        for c in self.columns:
            if c.name in known:
                out[c.name] = known[c.name]
                continue
            largest = ROOM * max(float(np.abs(run.signals[c.name]).max()) for run in runs)
            largest = _round_up(largest) if largest > 0.0 else UNUSED
            gain = 1.0 + CALIBRATION * float(rng.uniform(-1.0, 1.0))
            out[c.name] = Sensor(-largest, largest, 2.0 * largest / 2**BITS, noise=SENSOR_NOISE * largest, gain=gain)
        return out

    def measured(
        self, true: dict[str, FloatArray], inputs: Mapping[str, FloatArray], t: FloatArray
    ) -> dict[str, FloatArray]:
        return true | {"F_w": self.made.cell_gain * true["F_w"] + self.made.cell_zero + inputs["n_F"]}

    def faulty(self, signals: dict[str, FloatArray]) -> dict[str, FloatArray]:
        return signals | {"F_w": signals["F_w"] / self.made.cell_unit}

    def text(self, seed: int, defect: str, sensors: Sensors) -> str:
        return _reference(self.twin, seed, defect, self.made, sensors)


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


UNUSED = 1.0
"""Range of the sensor of a signal that stays 0 in every test, such as a resistor's that never burns [SI]."""


def _round_up(x: float) -> float:
    """The next number with two digits."""
    unit = 10.0 ** (math.floor(math.log10(max(x, 1e-9))) - 1)
    return math.ceil(x / unit) * unit


def _reference(twin: Crane, seed: int, defect: str, made: Deviations, sensors: Sensors) -> str:
    """TOML: seed, defect in words, the hidden deviations [SI]."""
    lines = [
        f"# {MARK}, by {OWN}. Deviations of the crane of the logs.",
        f"seed = {seed}",
        f"defect = {json.dumps(defect)}",
        f"twin = {json.dumps(twin.name)}",
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
