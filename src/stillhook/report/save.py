"""Files that commands leave: of a lowering, of a response, of the crane tip's motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.control.supervisor import wire_weight
from stillhook.engine.certificate import twin_line
from stillhook.engine.pack.programme import link_buoyancy, settings
from stillhook.formats.lift_file import LiftFile, describe_phase
from stillhook.formats.results import save_json, save_run
from stillhook.formats.table.cells import remark_of
from stillhook.physics.scalar import G
from stillhook.report import kit
from stillhook.report.kit import draw_if_possible
from stillhook.report.plots.film import MP4, PAGE, Film, save_film
from stillhook.report.plots.moments import strip
from stillhook.report.plots.run import Limits, lowering_panels
from stillhook.report.plots.sea import tip_figure
from stillhook.sea.motion.text import motion_to_json
from stillhook.sea.spectra.spectrum import Sea
from stillhook.sea.vessel.boom import TipPoint
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.realisation import realise, tip_motion, tip_motion_exact
from stillhook.sea.vessel.relative import RelativeMotion
from stillhook.spec.crane import Crane, identity
from stillhook.spec.lift.lowering import Lowering
from stillhook.trust.results import Cranes, result_folder

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure


LOWERING_FILES = ("lowering.png", "strip.png", "lowering.nc", "summary.json")
FILMS = (MP4, PAGE)
"""Names that a film can have."""


def lowering_answer(run: xarray.Dataset, file: LiftFile) -> dict[str, Any]:
    """Numbers of one lowering by their names in `stillhook.variables`, SI; those of each phase that was begun in a
    list."""
    single = {str(name): run[name].item() for name in run.data_vars if run[name].dims == ()}
    notes = single.pop("notes")
    names = [str(name) for name in run.data_vars if run[name].dims == ("phase",)]
    phases: list[dict[str, Any]] = []
    driven = zip(file.lift.programme, file.lift.moves, strict=True)
    words = [(phase.mode.value, describe_phase(phase, move.v)) for phase, move in driven]
    for i, label in enumerate(run["phase"].values):
        row = {name.removeprefix("phase_"): float(run[name][i]) for name in names}
        if not math.isnan(row["t_begin"]):
            mode, text = words[i] if i < len(words) else ("", "joystick at rest, the last controller setting is kept")
            phases.append({"name": str(label), "mode": mode, "described": text, **row})
    head = {"lift": file.lift.name, "crane": file.crane.name, "payload": file.lift.payload.name, "place": file.place}
    status = {"twin": twin_line(file.crane), "status": single.pop("status")}
    return {**head, **status, **single, "notes": [*file.notes, *(notes.split("; ") if notes else [])], "phases": phases}


def static_tension(run: xarray.Dataset, crane: Crane, lift: Lowering) -> FloatArray:
    """Tension at the crane tip with everything at rest at the wetness and wire out of each moment, the load hanging
    free [N]."""
    s = settings(crane, lift)
    h = np.clip(run["eta"].values - run["z_load"].values, 0.0, lift.payload.reach(lift.rho))
    hook = (lift.payload.mass - lift.rho * lift.payload.at(h, lift.rho).V + crane.hook_mass + lift.link_mass) * G
    hook -= np.array([link_buoyancy(lift, float(z)) for z in (run["z_load"] - run["eta"]).values])
    return np.asarray(hook + np.array([wire_weight(float(x), s) for x in run["s_w"].values]))


def lowering_figures(run: xarray.Dataset, crane: Crane, lift: Lowering, title: str) -> dict[str, Figure]:
    """The figures of a lowering by the names of their files: over time, and its moments to scale."""
    p_relief = crane.active.relief.p if "active" in crane.circuits else None
    limits = Limits(crane.SWL * G + crane.hook_mass * G, p_relief)
    panels, moments, *_ = LOWERING_FILES
    return {
        panels: lowering_panels(run, lift, static_tension(run, crane, lift), limits, title=title),
        moments: strip(run, lift, title=lift.name),
    }


def write_lowering(
    out: Path, run: xarray.Dataset, file: LiftFile, answer: dict[str, Any], *, film: Mapping[str, xarray.Dataset]
) -> tuple[str, ...]:
    """Write the files of a lowering; all of them or none. Gives their names.

    film: runs of this lift that are filmed side by side, by their controllers; none: no film.
    """
    crane, lift = file.crane, file.lift
    title = f"{lift.name}: {crane.name}, {file.place}"
    _, _, series, numbers = LOWERING_FILES
    with result_folder(out, "lowering", [identity(crane)]) as part:
        figures = draw_if_possible(lambda: lowering_figures(run, crane, lift, title))
        for name, figure in figures.items():
            kit.save(figure, part / name)
        save_run(run, part / series)
        save_json(answer, part / numbers)
        filmed = (save_film(Film(film, file, lift.name), part).name,) if film else ()
    return (*figures, series, numbers, *filmed)


RESPONSE_FILES = ("response.png", "response.nc", "summary.json")


def write_response(
    out: Path, data: xarray.Dataset, answer: dict[str, Any], draw: Callable[[], Figure], cranes: Cranes
) -> tuple[str, ...]:
    """Write the files of a response, all of them or none. Gives their names."""
    picture, numbers, summary = RESPONSE_FILES
    with result_folder(out, "response", cranes) as part:
        figures = draw_if_possible(lambda: {picture: draw()})
        for name, figure in figures.items():
            kit.save(figure, part / name)
        save_run(data, part / numbers)
        save_json(answer, part / summary)
    return (*figures, numbers, summary)


CSV_STEP = 0.1  # s


def write_tip(
    out: Path,
    names: tuple[str, ...],
    rao: Rao,
    sea: Sea,
    at: TipPoint,
    summary: dict[str, Any],
    *,
    seed: int,
    exact: bool = False,
    amplitudes: str = "fixed",
    against: RelativeMotion | None = None,
) -> dict[str, Any]:
    """Picture, series as exact motion (JSON, which runs read) and as table (CSV), summary, together or not at all.

    exact: with the ship's rotations in full, for which the tip's height is needed. amplitudes: as `realise` takes them.
    against: a second column of the table, the tip's height over the deck of another vessel in the same waves.
    Returns the facts of the series: seed, repeat [s] and the largest of height, speed and acceleration [SI].
    """
    waves = realise(sea, summary["duration"], seed, amplitudes=amplitudes)
    motion = tip_motion(waves, rao, at.x, at.y) if not exact else tip_motion_exact(waves, rao, at.x, at.y, at.z or 0.0)
    t = np.arange(0.0, motion.repeat, CSV_STEP)
    s, v, a = motion.sample(t)
    series = {
        "seed": seed,
        "repeat": motion.repeat,
        "report": motion.report,
        **{f"{n}_max": float(np.abs(x).max()) for n, x in (("z", s), ("v", v), ("a", a))},
    }
    picture, harmonics, table, numbers = names
    with result_folder(out, "motion of the crane tip") as part:
        for name, figure in draw_if_possible(lambda: {picture: tip_figure(rao, sea, at, summary, motion)}).items():
            kit.save(figure, part / name)
        (part / harmonics).write_text(motion_to_json(motion) + "\n", encoding="utf-8")
        columns, head = [s], "time [s],tip [m]"
        if against is not None:
            columns.append(tip_motion(waves, against, at.x, at.y).sample(t)[0])
            head += ",tip over deck [m]"
        rows = "".join(f"{x:.1f},{','.join(f'{y:.6f}' for y in ys)}\n" for x, *ys in zip(t, *columns, strict=True))
        (part / table).write_text(
            f"# {remark_of(f'{motion.describe()}. {motion.report}')}\n{head}\n{rows}", encoding="utf-8"
        )
        save_json({**summary, "series": series}, part / numbers)
    return series
