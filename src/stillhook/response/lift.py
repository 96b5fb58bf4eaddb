"""The frequency-domain method for a lift file: from one sea, or a year of them, to motion and tension of the suspended
load at one depth.

Results of a response: numbers by their names, of one sea, or of records as a summary and one by one.
"""

from __future__ import annotations

import functools
import math
import warnings
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray, fill
from stillhook.base.progress import Progress, begin
from stillhook.errors import LiftError
from stillhook.formats.lift_file import LiftFile
from stillhook.response.forcing import (
    Forcing,
    filtered_forcing,
    forcing_of_directional,
    forcing_of_seas,
    forcing_of_series,
    forcing_of_states,
)
from stillhook.response.frequency_domain import attributes_of, compensated_sigmas, frequency_response
from stillhook.response.suspended_load import SuspendedLoad, answers, natural_periods, suspended_load
from stillhook.response.winch.identify import Steps, identify_residual
from stillhook.response.winch.linear_form import Residual, neighbours
from stillhook.sea.spectra.directions import parse_direction
from stillhook.sea.spectra.measured import SeaStates, SpectrumSeries
from stillhook.sea.spectra.spectrum import Sea
from stillhook.sea.vessel.rao import VerticalMotion
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.phase import WinchMode
from stillhook.spec.scenario import Mode, mode_of
from stillhook.tables.plausible import implausible_values, marked
from stillhook.units import parse, show

if TYPE_CHECKING:
    import xarray


ABOVE_SEABED = 20.0
"""Height of the payload above the seabed where the programme compensates at no depth [m]."""
LIKELY = 0.1
"""Chance of slack slings over the duration above which they count as likely: 90 % of such operations remain free of
slack."""
WAVES = 400
"""Number of heights that represent an irregular motion."""
PERIODS = 3
"""Number of natural periods that are reported."""
FLAGS = ("saturated", "slack", "overload")
"""Exceedances in a sea: of the winch, the slings, the load."""


@dataclass(frozen=True, init=False)
class Waves:
    """One sea, or many with a direction: beta of travel from the bow, or ship, where the bow points from north; spread
    exponent of cos^n. A `Sea` contains its directions.

    Parameters: of the waves; beta, ship texts such as "180 deg" (`from_si` takes radians); held as rad.
    Errors: UnitError for a direction without its unit, SeaError for one outside 0 to 360 deg.
    """

    of: Sea | SpectrumSeries | SeaStates
    beta: float | None
    ship: float | None
    spread: float | None

    def __init__(
        self,
        of: Sea | SpectrumSeries | SeaStates,
        beta: str | None = None,
        ship: str | None = None,
        spread: float | None = None,
    ) -> None:
        texts = {"beta": beta, "ship": ship}
        fill(self, of=of, spread=spread, **{n: None if t is None else parse_direction(t, n) for n, t in texts.items()})

    @classmethod
    def from_si(
        cls,
        of: Sea | SpectrumSeries | SeaStates,
        *,
        beta: float | None = None,
        ship: float | None = None,
        spread: float | None = None,
    ) -> Self:
        """Waves with directions in rad."""
        waves = cls.__new__(cls)
        fill(waves, of=of, beta=beta, ship=ship, spread=spread)
        return waves

    def with_waves(self, of: Sea | SpectrumSeries | SeaStates) -> Self:
        """Other waves with the same directions."""
        return type(self).from_si(of, beta=self.beta, ship=self.ship, spread=self.spread)

    def describe(self) -> str:
        """The waves in words."""
        if isinstance(self.of, Sea):
            return self.of.describe()
        if self.beta is not None:
            where = f"travelling {math.degrees(self.beta):.4g} deg from the bow"
        else:
            where = f"ship heading {math.degrees(self.ship or 0.0):.4g} deg from north"
        short = "" if self.spread is None else f", cos^{self.spread:g}"
        return f"{self.of.source}, {where}{short}"


