"""What a response is told in: numbers by their names, of one sea, or of records in sum and one by one."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.formats.lift.file import LiftFile
from stillhook.kernels.cache import cache_root
from stillhook.response.lift import FLAGS, LiftResponse, Waves
from stillhook.response.linear_drag import answers
from stillhook.response.standard_deviations import sigmas
from stillhook.response.winch.describing_function import Residual
from stillhook.spec.plausible import implausible_values, marked
from stillhook.units import show

if TYPE_CHECKING:
    import xarray


def residuals_folder() -> Path:
    """Where residuals of winches are kept."""
    return cache_root() / "residuals"


def answer_of(found: LiftResponse, file: LiftFile, waves: Waves, *, records: bool = True) -> dict[str, Any]:
    """Numbers of a response by their names in `stillhook.variables`, SI: of one sea as they are; of records in sum, and
    one by one unless not `records`. Those of a braked winch under "braked"."""
    data, lift = found.data, file.lift
    head: dict[str, Any] = {
        "lift": lift.name,
        "crane": file.crane.name,
        "payload": lift.payload.name,
        "place": f"{file.place}, in {waves.describe()}",
        "mode": found.mode.value,
        "duration": data.attrs["duration"],
        "z_load": found.z,
        "s_w": found.hung.s_w,
        "F_w": found.hung.F_top,
        "F_sling": found.hung.F_sling,
        "T_wire": [float(T) for T in found.T_wire],
    }
    numbers = [str(name) for name in data.data_vars if name not in FLAGS]
    if "time" not in data.dims:
        at = {name: float(data[name][0]) for name in numbers}
        return (
            head | {"status": marked(status_of(data), _doubts(file))} | _nested(at) | {"notes": notes_of(found, file)}
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
    told = head | _nested(in_sum) | {"notes": [*waves.of.notes, *notes_of(found, file)]}  # type: ignore[union-attr]
    if records:
        columns = _nested({name: data[name].values.tolist() for name in numbers})
        flags = {name: [bool(x) for x in data[name].values] for name in FLAGS}
        told["records"] = {"time": [f"{t}Z" for t in times], "valid": known.tolist()} | columns | flags
    return told


def _nested(values: dict[str, Any]) -> dict[str, Any]:
    """Numbers of the braked winch in a table of their own."""
    braked = {name.removesuffix("_braked"): value for name, value in values.items() if name.endswith("_braked")}
    return {name: value for name, value in values.items() if not name.endswith("_braked")} | {"braked": braked}


def _in_sum(name: str, x: FloatArray, times: NDArray[np.str_], known: NDArray[np.bool_]) -> dict[str, Any]:
    """First, mean, least and largest, and when the worst was."""
    rows = np.flatnonzero(known & np.isfinite(x))
    if not len(rows):
        return {"first": math.nan, "mean": math.nan, "min": math.nan, "max": math.nan, "worst": ""}
    values = x[rows]
    worst = rows[int(np.argmin(values) if name.startswith("eta_") else np.argmax(values))]
    whole = {
        "first": float(values[0]),
        "mean": float(values.mean()),
        "min": float(values.min()),
        "max": float(values.max()),
    }
    return whole | {"worst": f"{times[worst]}Z"}


def status_of(data: xarray.Dataset) -> str:
    """ "ok", or what goes beyond its limit in the first sea, joined by commas."""
    return ", ".join(name for name in FLAGS if bool(data[name][0])) or "ok"


def _doubts(file: LiftFile) -> tuple[str, ...]:
    return (*implausible_values(file.crane), *implausible_values(file.lift, "lift"))


def notes_of(found: LiftResponse, file: LiftFile) -> list[str]:
    """What there is to say of how the numbers came about."""
    how = "made now from runs of the twin" if found.made else "found on disk"
    notes = [*_doubts(file), f"winch: {found.residual.about}; {how}, kept in {residuals_folder()}"]
    clear, load = file.lift.depth + found.z, file.lift.payload
    if found.z < 0.0 and clear < load.height:
        notes.append(f"{show(clear, 'length')} above the seabed: added mass and drag grow there, which is left out")
    return notes


def stamped(data: xarray.Dataset, answer: dict[str, Any]) -> xarray.Dataset:
    """The Dataset for a file, with what it is of."""
    out = data.assign_attrs(
        {name: answer[name] for name in ("lift", "crane", "payload", "place", "mode")} | {"z_load": answer["z_load"]}
    )
    return out.assign({name: out[name].astype("int8") for name in FLAGS})


def spectra(found: LiftResponse) -> dict[str, FloatArray]:
    """Densities of height of the first sea over the forcing's frequencies [m^2 s/rad]: tip, wire's upper end, load on
    the brake, load compensated. What the winch leaves beside C (the remnant) is in the deviations and not in these."""
    f, what = found.forcing, found.hung
    sigma_v = float(f.deviation(1)[0])
    densities = {"crane tip": f.tip[0] / f.width}
    for label, residual in (
        ("load, winch on its brake", Residual.constant(1.0)),
        ("load, compensated", found.residual),
    ):
        drag = sigmas(f, what, residual).drag[0]
        give = 0.0 if residual.give is None or sigma_v == 0.0 else residual.give.at(f.omega, sigma_v)
        C = residual.gaussian(f.omega, sigma_v)
        load = answers(f.omega, what, drag, give)["load"]
        mixed = 2.0 * (load.u * C * np.conj(load.wave) * f.cross[0]).real
        if residual is found.residual:
            densities["wire's upper end, compensated"] = np.abs(C) ** 2 * f.tip[0] / f.width
        densities[label] = (np.abs(load.u * C) ** 2 * f.tip[0] + mixed + np.abs(load.wave) ** 2 * f.wave[0]) / f.width
    order = ("crane tip", "wire's upper end, compensated", "load, winch on its brake", "load, compensated")
    return {label: densities[label] for label in order}
