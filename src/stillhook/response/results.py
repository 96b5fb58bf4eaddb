"""Results of a response: numbers by their names, of one sea, or of records as a summary and one by one."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.formats.lift_file import LiftFile
from stillhook.kernels.cache import cache_root
from stillhook.response.frequency_domain import sigmas
from stillhook.response.lift import FLAGS, LiftResponse, Waves
from stillhook.response.suspended_load import answers
from stillhook.response.winch.linear_form import Residual
from stillhook.tables.plausible import implausible_values, marked
from stillhook.units import show

if TYPE_CHECKING:
    import xarray


def residuals_folder() -> Path:
    """Folder of the residuals of winches."""
    return cache_root() / "residuals"


def answer_of(response: LiftResponse, file: LiftFile, waves: Waves, *, records: bool = True) -> dict[str, Any]:
    """Numbers of a response by their names in `stillhook.variables`, SI: of one sea as they are; of records as a
    summary, and one by one unless not `records`. Those of a braked winch under "braked"."""
    data, lift = response.data, file.lift
    head: dict[str, Any] = {
        "lift": lift.name,
        "crane": file.crane.name,
        "payload": lift.payload.name,
        "place": f"{file.place}, in {waves.describe()}",
        "mode": response.mode.value,
        "duration": data.attrs["duration"],
        "z_load": response.z,
        "s_w": response.load.s_w,
        "F_w": response.load.F_top,
        "F_sling": response.load.F_sling,
        "T_wire": [float(T) for T in response.T_wire],
    }
    numbers = [str(name) for name in data.data_vars if name not in FLAGS]
    if "time" not in data.dims:
        at = {name: float(data[name][0]) for name in numbers}
        return (
            head
            | {"status": marked(status_of(data), _doubts(file))}
            | _nested(at)
            | {"notes": notes_of(response, file)}
        )
    times = np.datetime_as_string(data["time"].values, unit="s")
    known = np.isfinite(data["sigma_z"].values)
    head |= {
        "file": waves.of.source,  # type: ignore[union-attr]
        "n_records": len(times),
        "n_valid": int(known.sum()),
        "n_missing": int((~known).sum()),
    }
    head |= {"start": f"{times[0]}Z", "end": f"{times[-1]}Z"}
    head |= {f"n_{name}": int(np.count_nonzero(data[name].values & known)) for name in FLAGS}
    in_sum = {name: _in_sum(name, data[name].values, times, known) for name in numbers}
    report = head | _nested(in_sum) | {"notes": [*waves.of.notes, *notes_of(response, file)]}  # type: ignore[union-attr]
    if records:
        columns = _nested({name: data[name].values.tolist() for name in numbers})
        flags = {name: [bool(x) for x in data[name].values] for name in FLAGS}
        report["records"] = {"time": [f"{t}Z" for t in times], "valid": known.tolist()} | columns | flags
    return report


def _nested(values: dict[str, Any]) -> dict[str, Any]:
    """Numbers of the braked winch in a separate table."""
    braked = {name.removesuffix("_braked"): value for name, value in values.items() if name.endswith("_braked")}
    return {name: value for name, value in values.items() if not name.endswith("_braked")} | {"braked": braked}


def _in_sum(name: str, x: FloatArray, times: NDArray[np.str_], known: NDArray[np.bool_]) -> dict[str, Any]:
    """First, mean, least and largest, and when the worst was."""
    rows = np.flatnonzero(known & np.isfinite(x))
    if not len(rows):
        return {"first": math.nan, "mean": math.nan, "min": math.nan, "max": math.nan, "worst": ""}
    values = x[rows]
    worst = rows[int(np.argmin(values) if name.startswith("eta_") else np.argmax(values))]
    summary = {
        "first": float(values[0]),
        "mean": float(values.mean()),
        "min": float(values.min()),
        "max": float(values.max()),
    }
    return summary | {"worst": f"{times[worst]}Z"}


def status_of(data: xarray.Dataset) -> str:
    """ "ok", or the limits exceeded in the first sea, joined by commas."""
    return ", ".join(name for name in FLAGS if bool(data[name][0])) or "ok"


def _doubts(file: LiftFile) -> tuple[str, ...]:
    return (*implausible_values(file.crane), *implausible_values(file.lift, "lift"))


def notes_of(response: LiftResponse, file: LiftFile) -> list[str]:
    """Notes on the origin and validity of the numbers."""
    origin = "identified now from runs of the twin" if response.made else "read from disk"
    notes = [*_doubts(file), f"winch: {response.residual.about}; {origin}, kept in {residuals_folder()}"]
    clear, load = file.lift.depth + response.z, file.lift.payload
    if response.z < 0.0 and clear < load.height:
        notes.append(f"{show(clear, 'length')} above the seabed: added mass and drag grow there, which is left out")
    return notes


def stamped(data: xarray.Dataset, answer: dict[str, Any]) -> xarray.Dataset:
    """The Dataset for a file, with the attributes of the lift."""
    out = data.assign_attrs(
        {name: answer[name] for name in ("lift", "crane", "payload", "place", "mode")} | {"z_load": answer["z_load"]}
    )
    return out.assign({name: out[name].astype("int8") for name in FLAGS})


def spectra(response: LiftResponse) -> dict[str, FloatArray]:
    """Densities of height of the first sea over the forcing's frequencies [m^2 s/rad]: tip, wire's upper end, load on
    the brake, load compensated. The remnant of the winch (its error beside C) is in the deviations and not in these."""
    f, load = response.forcing, response.load
    sigma_v = float(f.deviation(1)[0])
    densities = {"crane tip": f.tip[0] / f.width}
    for label, residual in (
        ("load, winch on its brake", Residual.constant(1.0)),
        ("load, compensated", response.residual),
    ):
        drag = sigmas(f, load, residual).drag[0]
        compliance = 0.0 if residual.compliance is None or sigma_v == 0.0 else residual.compliance.at(f.omega, sigma_v)
        C = residual.gaussian(f.omega, sigma_v)
        answer = answers(f.omega, load, drag, compliance)["load"]
        mixed = 2.0 * (answer.u * C * np.conj(answer.wave) * f.cross[0]).real
        if residual is response.residual:
            densities["wire's upper end, compensated"] = np.abs(C) ** 2 * f.tip[0] / f.width
        densities[label] = (
            np.abs(answer.u * C) ** 2 * f.tip[0] + mixed + np.abs(answer.wave) ** 2 * f.wave[0]
        ) / f.width
    order = ("crane tip", "wire's upper end, compensated", "load, winch on its brake", "load, compensated")
    return {label: densities[label] for label in order}