@dataclass(frozen=True, eq=False)
class LiftResponse:
    """Response of a lift to waves.

    data: the Dataset of `stillhook.response.frequency_domain` over "case" (one sea) or "time" (records), with H_m0,
    T_p, T_m02, saturation_share and the flags of `FLAGS`.
    """

    data: xarray.Dataset = field(repr=False)
    forcing: Forcing = field(repr=False)  # by the waves
    load: SuspendedLoad = field(repr=False)
    residual: Residual = field(repr=False)  # of the winch
    T_wire: FloatArray  # natural periods, top held [s]
    depth: float  # of the payload's underside below still water; negative: above [m]
    mode: Mode  # of the winch


def compensated_depth(lift: Lowering) -> float:
    """Deepest depth of the underside at which a phase compensates (AHC), by the programme as planned.

    Parameters
    ----------
    lift : Lowering
        The lift.

    Returns
    -------
    float
        Depth below still water [m]; where no phase defines one, that of the seabed less 20 m.
    """
    moves = zip(lift.programme, lift.moves, strict=True)
    ends = [x for phase, move in moves if phase.mode is WinchMode.AHC for x in (move.start, move.end)]
    deepest = max((x for x in ends if not math.isnan(x)), default=-math.inf)
    return deepest if math.isfinite(deepest) and deepest < lift.depth else lift.depth - ABOVE_SEABED


def lift_response(
    file: LiftFile,
    waves: Waves,
    *,
    depth: str | None = None,
    mode: Mode | str | None = None,
    duration: str = "3 h",
    progress: Progress | None = None,
    z: str | None = None,
) -> LiftResponse:
    """Statistics of tip, wire and load of a lift in every sea.

    Parameters
    ----------
    file : LiftFile
        The lift, see `stillhook.load_lift`.
    waves : Waves
        One sea, or many.
    depth : str, optional
        Depth of the payload's underside below still water ("1500 m"; negative: above); default `compensated_depth`.
    mode : Mode or str, optional
        How the winch compensates; default the lift's controller.
    duration : str, default "3 h"
        Of largest values and chances.
    progress : callable, optional
        Called while the winch is simulated, and not where the result is on disk.
    z : str, optional
        Height of the underside, the depth of version 0.10 with its sign turned; in place of `depth`.

    Returns
    -------
    LiftResponse
        Dataset of the statistics [SI], and what it was made from.

    Raises
    ------
    StillhookError
        One line: a quantity without its unit, no vessel or tip, an impossible depth or tension, waves without a
        direction.

    Notes
    -----
    Validity: see `stillhook.response.frequency_domain` and `stillhook.response.suspended_load`.
    """
    lasts = parse(duration, "time", "duration")
    if z is not None:
        warnings.warn("lift_response: z is depth, positive downwards, from this version on.", FutureWarning, 2)
        below = -parse(z, "length", "z")
    else:
        below = compensated_depth(file.lift) if depth is None else parse(depth, "length", "depth")
    check_place(file)
    assert file.vessel is not None
    assert file.at is not None
    mode = file.lift.controller if mode is None else mode_of(mode)
    if not mode.compensates:
        others = ", ".join(m.value for m in Mode if m.compensates)
        raise LiftError(
            f"mode manual does not compensate; the brake is reported with every other mode. Choose {others}."
        )
    if below > file.lift.depth:
        water = show(file.lift.depth, "length")
        raise LiftError(f"depth {show(below, 'length')}: the water is {water} deep. Choose a smaller depth.")
    load = suspended_load(file.crane, file.lift, -below)
    at = file.at.x, file.at.y
    forcing = filtered_forcing(lambda vessel: forcing_of_waves(waves, vessel, *at), file.vessel, file.unit)
    begin(progress, "winch residual")
    duty = replace(load.duty, sensors=file.lift.sensors)
    residual = identify_residual(file.crane, duty, mode, progress=Steps(progress))
    data = frequency_response(forcing, load, residual, duration=lasts)
    data = _with_flags(_labelled(data, waves), load, residual, file.crane.SWL)
    T_wire = natural_periods(load.rod, load.end, PERIODS)
    return LiftResponse(data, forcing, load, residual, T_wire, below, mode)


