"""What a map found, as plain arrays: best classic controller, changes against it, shares, and a Dataset when one is
wanted.

Where on a map a controller can be used, and if not, why: one table of rules, worst first.
"""

from __future__ import annotations

import csv
import functools
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, ParamSpec

import numpy as np
from numpy.typing import NDArray

from stillhook._version import __version__
from stillhook.analysis.axes import Axes
from stillhook.analysis.controllers import Controller
from stillhook.base.arrays import FloatArray
from stillhook.base.gateway.parse import from_json
from stillhook.control.registry import CLASSIC
from stillhook.engine.certificate import twin_line
from stillhook.errors import Cancelled, StillhookError
from stillhook.kernels.build import kernel_hash
from stillhook.library import crane_from_toml, crane_toml
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.tables.plausible import implausible_values
from stillhook.variables import attributes
from stillhook.winches.registry import WINCH_TYPES

if TYPE_CHECKING:
    import xarray


class Shown(NamedTuple):
    """How a value of a map is shown: in words with its unit, factor from SI to that unit, decimals."""

    words: str
    factor: float
    digits: int


BEST_CLASSIC = "best classic"
COMPARED = ("e_c_pp", "p_max", "settling_time")
"""Of which the change against the best classic controller is given, where a map has them; suffix `_change`."""
SHOWN: Mapping[str, Shown] = {
    "e_c_pp": Shown("control error peak-to-peak [mm]", 1e3, 0),
    "eta_c": Shown("compensation efficiency [%]", 1e2, 1),
    "p_max": Shown("peak pressure [bar]", 1e-5, 0),
    "alpha_m_min": Shown("least motor displacement [%]", 1e2, 0),
    "settling_time": Shown("settling time [s]", 1.0, 2),
    "alpha_m_end": Shown("motor displacement after the step [%]", 1e2, 0),
}
"""Values that tables and pictures show, in the order of the pictures."""


