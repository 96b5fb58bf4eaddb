"""Synthetic friction tests: the twin runs a campaign of hoist/lower staircases, and its PLC logs them.

Everything that it writes is marked SYNTHETIC. The reference crane behind the logs is stored next to them as a crane
file, for a blind test of the workflow from log to parameters.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.base.atomic import atomic_folder
from stillhook.base.progress import Meter, Progress
from stillhook.engine.simulate import simulate
from stillhook.errors import IdentifyError, SpecError
from stillhook.identify.system_friction.campaign.staircase import (
    CAMPAIGNS,
    Staircase,
    TestPlan,
    outermost_layer,
    staircase,
)
from stillhook.library import changed, crane_toml, load_crane
from stillhook.library.leakage import form_of
from stillhook.logs.synthetic import (
    CAMPAIGN_FILE,
    COLUMNS,
    LOG_FOLDER,
    MARK,
    REFERENCE_FILE,
    Instruments,
    Noise,
    Sensors,
    check_campaign_folder,
    log_file,
    logged,
    mapping_lines,
    write_log,
)
from stillhook.spec.crane import Crane, SourceKind
from stillhook.units import parse, quote, show
from stillhook.winches.types import pure_active

LAYER_ROOM = 1e-6
"""Layers by which a wire that stays on its layer may seem to leave it: rounding."""


@dataclass(frozen=True)
class CampaignFiles:
    """What was written: the folder, its campaign file, the logs, and notes about what the tests could not keep to."""

    folder: Path
    campaign: Path
    logs: tuple[Path, ...]
    layer: int
    notes: tuple[str, ...]


def campaign_plan(name: str) -> TestPlan:
    """A published campaign by name. Errors: IdentifyError naming those there are."""
    if name not in CAMPAIGNS:
        raise IdentifyError(f"campaign {quote(name)}: not one of {', '.join(CAMPAIGNS)}.")
    return CAMPAIGNS[name]


def closed_circuit(crane: Crane) -> Crane:
    """The crane as it is for friction tests: all motors and pumps, active and passive, in one closed circuit.

    Source: Moslatt 2020 paper D figure 5 and table 2 (11 motors on the 150 t crane). A pure active crane is returned as
    it is. The line volume grows with the number of motors (assumed), the leak with motors and pumps. Errors: SpecError
    where the motors differ.
    """
    p = crane.circuits.get("passive")
    if p is None:
        return crane
    a = crane.active
    if any(getattr(a.motor, name) != getattr(p.motor, name) for name in ("D_max", "loss", "C_1", "C_2")):
        raise SpecError(
            f'"{crane.name}": active motors {a.motor.type} and passive motors {p.motor.type} differ: they make no one'
            " circuit."
        )
    count = a.motor.count + p.motor.count
    leak_of_motor = a.motor.C_1 + a.motor.C_2 * form_of(a).at.n_m
    pump_leak = max(a.C_leak - a.motor.count * leak_of_motor, 0.0) * (a.pump.D_total + p.pump.D_total) / a.pump.D_total
    tests = "friction tests: active and passive circuit as one closed circuit (Moslatt 2020 paper D figure 5)"
    V = f"{a.line.V * count / a.motor.count!r} m^3"
    return changed(
        crane,
        {
            "name": f"{crane.name}-closed-circuit",
            "title": f"{crane.title}, all motors in one closed circuit for friction tests",
            "plant": _leaf(pure_active.NAME, SourceKind.DERIVED, tests),
            "active": {
                "motor": {"count": _leaf(count, SourceKind.DERIVED, tests)},
                "pump": {"D": _leaf([f"{D!r} m^3/rad" for D in (*a.pump.D, *p.pump.D)], SourceKind.DERIVED, tests)},
                "line": {"V": _leaf(V, SourceKind.ASSUMED, f"{tests}; grows with the motors")},
                "C_leak": _leaf(
                    f"{count * leak_of_motor + pump_leak!r} m^3/s/Pa", SourceKind.DERIVED, f"{tests}; pumps and motors"
                ),
            },
        },
    )


def _leaf(value: Any, kind: SourceKind, source: str) -> dict[str, Any]:
    return {"value": value, "kind": kind.value, "source": source}


def crane_of(plan: TestPlan, reference: Crane | None = None) -> Crane:
    """The crane of a campaign as it is tested; reference: another one that is tested in its place, with its circuits as
    they are at sea.

    Its motors go down to the smallest displacement of the tests. Errors: SpecError, UnitError, IdentifyError of one
    line.
    """
    crane = closed_circuit(load_crane(plan.crane) if reference is None else reference)
    motor = crane.active.motor
    if motor.count != plan.motors:
        raise IdentifyError(
            f'campaign "{plan.name}": {plan.motors} motors, and "{crane.name}" has {motor.count} in one circuit.'
        )
    least = min(t.D_m for t in plan.tests) / motor.D_max
    if least >= motor.alpha_min:
        return crane
    leaf = _leaf(least, SourceKind.ASSUMED, "smallest displacement of the friction tests")
    return changed(crane, {"active": {"motor": {"alpha_min": leaf}}})


def write_campaign(
    plan: TestPlan,
    out: str | Path,
    *,
    instruments: Instruments | None = None,
    duration: str = "20 min",
    reference: Crane | None = None,
    layer: int | None = None,
    parquet: bool = False,
    threads: int = 2,
    progress: Progress | None = None,
) -> CampaignFiles:
    """Simulate the tests of a campaign and write what the PLC logs: `campaign.toml`, `logs/*.csv` and `reference.toml`.

    Parameters
    ----------
    plan: which tests on which crane, see `CAMPAIGNS`. out: folder, without a campaign in it yet.
    instruments: sensors (default: typical noise, seed 0). duration: of each test.
    reference: the crane that is really tested, for a blind test: the campaign file names the plan's crane all the same.
    Make it with `stillhook.library.changed` or `stillhook.identify.system_friction.fitting.uncertainty.crane_with`.
    layer: layer of wire to work on (default: the outermost that the pressures allow). parquet: logs as Parquet instead
    of CSV.

    Returns what was written, with notes. Errors: IdentifyError, SpecError, SimulationError, one line; nothing is left
    half-written.
    """
    folder, instruments, length = Path(out), instruments or Instruments(), parse(duration, "time", "duration")
    check_campaign_folder(folder)
    crane = crane_of(plan, reference)
    chosen = outermost_layer(crane, plan.tests) if layer is None else layer
    stairs = [staircase(crane, t, layer=chosen if t.layer is None else t.layer, duration=length) for t in plan.tests]
    sensors = instruments.sensors(crane, max(float(s.speeds.max()) for s in stairs))
    files = [log_file(t.name, parquet) for t in plan.tests]
    meter = Meter(len(stairs), progress)
    meter.tell()
    with atomic_folder(folder) as part:
        (part / LOG_FOLDER).mkdir()

        def work(i: int) -> list[str]:
            notes = _write_log(crane, stairs[i], sensors, np.random.default_rng([instruments.seed, i]), part / files[i])
            meter.part(1.0)(1.0)
            return notes

        with ThreadPoolExecutor(threads) as pool:
            notes = [
                f'test "{plan.tests[i].name}": {note}'
                for i, log in enumerate(pool.map(work, range(len(stairs))))
                for note in log
            ]
        text = f"# {MARK}. The crane that made the logs.\n{crane_toml(crane)}"
        (part / REFERENCE_FILE).write_text(text, encoding="utf-8")
        text = campaign_text(plan, stairs, files, noise=instruments.noise, sensors=sensors)
        (part / CAMPAIGN_FILE).write_text(text, encoding="utf-8")
    return CampaignFiles(folder, folder / CAMPAIGN_FILE, tuple(folder / f for f in files), chosen, tuple(notes))


def _write_log(crane: Crane, stairs: Staircase, sensors: Sensors, rng: np.random.Generator, path: Path) -> list[str]:
    """Simulate one test and write its log; returns what it could not keep to."""
    t_cycle = crane.control.t_cycle
    run = simulate(crane, stairs.case, every=f"{t_cycle!r} s", threads=1)
    signals = {c.name: logged(run[c.name].values, sensors[c.name], t_cycle, rng) for c in COLUMNS}
    write_log(path, np.round(run["time"].values, 9), signals, COLUMNS, sensors)
    return [*stairs.notes, *_limits(run, stairs)]


def _limits(run: Any, stairs: Staircase) -> list[str]:
    """Limits that the test went beyond."""
    notes, status = [], str(run["status"].item())
    layers = np.ceil(run["layer"].values - LAYER_ROOM)
    if np.any(layers != stairs.layer):
        notes.append(f"the wire went from layer {layers.max():.0f} to layer {layers.min():.0f}")
    if status != "ok":
        notes.append(f"went beyond limits: {status}")
    return notes


def campaign_text(plan: TestPlan, stairs: list[Staircase], files: list[str], *, noise: Noise, sensors: Sensors) -> str:
    """The campaign file: crane, signals, tests, as the reader of measured campaigns takes it."""
    crane = load_crane(plan.crane)
    lines = [
        f"# {MARK} (noise: {noise.value}). Plan: {plan.source}.",
        f'title = "SYNTHETIC {plan.title}"',
        f'crane = "{plan.crane}"',
        f"motors = {plan.motors}",
        f'motor = "{crane.active.motor.type}"',
        "",
        "[signals]",
        *mapping_lines(COLUMNS, sensors),
    ]
    for test, stair, file in zip(plan.tests, stairs, files, strict=True):
        lines += [
            "",
            "[[test]]",
            f'name = "{test.name}"',
            f'log = "{file}"',
            f'D_m = "{show(stair.D_m, "displacement", 12)}"',
            f'load = "{show(test.load, "mass", 12)}"',
            f"layer = {stair.layer}",
            f"hold_out = {str(test.hold_out).lower()}",
        ]
    return "\n".join(lines) + "\n"
