"""Reference results of an export, in the style of the FMI cross-check: inputs, results and options as text."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_file
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.simulate import simulate
from stillhook.export.twin import Export, ExportError
from stillhook.export.twin.ports import MOTION

RELATIVE = 1e-9
"""Part of a signal's largest value within which another compiler's results are the same."""


def write_reference(export: Export, folder: str | Path) -> tuple[Path, ...]:
    """Write NAME_in.csv (motion of the tip), NAME_ref.csv (signals of `stillhook.simulate` on the export's case) and
    NAME_ref.opt. A row holds for the end of a step, `input_time` 0.

    Errors: ExportError for another export than of a whole winch coupled at the tip.
    """
    if (export.contents, export.coupling) != ("plant+controller", "tip"):
        raise ExportError("A reference is that of plant+controller with the coupling tip.")
    case, t_cycle = export.case, export.t_cycle
    if case.modes or case.operator.profile or case.operator.steps:
        raise ExportError("A reference is of a case in one mode and without an operator. Leave them out.")
    run = simulate(export.crane, case, every=f"{t_cycle!r} s", series=True)
    t = np.asarray(run["time"].values)
    drive = CycleInputs(export.crane, case)
    tip = np.array([drive.full_row(k)[:3] for k in range(len(t))])
    outputs = [p.name for p in export.ports if p.causality == "output"]
    names = [name for name in outputs if name in run and run[name].dims == ("time",)]
    base = Path(folder) / export.identifier
    files = tuple(base.with_name(f"{base.name}_{end}") for end in ("in.csv", "ref.csv", "ref.opt"))
    with atomic_file(files[0]) as one, atomic_file(files[1]) as two, atomic_file(files[2]) as three:
        one.write_text(csv(t, MOTION, tip), encoding="utf-8")
        two.write_text(csv(t, names, np.column_stack([run[n].values for n in names])), encoding="utf-8")
        times = f"StartTime, 0.0\nStopTime, {float(t[-1])!r}\nStepSize, {t_cycle!r}\n"
        three.write_text(f"{times}RelTol, {RELATIVE!r}\n", encoding="utf-8")
    return files


def csv(t: FloatArray, names: object, values: FloatArray) -> str:
    """A table with its times; numbers read back to the same doubles."""
    head = ",".join(f'"{name}"' for name in ["time", *names])  # type: ignore[misc]
    rows = (",".join(repr(float(x)) for x in (time, *row)) for time, row in zip(t, values, strict=True))
    return "\n".join([head, *rows]) + "\n"