@dataclass(frozen=True)
class Map:
    """Arrays of shape (controller, load, speed, layer, period), SI, with one layer or period where the map does not go
    over them.

    labels, modes of the controllers; values by name; status as in a summary; cause why the controller is not
    applicable, "" where it is; better the value by which the best classic controller is chosen, the lower the better;
    about how the map was made.
    """

    crane: Crane
    labels: tuple[str, ...]
    modes: tuple[Mode | None, ...]
    axes: Axes
    values: Mapping[str, FloatArray]
    status: NDArray[Any]
    cause: NDArray[Any]
    better: str
    about: Mapping[str, Any]

    @classmethod
    def of(
        cls,
        crane: Crane,
        controllers: Sequence[Controller],
        axes: Axes,
        names: Iterable[str],
        rows: Sequence[Mapping[str, Any]],
        better: str,
        about: Mapping[str, Any],
    ) -> Map:
        """The map of rows of results, controller by controller, the last axis fastest: the numbers of these names,
        `status` and `cause` of each; with the best classic controller."""

        def column(name: str, kind: Any) -> NDArray[Any]:
            return np.array([row[name] for row in rows], dtype=kind).reshape(len(controllers), *axes.shape)

        return cls(
            crane=crane,
            labels=tuple(c.name for c in controllers),
            modes=tuple(c.mode for c in controllers),
            axes=axes,
            values={name: column(name, np.float64) for name in names},
            status=column("status", object),
            cause=column("cause", object),
            better=better,
            about=about,
        ).with_best_classic()

    @property
    def applicable(self) -> NDArray[np.bool_]:
        """Where each controller can be used."""
        return np.asarray(self.cause == "", dtype=np.bool_)

    @classmethod
    def from_dataset(cls, data: xarray.Dataset) -> Map:
        """The map that `dataset` made a Dataset of. Errors: StillhookError for another Dataset."""
        if not {"cause", "applicable", "status"} <= set(data.data_vars):
            raise StillhookError("a map is needed. Give what operability_map or settling_map returned.")
        full = data.expand_dims([d for d in DIMS if d not in data.dims]).transpose(*DIMS)
        layers = tuple(full["layer"].values.tolist()) if "layer" in data.dims else (None,)
        periods = tuple(full["period"].values.tolist()) if "period" in data.dims else (None,)
        s_w = tuple(np.ravel(data["s_w"].values).tolist())
        labels = tuple(str(label) for label in full["controller"].values)
        modes = {str(mode): mode for mode in Mode}
        return cls(
            crane=crane_from_toml(str(data.attrs["crane"]), "stored crane"),
            labels=labels,
            modes=tuple(None if label == BEST_CLASSIC else modes.get(label) for label in labels),
            axes=Axes(tuple(full["load"].values.tolist()), tuple(full["speed"].values.tolist()), layers, s_w, periods),
            values={
                str(name): x.values
                for name, x in full.data_vars.items()
                if x.dtype.kind == "f" and not str(name).endswith("_change")
            },
            status=full["status"].values.astype(object),
            cause=full["cause"].values.astype(object),
            better=next(name for name in ("e_c_pp", "settling_time") if name in full),
            about=from_json(data.attrs["about"]),
        )

    def with_best_classic(self) -> Map:
        """The map with one more controller, "best classic": cell by cell the applicable one of NS and HS with the lower
        value of `better`, and where neither is applicable the lower of both, with its cause. The same map where neither
        was requested."""
        rows = [i for i, mode in enumerate(self.modes) if mode in CLASSIC]
        if not rows:
            return self
        usable = self.applicable[rows]
        rank = np.where(np.isnan(self.values[self.better][rows]), np.inf, self.values[self.better][rows])
        worst = np.where(usable, rank, np.inf)
        choice = np.where(usable.any(axis=0), worst.argmin(axis=0), rank.argmin(axis=0))[None]

        def joined(a: NDArray[Any]) -> NDArray[Any]:
            return np.concatenate([a, np.take_along_axis(a[rows], choice, axis=0)])

        return replace(
            self,
            labels=(*self.labels, BEST_CLASSIC),
            modes=(*self.modes, None),
            values={name: joined(a) for name, a in self.values.items()},
            status=joined(self.status),
            cause=joined(self.cause),
        )

    def change(self, name: str) -> FloatArray | None:
        """Value over that of the best classic controller, less 1 [-]; NaN where one of the two is not applicable. None
        without one."""
        if BEST_CLASSIC not in self.labels:
            return None
        i, usable, a = self.labels.index(BEST_CLASSIC), self.applicable, self.values[name]
        with np.errstate(invalid="ignore", divide="ignore"):
            part = a / a[i] - 1.0
        return np.where(usable & usable[i] & (a[i] > 0.0), part, np.nan)

    def changes(self) -> dict[str, FloatArray]:
        """Every change there is, by the name of its value."""
        return {name: change for name in COMPARED if name in self.values and (change := self.change(name)) is not None}

    def summary(self) -> dict[str, dict[str, Any]]:
        """Controller -> share of the map in which it is applicable, cells by cause, and the median change against the
        best classic one."""
        out: dict[str, dict[str, Any]] = {}
        changes = self.changes()
        for i, label in enumerate(self.labels):
            cause = self.cause[i].ravel()
            names, counts = np.unique(cause[cause != ""].astype(str), return_counts=True)
            values: dict[str, Any] = {
                "applicable_share": float(np.mean(self.applicable[i])),
                "causes": {str(n): int(k) for n, k in zip(names, counts, strict=True)},
            }
            for name, a in changes.items() if label != BEST_CLASSIC else ():
                values[f"{name}_change_median"] = float(np.nanmedian(a[i])) if np.isfinite(a[i]).any() else float("nan")
            out[label] = values
        return out

    def record(self) -> dict[str, Any]:
        """Everything as plain data in SI, for JSON: nested lists over load, speed, and layer and period where the map
        has them."""
        cells: dict[str, Any] = {}
        unused = tuple(DIMS.index(name) - 1 for name in self.axes.unused)
        changes = self.changes()
        for i, label in enumerate(self.labels):
            columns = {**{n: a[i] for n, a in self.values.items()}, **{f"{n}_change": a[i] for n, a in changes.items()}}
            columns |= {"applicable": self.applicable[i], "cause": self.cause[i], "status": self.status[i]}
            cells[label] = {name: a.squeeze(axis=unused).tolist() for name, a in columns.items()}
        axes: dict[str, Any] = {
            "load": list(self.axes.loads),
            "speed": list(self.axes.speeds),
            "s_w": list(self.axes.s_w),
        }
        axes |= {"layer": list(self.axes.layers), "period": list(self.axes.periods)}
        axes = {name: values for name, values in axes.items() if name not in self.axes.unused}
        who = {"crane": self.crane.name, "twin": twin_line(self.crane), "notes": list(implausible_values(self.crane))}
        return {**who, **self.about, **axes, "controllers": cells, "summary": self.summary()}

    def dataset(self) -> xarray.Dataset:
        """The map as a labelled Dataset; names, units and meaning from `stillhook.variables`."""
        columns = {
            **self.values,
            **{f"{n}_change": a for n, a in self.changes().items()},
            "applicable": self.applicable,
        }
        columns |= {"cause": self.cause.astype(str), "status": self.status.astype(str)}
        labels = {"controller": list(self.labels)}
        fields = {n: (DIMS, a, attributes(n)) for n, a in columns.items()}
        data = over_axes(fields, labels, self.axes, str(self.about["speed_is"]))
        data.attrs = {
            "title": f"Stillhook map of {self.crane.name}",
            "crane": crane_toml(self.crane),
            "twin": twin_line(self.crane),
            "notes": "; ".join(implausible_values(self.crane)),
            "about": json.dumps(dict(self.about)),
            "stillhook_version": __version__,
            "stillhook_kernel": kernel_hash(),
        }
        return data