def check_place(file: LiftFile) -> None:
    """Refuse a lift without vessel or place of the crane tip. Errors: LiftError."""
    if file.vessel is None or file.at is None:
        missing = "vessel" if file.vessel is None else "place of the crane tip (tip.at, or [boom])"
        raise LiftError(
            f"{missing}: missing. The frequency-domain method requires vessel and tip; a prescribed motion of the tip"
            " is simulated in time only."
        )


def forcing_of_waves(waves: Waves, vessel: VerticalMotion, x: float, y: float) -> Forcing:
    """Forcing by the waves at a crane tip x, y from the vessel's reference point [m], and at the load under it."""
    if isinstance(waves.of, Sea):
        return forcing_of_seas(waves.of, vessel, x, y)
    if isinstance(waves.of, SeaStates):
        return forcing_of_states(waves.of, vessel, x, y, beta=waves.beta, ship=waves.ship, spread=waves.spread)
    if waves.beta is None:
        return forcing_of_directional(waves.of, vessel, x, y, waves.ship or 0.0)
    return forcing_of_series(waves.of, vessel, x, y, waves.beta, spread=waves.spread)


def _labelled(data: xarray.Dataset, waves: Waves) -> xarray.Dataset:
    """The Dataset with the waves added, over time where they are records."""
    columns: dict[str, FloatArray] = {}
    if isinstance(waves.of, Sea):
        dim, trains = "case", waves.of.trains
        columns["H_m0"] = np.array([math.sqrt(sum(train.spectrum.H_m0**2 for train in trains))])
    else:
        dim = "time"
        data = data.drop_vars("case").rename(case=dim).assign_coords(time=waves.of.time.astype("datetime64[ns]"))
        columns |= {name: np.asarray(getattr(waves.of, name)) for name in ("H_m0", "T_p", "T_m02")}
    return data.assign({name: (dim, values, attributes_of(name)) for name, values in columns.items()})


def _with_flags(data: xarray.Dataset, load: SuspendedLoad, residual: Residual, SWL: float) -> xarray.Dataset:
    """The Dataset with flags of the seas in which a limit is exceeded."""
    dim = next(iter(data.sizes))
    v, T_z = data["sigma_v"].values, data["T_z"].values
    flags = {
        "saturated": saturation(residual, data["v_mpm"].values, T_z) > 0.0,
        "slack": data["slack_chance"].values > LIKELY,
        "overload": data["DAF"].values * load.end.m > SWL,
    }
    share = (dim, saturation_share(residual, v, T_z), attributes_of("saturation_share"))
    return data.assign({"saturation_share": share} | {name: (dim, flag) for name, flag in flags.items()})


def saturation(residual: Residual, v: FloatArray, T: FloatArray) -> FloatArray:
    """Share of the time in which the pumps are at their stop under sines of speed amplitudes v [m/s] and periods T
    [s], (n,); NaN where either is unknown."""
    return table_at(residual.omega, residual.v, residual.saturated, v, T)


def saturation_share(residual: Residual, sigma_v: FloatArray, T: FloatArray) -> FloatArray:
    """Share of the time with the pumps at their stop under irregular motions of deviation sigma_v [m/s] and period T
    [s], (n,): waves taken as sines whose heights are Rayleigh distributed. NaN where either is unknown."""
    return share_of_time(residual, residual.saturated, sigma_v, T)


def share_of_time(residual: Residual, table: FloatArray, sigma_v: FloatArray, T: FloatArray) -> FloatArray:
    """As `saturation_share`, of another table (m, k) of shares of time under the sines of a residual."""
    sigma, mean = _rayleigh_means(residual.v.tobytes(), table.tobytes(), len(table))
    return table_at(residual.omega, sigma, mean, sigma_v, T)


