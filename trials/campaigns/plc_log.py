"""Campaigns of simulated tests as files, and what a crane's PLC logs of a run: ranges and steps of the sensors,
noise, delays, calibration."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import check_folder
from stillhook.base.choice import choice
from stillhook.errors import IdentifyError, SimulationError
from stillhook.formats.table.dialect import PURE
from stillhook.library.examples import CAMPAIGN_FILE, LOG_FOLDER, REFERENCE_FILE, write_csv
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.statistics.time_lag import low_pass
from stillhook.units import KINDS, from_display, parse, quote

BITS = 12
"""Resolution of the analogue inputs of a PLC over a sensor's range (typical of input cards)."""
NOISE_P = 0.5e5
"""Standard deviation of a pressure sample [Pa]."""
NOISE_SPEED = 0.002
"""Standard deviation of a speed sample, part of the reading [-]."""
SETTING_RANGE = 1.05
"""Range of that sensor: with its end at 1 the noise of a motor at full displacement would be cut on one side
(assumed)."""
NOISE_SETTING = 5e-4
"""Standard deviation of a sample of the motors' measured setting [-] (assumed)."""
NOISE_CELL = 0.002
"""Standard deviation of a load cell sample, part of its range [-] (assumed)."""
DELAY_SPEED = 0.02
DELAY_CELL = 0.1
"""Delays of the speed and the load cell signals behind the pressures [s] (assumed: counting window, filter of the
cell)."""
WIRE_STEP = 1e-3
"""Wire paid out per count of the encoder [m] (assumed)."""
CELL_RANGE = 1.5
"""Range of the load cell over the weight of SWL and hook [-] (assumed)."""
P_RANGE = 400e5
"""Range of the pressure transmitters [Pa]."""
SPEED_STEP = 500.0 * math.pi / 30.0
"""The range of the speed pick-up is a whole number of these [rad/s]."""
STALE = 0.003
"""Chance that a sample is that of the cycle before, because it came too late for its own (assumed)."""
DECIMALS = 2
"""Decimals of a logged value beyond its sensor's smallest step: the log then holds that step unharmed."""


class Noise(StrEnum):
    """How true a synthetic log is: as simulated with all digits, or as a PLC sees it."""

    NONE = "none"
    TYPICAL = "typical"


class Column(NamedTuple):
    """A column of the log: our name, the heading in the log, the unit that it is logged in and the kind of quantity."""

    name: str
    heading: str
    unit: str
    kind: str


def _columns(log: str) -> Iterator[tuple[Column, float | None]]:
    """Columns of a kind of log, each with the smallest step of what the PLC has as a number already [SI] (assumed)."""
    for row in csv.DictReader(Path(__file__).with_name("plc_columns.csv").read_text(encoding="utf-8").splitlines()):
        if row["log"] == log:
            column = Column(row["name"], row["heading"], row["unit"], row["kind"])
            yield column, float(row["step"]) if row["step"] else None


COLUMNS = tuple(column for column, _ in _columns("friction"))
"""What the PLC logs in friction tests next to the time (Moslatt 2020 section 2.2 and paper D section 2.2)."""
AHC_COLUMNS = tuple(column for column, _ in _columns("ahc"))
"""What the PLC logs in heave compensation next to the time: all that the five steps of Moslatt 2020 paper F can use."""
AHC_STEPS = {column.name: step for column, step in _columns("ahc") if step is not None}
"""Smallest steps of what the PLC has as a number already, in SI (assumed)."""


@dataclass(frozen=True)
class Sensor:
    """lo, hi ends of the range; step smallest step (0: none); noise standard deviation of a sample, in SI; noise_part
    the same as part of the reading; delay [s]; the sensor shows gain * value + offset; tau time constant of its filter
    [s]; stale chance that a sample is that of the cycle before [-]."""

    lo: float = -math.inf
    hi: float = math.inf
    step: float = 0.0
    noise: float = 0.0
    noise_part: float = 0.0
    delay: float = 0.0
    gain: float = 1.0
    offset: float = 0.0
    tau: float = 0.0
    stale: float = 0.0


Sensors = dict[str, Sensor]


