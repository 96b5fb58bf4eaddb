"""The frequency-domain method: from seas, through tip, winch and wire, to the motion and tension of the load; thousands
of sea states at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import LiftError
from stillhook.response.forcing import Forcing
from stillhook.response.standard_deviations import Sigmas, sigmas
from stillhook.response.suspended_load import SuspendedLoad
from stillhook.response.winch.describing_function import Residual
from stillhook.sea.vessel.ship_motion import STANDARD_GRAVITY
from stillhook.statistics.gaussian import (
    chance_below_zero,
    most_probable_maximum,
    rate_below_zero,
    share_below_zero,
    zero_crossing_period,
)
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    import xarray


def frequency_response(
    forcing: Forcing,
    load: SuspendedLoad,
    residual: Residual,
    *,
    duration: float = 10800.0,
    names: Sequence[str] | None = None,
) -> xarray.Dataset:
    """Statistics of tip, wire and load in every sea state, compensated and on the brake, as a Dataset over "case".

    Parameters
    ----------
    forcing: the seas at tip and load (`stillhook.response.forcing`).
    load: the suspended load at one depth (`stillhook.response.suspended_load.suspended_load`).
    residual: the tip's motion that remains at the wire's end; `Residual.constant(0.2)` for a compensation of 80 %.
    duration: time for which largest values and chances are calculated [s]. names: labels of the cases.

    Returns
    -------
    Dataset of names of `stillhook.variables`. A missing sea has NaN everywhere; in a calm one nothing moves.

    Valid while the wire stays taut (`slack_share` small), motions are Gaussian, and the payload is in air or completely
    submerged. Drag and winch are linearised at the deviation of the motion itself: seas of resonance against drag,
    and largest values under drag, are approximate (docs/explanation/frequency-domain-method.md shows by how much).
    Errors: LiftError for a duration that is not positive.
    """
    import xarray  # heavy: only where results are labelled

    if not (math.isfinite(duration) and duration > 0.0):
        raise LiftError(f"duration {duration:g} s must be longer than 0 s. Enter the length of the operation.")
    known = np.isfinite(forcing.tip).all(axis=1)
    z, v, a = (forcing.deviation(order) for order in range(3))
    with_winch, braked = (sigmas(forcing, load, winch) for winch in (residual, Residual.constant(1.0)))
    columns = {"sigma_z": z, "sigma_v": v, "sigma_a": a, "T_z": zero_crossing_period(z, v)}
    columns["z_mpm"] = most_probable_maximum(z, columns["T_z"], duration)
    columns["v_mpm"] = most_probable_maximum(v, zero_crossing_period(v, a), duration)
    columns["u_mpm"] = most_probable_maximum(
        with_winch.u, zero_crossing_period(with_winch.u, with_winch.u_rate), duration
    )
    columns |= {
        "sigma_u": with_winch.u,
        "eta_sigma_wire": _less(with_winch.u, z),
        "eta_sigma_load": _less(with_winch.load, z),
    }
    for suffix, s in (("", with_winch), ("_braked", braked)):
        columns |= {f"{name}{suffix}": values for name, values in _of_load(s, load, duration).items()}
    labels = list(names) if names is not None else [str(i) for i in range(len(forcing))]
    data = xarray.Dataset(
        {name: ("case", np.where(known, values, np.nan), _attrs(name)) for name, values in columns.items()},
        coords={"case": labels},
    )
    data.attrs = {
        "residual": residual.about,
        "duration": duration,
        "s_w": load.s_w,
        "F_top": load.F_top,
        "F_sling": load.F_sling,
    }
    return data


def _of_load(s: Sigmas, load: SuspendedLoad, duration: float) -> dict[str, FloatArray]:
    """Statistics of load motion and tensions."""
    pairs = ((s.load, s.load_rate), (s.top, s.top_rate), (s.sling, s.sling_rate))
    T_load, T_top, T_sling = (zero_crossing_period(a, b) for a, b in pairs)
    rate = rate_below_zero(load.F_sling, s.sling, T_sling)
    return {
        "sigma_load": s.load,
        "sigma_v_load": s.load_rate,
        "load_mpm": most_probable_maximum(s.load, T_load, duration),
        "sigma_F_top": s.top,
        "sigma_F_sling": s.sling,
        "F_top_mpm": load.F_top + most_probable_maximum(s.top, T_top, duration),
        "DAF": (load.F_sling + most_probable_maximum(s.sling, T_sling, duration)) / (load.end.m * STANDARD_GRAVITY),
        "slack_share": share_below_zero(load.F_sling, s.sling),
        "slack_rate": rate,
        "slack_chance": chance_below_zero(rate, duration),
    }


def _less(sigma: FloatArray, z: FloatArray) -> FloatArray:
    """1 - sigma/z; NaN where the tip does not move."""
    return 1.0 - np.divide(sigma, z, out=np.full_like(z, np.nan), where=z > 0.0)


def _attrs(name: str) -> dict[str, str]:
    row = BY_NAME[name.removesuffix("_braked")]
    braked = ", with the winch on its brake" if name.endswith("_braked") else ""
    return {"units": row.unit, "long_name": f"{row.meaning}{braked}"}