@functools.lru_cache(maxsize=64)
def _rayleigh_means(speeds: bytes, table: bytes, rows: int) -> tuple[FloatArray, FloatArray]:
    """Deviations of speed, and means (rows, .) under them of a table over speeds, both float64 as bytes: a phase asks
    for the same ones at each of its places."""
    axis = np.frombuffer(speeds)
    top = axis[-1]
    sigma = np.geomspace(top / 100.0, 2.0 * top, 60)
    chance = (np.arange(WAVES) + 0.5) / WAVES
    v = np.outer(sigma, np.sqrt(-2.0 * np.log(chance)))
    knots = np.concatenate(([0.0], axis))
    mean = np.array([np.interp(v, knots, [0.0, *row]).mean(axis=1) for row in np.frombuffer(table).reshape(rows, -1)])
    return sigma, mean


def table_at(omega: FloatArray, speeds: FloatArray, table: FloatArray, v: FloatArray, T: FloatArray) -> FloatArray:
    """A table over frequency and speed at speeds v and periods T (n,): linear in speed and in log omega, 0 at rest, the
    ends hold."""
    knots = np.concatenate(([0.0], speeds))
    rows = np.array([np.interp(v, knots, [0.0, *row]) for row in table])
    low, high, part = neighbours(np.log(omega), np.log(2.0 * math.pi / np.where(T > 0.0, T, np.nan)))
    each = np.arange(len(v))
    return np.asarray(rows[low, each] + part * (rows[high, each] - rows[low, each]))


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
        "z_load": -response.depth,
        "s_w": response.load.s_w,
        "F_w": response.load.F_top,
        "F_sling": response.load.F_sling,
        "T_wire": [float(T) for T in response.T_wire],
    }
    numbers = [str(name) for name in data.data_vars if name not in FLAGS]
    if "time" not in data.dims:
        exceeded = ", ".join(name for name in FLAGS if bool(data[name][0])) or "ok"
        at = _nested({name: float(data[name][0]) for name in numbers})
        return {**head, "status": marked(exceeded, _doubts(file)), **at, "notes": notes_of(response, file)}
    times = np.datetime_as_string(data["time"].values, unit="s")
    valid = np.isfinite(data["sigma_z"].values)
    head |= {
        "file": waves.of.source,  # type: ignore[union-attr]
        "n_records": len(times),
        "n_valid": int(valid.sum()),
        "n_missing": int((~valid).sum()),
    }
    head |= {"start": f"{times[0]}Z", "end": f"{times[-1]}Z"}
    head |= {f"n_{name}": int(np.count_nonzero(data[name].values & valid)) for name in FLAGS}
    in_sum = {name: _in_sum(name, data[name].values, times, valid) for name in numbers}
    report = head | _nested(in_sum) | {"notes": [*waves.of.notes, *notes_of(response, file)]}  # type: ignore[union-attr]
    if records:
        columns = _nested({name: data[name].values.tolist() for name in numbers})
        flags = {name: [bool(x) for x in data[name].values] for name in FLAGS}
        report["records"] = {"time": [f"{t}Z" for t in times], "valid": valid.tolist()} | columns | flags
    return report


def _nested(values: dict[str, Any]) -> dict[str, Any]:
    """Numbers of the braked winch in a separate table."""
    braked = {name.removesuffix("_braked"): value for name, value in values.items() if name.endswith("_braked")}
    return {name: value for name, value in values.items() if not name.endswith("_braked")} | {"braked": braked}