@dataclass(frozen=True)
class Calibration:
    """Systematic errors of one sensor: it shows gain * value + offset [SI]."""

    gain: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Instruments:
    """The sensors of a campaign by the name of their signal, and their seed."""

    noise: Noise = Noise.TYPICAL
    seed: int = 0
    calibration: Mapping[str, Calibration] = field(default_factory=dict)

    def sensors(self, crane: Crane, fastest: float) -> Sensors:
        """The sensors for a crane and the highest motor speed of the tests [rad/s]. Errors: IdentifyError."""
        sensors = _typical(crane, fastest) if self.noise is Noise.TYPICAL else {c.name: Sensor() for c in COLUMNS}
        unknown = next((name for name in self.calibration if name not in sensors), None)
        if unknown is not None:
            raise IdentifyError(f"calibration: {quote(unknown)} is not logged. Logged are {', '.join(sensors)}.")
        return _calibrated(sensors, self.calibration)


def _calibrated(sensors: Sensors, calibration: Mapping[str, Calibration]) -> Sensors:
    """The sensors with the systematic errors of those that have some."""
    return sensors | {name: replace(sensors[name], **asdict(error)) for name, error in calibration.items()}


def noise_of(text: Noise | str) -> Noise:
    """The noise of this name. Errors: IdentifyError naming those there are."""
    return choice(Noise, text, "noise")


def _typical(crane: Crane, fastest: float) -> dict[str, Sensor]:
    speed = SPEED_STEP * math.ceil(1.05 * fastest / SPEED_STEP)
    cell = CELL_RANGE * (crane.SWL + crane.hook_mass) * G
    return {
        "p_a": _analogue(0.0, P_RANGE, noise=NOISE_P),
        "p_b": _analogue(0.0, P_RANGE, noise=NOISE_P),
        "omega_m": _analogue(-speed, speed, noise_part=NOISE_SPEED, delay=DELAY_SPEED),
        "u_p": _analogue(-1.0, 1.0),
        "alpha_m": _analogue(0.0, SETTING_RANGE, noise=NOISE_SETTING),
        "F_w": _analogue(0.0, cell, noise=NOISE_CELL * cell, delay=DELAY_CELL),
        "s_w": Sensor(step=WIRE_STEP),
    }


def _analogue(lo: float, hi: float, *, noise: float = 0.0, noise_part: float = 0.0, delay: float = 0.0) -> Sensor:
    return Sensor(lo, hi, (hi - lo) / 2**BITS, noise, noise_part, delay)


def logged(reference: FloatArray, sensor: Sensor, t_cycle: float, rng: np.random.Generator) -> FloatArray:
    """What the PLC logs of a signal that it reads every t_cycle [s]: late, out of calibration, noisy, held in its
    range, in steps.

    Before the first sample the signal had its first value. Shapes (n,) in and out, SI.
    """
    if sensor.tau > 0.0:
        reference = filtered(reference, t_cycle / sensor.tau)
    late = min(round(sensor.delay / t_cycle), len(reference))
    y: FloatArray = np.concatenate([np.full(late, reference[0]), reference[: len(reference) - late]])
    y = sensor.gain * y + sensor.offset
    if sensor.noise > 0.0 or sensor.noise_part > 0.0:
        y = y + rng.standard_normal(len(y)) * np.hypot(sensor.noise, sensor.noise_part * y)
    if sensor.stale > 0.0:
        stale = np.concatenate([[False], rng.random(len(y) - 1) < sensor.stale])
        y = np.where(stale, np.concatenate([y[:1], y[:-1]]), y)
    y = np.clip(y, sensor.lo, sensor.hi)
    return np.round(y / sensor.step) * sensor.step if sensor.step > 0.0 else y


def filtered(x: FloatArray, ratio: float) -> FloatArray:
    """First-order lag of an analogue signal; ratio spacing over time constant. It starts settled."""
    return low_pass(x, 1.0 - math.exp(-ratio))


def in_log_unit(values: FloatArray, column: Column, sensor: Sensor) -> FloatArray:
    """SI values in the unit of their column, rounded far below the sensor's step where it has one."""
    factor = unit_factor(column)
    out = values / factor
    if sensor.step == 0.0:
        return out
    return np.round(out, decimals(sensor.step / factor))


def decimals(step: float) -> int:
    """Decimals of a log for a sensor of this smallest step."""
    return DECIMALS - math.floor(math.log10(step))


def unit_factor(column: Column) -> float:
    """SI value of one unit of a column."""
    if not column.kind:
        return PURE[column.unit]
    if column.unit == KINDS[column.kind].display:
        return from_display(1.0, column.kind)
    return parse(f"1 {column.unit}", column.kind)


