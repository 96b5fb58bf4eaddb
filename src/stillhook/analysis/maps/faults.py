"""Which fault of a sensor does which controller survive? One motion with one fault after another under each of them,
side by side with the run without a fault."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from stillhook.analysis.controllers import usual_controllers
from stillhook.base.progress import Progress
from stillhook.control.interface import QUANTITIES
from stillhook.engine.pack.capacity import tip_capacity
from stillhook.engine.runner import Run
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.errors import ScenarioError
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Scenario, mode_of
from stillhook.spec.sensors import TABLES, WITHOUT_VALUE, FaultKind, Sensors
from stillhook.units import quote

MOTION = "motion"
"""All three signals of the motion unit at once."""
OF_MOTION = ("s_tip", "v_tip", "a_tip")
AFTER_WARM_UP = 0.25
"""Part of the counted time after which the fault begins [-]."""
AT_REST, LAST = 0.05, 5.0
"""Wire speed below which a winch is at rest [m/s], if it is for the last so many seconds."""
LIMIT = 1.0
"""Wire by which a fault may move the load [m]. Assumed: what a stand-off of a few metres leaves room for."""
USUAL: tuple[str, ...] = tuple(
    f"{quantity} {kind} {value}".strip()
    for quantity, values in {
        "s_w": ("2 m", "0.05 m", "1 m"),
        MOTION: None,
        "v_tip": ("0.2 m/s", "0.02 m/s", "1 m/s"),
        "F": ("300 kN", "20 kN", "500 kN"),
        "alpha_m": ("0.3", "0.02", "0.3"),
        "p_a": ("50 bar", "5 bar", "100 bar"),
    }.items()
    for kind, value in (
        *((kind, "") for kind in WITHOUT_VALUE),
        *zip((FaultKind.OFFSET, FaultKind.DRIFT, FaultKind.SPIKE), values or (), strict=False),
    )
)
"""Faults that are tried where a user names none; a drift is what comes in a second. Assumed sizes."""


class Verdict(StrEnum):
    """What became of the load: compensated on, held by the winch at rest, or lost."""

    KEPT = "kept"
    ENDED = "ended"
    LOST = "lost"


class Outcome(NamedTuple):
    """A fault under a controller: verdict; moved wire by which it moved the load against the run without it [m]; F_max
    largest tension [N]; dp change of the active motors' pressure at most [Pa], NaN where there is none; detected time
    from its beginning to the alarm [s], NaN without one."""

    verdict: Verdict
    moved: float
    F_max: float
    dp: float
    detected: float


class FaultTable(NamedTuple):
    """Outcomes by fault and controller; time at which faults begin [s]; false_alarms of the runs without a fault, by
    controller, None where the crane file has no [control.guard]."""

    crane: Crane
    case: Scenario
    time: float
    outcomes: dict[str, dict[str, Outcome]]
    false_alarms: dict[str, float] | None

    @property
    def lost(self) -> list[str]:
        """Faults that are survived under no controller."""
        return [f for f, row in self.outcomes.items() if all(o.verdict is Verdict.LOST for o in row.values())]

    @property
    def ok(self) -> bool:
        """Whether every fault is survived under some controller."""
        return not self.lost


def fault_tables(text: str, time: float) -> dict[str, Any]:
    """Tables of [sensors] for a fault such as "s_w offset 1 m". Errors: ScenarioError of one line."""
    quantity, _, rest = text.strip().partition(" ")
    kind, _, value = rest.strip().partition(" ")
    names = OF_MOTION if quantity == MOTION else (quantity,)
    if quantity not in (*QUANTITIES, MOTION) or kind not in list(FaultKind):
        raise ScenarioError(
            f"faults: {quote(text)}: give a signal ({', '.join(QUANTITIES)}, or {MOTION}), a kind"
            f' ({", ".join(FaultKind)}) and for some a value, such as "s_w offset 1 m".'
        )
    number = {"value": float(value) if quantity == "alpha_m" and _is_number(value) else value} if value else {}
    fault = {"time": f"{time!r} s", "kind": kind, **number}
    return {name: {"faults": [fault]} for name in names}


def _is_number(text: str) -> bool:
    return text.replace(".", "", 1).lstrip("+-").isdigit()


def survive(
    crane: Crane,
    case: Scenario,
    modes: Sequence[Mode | str] | None = None,
    faults: Sequence[str] | None = None,
    *,
    limit: float = LIMIT,
    progress: Progress | None = None,
) -> FaultTable:
    """Run a scenario under several controllers with one fault after another.

    Parameters: crane, with or without [control.guard]; case, whose mode is replaced and which has no faults of its own;
    modes default the crane's usual ones; faults as texts, default those of `USUAL` that this winch has signals for;
    limit: wire by which a fault may move the load [m].

    A fault is survived where the run keeps its numbers, the tension stays within SWL and hook and the wire taut, and
    either the load is moved by no more than the limit against the run without it, or the winch comes to rest with the
    wire no further than the limit from where that run has it. Errors: ScenarioError of one line.
    """
    chosen = [mode_of(m) for m in (usual_controllers(crane).split(",") if modes is None else modes)]
    if any(table.faults for q in case.sensors.disturbed if (table := case.sensors.errors(q)) is not None):
        raise ScenarioError("sensors: this scenario has faults of its own. Leave them out: they are put in one by one.")
    time = round(case.warm_up + AFTER_WARM_UP * (case.duration - case.warm_up))
    known = _signals(crane)
    texts = [f for f in USUAL if f.partition(" ")[0] in (*known, MOTION)] if faults is None else list(faults)
    tables = [{}, *(fault_tables(text, time) for text in texts)]
    cases = [  # every run reads through all sensors: one kernel, side by side
        case.with_mode(mode).model_copy(update={"sensors": _sensors(case.sensors, known, each)})
        for mode in chosen
        for each in tables
    ]
    runs = run_cases(crane, cases, every=1, keep=unchanged, progress=progress)
    n = len(tables)
    outcomes: dict[str, dict[str, Outcome]] = {text: {} for text in texts}
    alarms = {}
    for i, mode in enumerate(chosen):
        healthy = runs[i * n]
        alarms[mode.value] = float(healthy.summary.get("alarms", math.nan))
        for text, run in zip(texts, runs[i * n + 1 : (i + 1) * n], strict=True):
            outcomes[text][mode.value] = outcome(crane, healthy, run, time, limit)
    return FaultTable(crane, case, time, outcomes, None if crane.control.guard is None else alarms)


def _signals(crane: Crane) -> list[str]:
    """Quantities that the PLC of a crane reads by a sensor."""
    signals = {row.name for row in crane.plant.type.rows}
    own = [q for q in ("alpha_m", "p_a", "p_b") if q in signals and (q != "alpha_m" or crane.circuits)]
    return [*OF_MOTION, "s_w", "F", *own]


def _sensors(sensors: Sensors, read: Sequence[str], tables: dict[str, Any]) -> Sensors:
    """The sensors of a scenario with these faults besides, and each of these quantities read by one."""
    faults, changed = Sensors(**tables), {}
    for quantity in dict.fromkeys((*read, *tables)):
        own, fault = sensors.errors(quantity), faults.errors(quantity)
        table = TABLES[quantity][0]() if own is None else own
        changed[quantity] = table if fault is None else table.model_copy(update={"faults": fault.faults})
    return sensors.model_copy(update=changed)


def outcome(crane: Crane, healthy: Run, run: Run, time: float, limit: float) -> Outcome:
    """What a fault did to a run, against the run without it; limit as in `survive`."""
    assert run.series is not None
    k = round(time / run.dt)
    wire, at = run.column("s_w")[k:], healthy.column("s_w")[k:]
    moved = float(np.max(np.abs(wire - at)))
    tension = run.column("F_w")[k:]
    pressures = "p_a" in run.signals
    dp = [r.column("p_a")[k:] - r.column("p_b")[k:] for r in (run, healthy)] if pressures else []
    alarm = np.flatnonzero(run.column("guard_alarm")[k:] > 0.0) if "guard_alarm" in run.signals else np.array([])
    last = round(LAST / run.dt)
    rests = float(np.max(np.abs(run.column("v_w")[-last:]))) < AT_REST
    sound = not run.diverged and float(tension.max()) <= tip_capacity(crane) and float(tension.min()) > 0.0
    within = float(wire.min()) >= float(at.min()) - limit and float(wire.max()) <= float(at.max()) + limit
    ended = Verdict.ENDED if sound and rests and within else Verdict.LOST
    return Outcome(
        Verdict.KEPT if sound and moved <= limit else ended,
        moved,
        float(tension.max()),
        float(np.max(np.abs(np.subtract(*dp)))) if dp else math.nan,
        float(alarm[0] * run.dt) if len(alarm) else math.nan,
    )