def _in_sum(name: str, x: FloatArray, times: NDArray[np.str_], valid: NDArray[np.bool_]) -> dict[str, Any]:
    """First, mean, least and largest, and when the worst was."""
    rows = np.flatnonzero(valid & np.isfinite(x))
    if not len(rows):
        return {"first": math.nan, "mean": math.nan, "min": math.nan, "max": math.nan, "worst": ""}
    values = x[rows]
    worst = rows[int(np.argmin(values) if name.startswith("eta_") else np.argmax(values))]
    summary = {"first": values[0], "mean": values.mean(), "min": values.min(), "max": values.max()}
    return {**{key: float(value) for key, value in summary.items()}, "worst": f"{times[worst]}Z"}


def _doubts(file: LiftFile) -> tuple[str, ...]:
    return (*implausible_values(file.crane), *implausible_values(file.lift, "lift"))


def notes_of(response: LiftResponse, file: LiftFile) -> list[str]:
    """Notes on the origin and validity of the numbers."""
    notes = [*_doubts(file), f"winch: {response.residual.about}; identified from runs of the twin"]
    clear, load = file.lift.depth - response.depth, file.lift.payload
    if response.depth > 0.0 and clear < load.height:
        notes.append(f"{show(clear, 'length')} above the seabed: added mass and drag grow there, which is left out")
    return [*notes, *_stroke_notes(response)]


def _stroke_notes(response: LiftResponse) -> list[str]:
    """What holds of a passive heave compensator as long as it does not come to an end of its stroke."""
    link = response.load.link
    if link is None:
        return []
    at = f"{show(link.s, 'length')} of {show(link.s_max, 'length')} of stroke"
    if not link.moves:
        return [f"compensator: the load hangs at {at}: an end stop, and the slings alone are calculated with"]
    most = float(np.nanmax(response.data["s_c_mpm"].values, initial=0.0))
    if most > link.room:
        return [
            f"compensator: the load hangs at {at}, and the rod moves by {show(most, 'length')} (most probable largest):"
            " it comes to an end of its stroke, and the method is linear. Simulate the lowering in time"
        ]
    return [f"compensator: the load hangs at {at}, linear about it"]


def stamped(data: xarray.Dataset, answer: dict[str, Any]) -> xarray.Dataset:
    """The Dataset for a file, with the attributes of the lift."""
    out = data.assign_attrs(
        {name: answer[name] for name in ("lift", "crane", "payload", "place", "mode")} | {"z_load": answer["z_load"]}
    )
    return out.assign({name: out[name].astype("int8") for name in FLAGS})


def spectra(response: LiftResponse) -> dict[str, FloatArray]:
    """Densities of height of the first sea over the forcing's frequencies [m^2 s/rad]: tip, wire's upper end, load on
    the brake, load compensated. The remnant of the winch (its error in addition to C) is in the deviations and not
    in these."""
    f, load = response.forcing, response.load
    sigma_v = float(f.deviation(1)[0])
    densities = {"crane tip": f.tip[0] / f.width}
    for label, residual in (
        ("load, winch on its brake", Residual.constant(1.0)),
        ("load, compensated", response.residual),
    ):
        motion, way = compensated_sigmas(f, load, residual)
        drag = motion.drag[0]
        damped = load if way is None else replace(load, end=replace(load.end, c_s=float(way.c[0])))
        compliance = 0.0 if residual.compliance is None or sigma_v == 0.0 else residual.compliance.at(f.omega, sigma_v)
        C = residual.gaussian(f.omega, sigma_v)
        answer = answers(f.omega, damped, drag, compliance)["load"]
        mixed = 2.0 * (answer.u * C * np.conj(answer.wave) * f.cross[0]).real
        if residual is response.residual:
            densities["wire's upper end, compensated"] = np.abs(C) ** 2 * f.tip[0] / f.width
        densities[label] = (
            np.abs(answer.u * C) ** 2 * f.tip[0] + mixed + np.abs(answer.wave) ** 2 * f.wave[0]
        ) / f.width
    order = ("crane tip", "wire's upper end, compensated", "load, winch on its brake", "load, compensated")
    return {label: densities[label] for label in order}