@dataclass(frozen=True)
class Clock:
    """The clock of a log: drift part by which it runs fast [-]; jitter by which a stamp comes late at most [s]."""

    drift: float = 0.0
    jitter: float = 0.0

    def stamps(self, t: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Stamps of samples taken at the times t (n,) [s]; the first one is exact."""
        late = self.jitter * rng.random(len(t))
        return np.asarray((1.0 + self.drift) * (t + late - late[0]))


def ahc_sensors(crane: Crane, fastest: float, calibration: Mapping[str, Calibration]) -> Sensors:
    """The sensors of a heave-compensated crane's log; fastest motor speed [rad/s]. What the PLC has as a number already
    (its commands, tip, error, and the wire encoder and load cell after `stillhook.engine.inputs`) is logged as it
    is."""
    typical, r_eff = _typical(crane, fastest), 0.5 * crane.drum.d_max / crane.i_hD
    speed = typical["omega_m"]
    sensors = {
        **{name: Sensor(step=step) for name, step in AHC_STEPS.items()},
        **{name: replace(typical[name], stale=STALE) for name in ("p_a", "p_b", "omega_m")},
        "p_hp": replace(typical["p_a"], stale=STALE),
        "v_w": _analogue(-speed.hi * r_eff, speed.hi * r_eff, noise_part=NOISE_SPEED, delay=DELAY_SPEED),
        "alpha_p": _analogue(-SETTING_RANGE, SETTING_RANGE, noise=NOISE_SETTING),
        "alpha_m": typical["alpha_m"],
        "alpha_pm": typical["alpha_m"],
        "s_w": typical["s_w"],
        "F_w": replace(typical["F_w"], noise=0.0, delay=0.0),
    }
    sensors = _calibrated(sensors, calibration)
    return {c.name: sensors[c.name] for c in AHC_COLUMNS}


TIME = 'time = { column = "Time", unit = "s" }'
"""Line of a campaign file for the time of these logs."""


@dataclass(frozen=True)
class WrittenCampaign:
    """What was written: the folder, its campaign file, the logs, the file with the crane that they are of; the sensors
    of the logs, and what the tests could not keep to. layer of wire of friction tests."""

    folder: Path
    campaign: Path
    logs: tuple[Path, ...]
    reference: Path
    sensors: Sensors
    notes: tuple[str, ...]
    layer: int | None = None

    @classmethod
    def of(
        cls, folder: Path, files: Sequence[str], sensors: Sensors, notes: Iterable[str], layer: int | None = None
    ) -> WrittenCampaign:
        """The campaign in a folder; files: paths of the logs, seen from the campaign file."""
        logs = tuple(folder / file for file in files)
        return cls(folder, folder / CAMPAIGN_FILE, logs, folder / REFERENCE_FILE, sensors, tuple(notes), layer)


def check_campaign_folder(folder: Path) -> None:
    """Refuse a folder that a campaign cannot be written to, or that has logs already. Errors: SimulationError."""
    check_folder(folder, (CAMPAIGN_FILE, REFERENCE_FILE))
    if (folder / LOG_FOLDER).exists():
        raise SimulationError(f"{folder / LOG_FOLDER}: there are logs already. Choose another folder.")


def log_file(name: str) -> str:
    """Path of a test's log, seen from the campaign file."""
    return f"{LOG_FOLDER}/{name}.csv"


def write_log(
    path: Path, time: FloatArray, signals: Mapping[str, FloatArray], columns: Sequence[Column], sensors: Sensors
) -> None:
    """A marked log; time (n,) [s], signals as logged (n,) [SI]."""
    table = {"Time": time} | {c.heading: in_log_unit(signals[c.name], c, sensors[c.name]) for c in columns}
    write_csv(path, table)


def mapping_lines(columns: Sequence[Column], sensors: Sensors) -> list[str]:
    """The lines below [signals] in a campaign file."""
    return [TIME, *(f"{c.name} = {{ {', '.join(_signal(c, sensors[c.name]))} }}" for c in columns)]


def _signal(column: Column, sensor: Sensor) -> list[str]:
    """Heading, unit and range of a column, as a mapping writes them."""
    out = [f'column = "{column.heading}"', f'unit = "{column.unit}"']
    if abs(sensor.lo) < float("inf") and column.kind:
        lo, hi = (f'"{x / unit_factor(column):.12g} {column.unit}"' for x in (sensor.lo, sensor.hi))
        out.append(f"range = [{lo}, {hi}]")
    return out