DIMS = ("controller", "load", "speed", "layer", "period")


def over_axes(fields: dict[str, Any], coords: dict[str, Any], axes: Axes, speed_is: str) -> xarray.Dataset:
    """Fields over `DIMS` as a Dataset with the axes of a map, without the dimensions that it does not go over."""
    import xarray  # heavy: not wanted for a table

    along = {
        "load": ("load", axes.loads, {"units": "kg", "long_name": "payload on the hook"}),
        "speed": ("speed", axes.speeds, {"units": "m/s", "long_name": speed_is}),
        "s_w": ("layer", axes.s_w, {"units": "m", "long_name": "wire paid out at the start"}),
        "layer": ("layer", axes.layers, {"long_name": "layer of wire in use, counted from the bare drum"}),
        "period": ("period", axes.periods, {"units": "s", "long_name": "period of the wave"}),
    }
    coords |= {name: (dim, list(x), attrs) for name, (dim, x, attrs) in along.items() if name not in axes.unused}
    return xarray.Dataset(fields, coords=coords).squeeze(axes.unused)


Arguments = ParamSpec("Arguments")


def as_dataset(run: Callable[Arguments, Map], name: str, doc: str) -> Callable[Arguments, xarray.Dataset]:
    """The same call with its map as a Dataset; name and doc of the new function."""

    @functools.wraps(run)
    def called(*args: Arguments.args, **kwargs: Arguments.kwargs) -> xarray.Dataset:
        try:
            return run(*args, **kwargs).dataset()
        except Cancelled as stopped:
            raise stopped.then(Map.dataset) from None

    called.__name__ = called.__qualname__ = name
    called.__doc__ = doc
    return called


SATURATION_SHARE = 0.1
"""Part of the counted time for which full pumps are tolerated [-]. A sine that is beyond the pumps for a tenth of the
time demands 1.2 % more speed than is available (1 / cos theta, theta = pi/20), and 0.13 % of its stroke is missed (sin
theta - theta cos theta): less than what friction costs."""


class Rule(NamedTuple):
    """A row of `rules.csv`: cause in words; mark of a few letters for tables; limit that is passed, a word of a run's
    status or "load of mode"; reason in words."""

    cause: str
    mark: str
    limit: str
    reason: str


def _rules() -> Iterator[Rule]:
    """The rows of `rules.csv`, with one for each limit that a winch type alone has; its word in the status is its
    mark."""
    with Path(__file__).with_name("rules.csv").open(encoding="utf-8", newline="") as table:
        rows = [Rule(**row) for row in csv.DictReader(table)]
    common = {rule.limit for rule in rows}
    for rule in rows:
        if rule.limit == "saturated":
            for word in dict.fromkeys(word for winch in WINCH_TYPES.values() for word in winch.causes.values()):
                if word not in common:
                    yield Rule(f"{word} limit", word, word, "a limit of this winch type is passed; none is tolerated")
        yield rule


RULES = tuple(_rules())
"""Why a controller is not applicable, worst first; the first that holds is the cause. A standing offset is not a cause:
it shows in e_c_mean, and pure active winches have one by design. Limits without a tolerated time are passed or not:
what they guard does not wait."""
PUMPS, COMMAND = "pumps saturated", "command saturated"
"""The same cause of a closed circuit, and of a drive that takes a speed command."""
MARKS: Mapping[str, str] = {r.cause: r.mark for r in RULES} | {COMMAND: "sat"}


def saturated(crane: Crane) -> str:
    """The cause of a command at its end, in words of the winch type."""
    return PUMPS if crane.circuits else COMMAND


def cause_of(crane: Crane, summary: Mapping[str, Any], mode: Mode, load: float) -> str:
    """Why this controller cannot be used in this cell, or "" where it can.

    Parameters: summary of the cell's run (keys and SI of `stillhook.variables.SUMMARY`); mode of the controller; load
    [kg].
    """
    passed = set(summary["status"].split(", ")) - {"saturated"}
    if summary["saturation_time"] > SATURATION_SHARE * summary["counted_time"]:
        passed.add("saturated")
    if load / crane.SWL > mode.law.swl_share * (1.0 + 1e-9):
        passed.add("load of mode")
    cause = next((rule.cause for rule in RULES if rule.limit in passed), "")
    return saturated(crane) if cause == PUMPS else cause
