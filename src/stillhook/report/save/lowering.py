"""Files of a lowering: pictures, series, summary; and its numbers as a table of stages."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.atomic import atomic_folder
from stillhook.control.supervisor import wire_weight
from stillhook.engine.pack.programme import settings
from stillhook.engine.validity import twin_line
from stillhook.formats.lift.file import LiftFile, describe_stage
from stillhook.formats.results import save_json, save_run
from stillhook.physics.scalar import G
from stillhook.report.plots.lowering import Limits, lowering_panels, save_animation, strip
from stillhook.report.plots.run import save_figure
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering

if TYPE_CHECKING:
    import xarray

LOWERING_FILES = ("lowering.png", "strip.png", "lowering.nc", "summary.json")
ANIMATION = "lowering.gif"


def lowering_answer(run: xarray.Dataset, file: LiftFile) -> dict[str, Any]:
    """Numbers of one lowering by their names in `stillhook.variables`, SI; those of each stage that was begun in a
    list."""
    single = {str(name): run[name].item() for name in run.data_vars if run[name].dims == ()}
    notes = single.pop("notes")
    names = [str(name) for name in run.data_vars if run[name].dims == ("stage",)]
    stages: list[dict[str, Any]] = []
    for i, label in enumerate(run["stage"].values):
        row = {name.removeprefix("stage_"): float(run[name][i]) for name in names}
        if not math.isnan(row["t_begin"]):
            stage = file.lift.programme[i] if i < len(file.lift.programme) else None
            text = "joystick at rest, the last law goes on" if stage is None else describe_stage(stage)
            stages.append(
                {"name": str(label), "mode": "" if stage is None else stage.mode.value, "described": text, **row}
            )
    head = {"lift": file.lift.name, "crane": file.crane.name, "payload": file.lift.payload.name, "place": file.place}
    status = {"twin": twin_line(file.crane), "status": single.pop("status")}
    return {**head, **status, **single, "notes": [*file.notes, *(notes.split("; ") if notes else [])], "stages": stages}


def static_tension(run: xarray.Dataset, crane: Crane, lift: Lowering) -> NDArray[np.float64]:
    """Tension at the crane tip with everything at rest at the wetness and wire out of each moment, the load hanging
    free [N]."""
    s = settings(crane, lift)
    h = np.clip(run["eta"].values - run["z_load"].values, 0.0, lift.payload.reach(lift.rho))
    hook = (lift.payload.mass - lift.rho * lift.payload.at(h, lift.rho).V + crane.hook_mass) * G
    return np.asarray(hook + np.array([wire_weight(float(x), s) for x in run["s_w"].values]))


def write_lowering(
    out: Path, run: xarray.Dataset, file: LiftFile, answer: dict[str, Any], *, animation: bool
) -> tuple[str, ...]:
    """Write the files of a lowering; all of them or none. Gives their names."""
    crane, lift = file.crane, file.lift
    title = f"{lift.name}: {crane.name}, {file.place}"
    p_relief = crane.active.relief.p if "active" in crane.circuits else None
    limits = Limits(crane.SWL * G + crane.hook_mass * G, p_relief)
    with atomic_folder(out) as part:
        save_figure(
            lowering_panels(run, lift, static_tension(run, crane, lift), limits, title=title), part / LOWERING_FILES[0]
        )
        save_figure(strip(run, lift, title=lift.name), part / LOWERING_FILES[1])
        save_run(run, part / LOWERING_FILES[2])
        save_json(answer, part / LOWERING_FILES[3])
        if animation:
            save_animation(run, lift, part / ANIMATION, title=lift.name)
    return (*LOWERING_FILES, ANIMATION) if animation else LOWERING_FILES
