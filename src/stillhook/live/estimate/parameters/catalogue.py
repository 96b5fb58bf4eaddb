"""The parameters: balance and column of each, what is wrong with its sensors, and what it may be."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.live.estimate.accuracy import Accuracies
from stillhook.live.estimate.parameters.balances import DELAY, FLOW, GAS
from stillhook.live.estimate.parameters.informed import Nuisance, leak_shapes
from stillhook.statistics.estimate import Estimate
from stillhook.validate.parameters.leak_laws import UNCLOSED

SLIP_TAKEN = 0.5
"""Part of balances.SLIP by which the pumps' drives are taken to slip, and its limit of error [-]: asynchronous ones do,
synchronous ones do not."""

PROVEN = ("pump_delay",)
"""Parameters whose stated interval the trial (docs/validation/adaptation.md) shows to hold, with laws of another form
as well: no other is applied."""
NOT_PROVEN = "its interval is not shown to hold yet (docs/validation/adaptation.md)"

Errors = Callable[[Accuracies], Mapping[str, tuple[str, float]]]


def _nothing(total: FloatArray) -> Mapping[str, Nuisance]:
    return {}


class Parameter(NamedTuple):
    """What is followed, by which balance, and what its steps may be."""

    name: str
    unit: str  # "" for a factor on the crane file's
    balance: str
    columns: tuple[str, ...]  # of the balance
    explained: Mapping[str, float]  # combination of the columns
    by: tuple[str, ...]  # columns that explain it, the parameter's first
    value: Callable[[float], float]  # parameter of the first coefficient
    errors: Errors  # limit of error of what is explained from each source, in a column
    plausible: tuple[float, float]  # least and most that a winch can have
    least: float  # step that raises an alarm
    floor: float  # scatter between half waves that is taken at least
    meaning: str
    cause: str  # of a step
    structural: float = 0.0  # what the form of the law leaves at least
    limited: Callable[[FloatArray], Mapping[str, Nuisance]] = _nothing  # beside them, by the sums of the columns
    open: Mapping[str, float] = {}  # what the balance leaves open whatever the rows say, as a combination
    with_time: tuple[str, ...] = ()  # columns whose coefficient drifts with time,
    with_speed: tuple[str, ...] = ()  # and with the speed of the half wave, across a step

    @property
    def x(self) -> list[int]:
        """Numbers of the columns that explain."""
        return [self.columns.index(name) for name in self.by]

    @property
    def y(self) -> FloatArray:
        """What is explained, as a combination of the columns."""
        return np.array([self.explained.get(name, 0.0) for name in self.columns])

    @property
    def unclosed(self) -> FloatArray:
        """What the balance leaves open, as a combination of the columns."""
        return np.array([self.open.get(name, 0.0) for name in self.columns])

    def unit_of(self, column: str) -> FloatArray:
        """A column as a combination of the columns."""
        return np.array([float(name == column) for name in self.columns])

    def around(self, b: float, half: float, n: int, structural: float = 0.0) -> Estimate:
        """The parameter whose coefficient is b, with half of its interval."""
        slope = abs(self.value(b + 1e-6) - self.value(b - 1e-6)) / 2e-6
        return Estimate.around(self.value(b), slope * half, n, slope * structural)

    def rise(self, before: float, after: float) -> float:
        """Change of the parameter between two coefficients: of a factor over what it was."""
        old, new = self.value(before), self.value(after)
        return new - old if self.unit else new / old - 1.0


def _same(b: float) -> float:
    return b


def _inverse(b: float) -> float:
    return 1.0 / b if b != 0.0 else np.inf


def _later(b: float) -> float:
    return -b


_OIL = {"pumps": 1.0, "storage": -1.0, "slip": -SLIP_TAKEN, "motors": -1.0}


def _of_pumps(a: Accuracies) -> dict[str, tuple[str, float]]:
    return {"D_p": ("pumps", a.D_p), "C_h": ("storage", a.C_h)}


def _leakage_nuisances(total: FloatArray) -> Mapping[str, Nuisance]:
    """Slip of the pumps' drives, and shapes of the leakage."""
    slip = np.array([float(name == "slip") for name in FLOW])
    return {"slip": Nuisance(slip, SLIP_TAKEN), **leak_shapes(total)}


def _delay(name: str, least: float, what: str) -> Parameter:
    return Parameter(
        name=name,
        unit="s",
        balance=name,
        columns=DELAY,
        explained={"reading": 1.0},
        by=("rate", "setting", "one"),
        value=_later,
        errors=lambda a: {},
        plausible=(-0.05, 0.5),
        least=least,
        floor=0.1 * least,
        structural=0.1 * least,
        meaning=f"delay of the {what} behind their command, over the crane file's control",
        cause=f"control of the {what}: pilot pressure, filter, cold oil, or the cycle of the PLC",
    )


PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        name="leakage",
        unit="",
        balance="flow",
        columns=FLOW,
        explained=_OIL,
        by=("leak", "full", "rate", "one"),
        value=_same,
        errors=lambda a: {
            **_of_pumps(a),
            "D_m": ("motors", a.D_m),
            "p_a": ("p_a", a.p),
            "p_b": ("p_b", a.p),
        },
        limited=_leakage_nuisances,
        open={"pumps": UNCLOSED},
        with_time=("leak",),
        plausible=(0.2, 5.0),
        least=0.2,
        floor=0.05,
        meaning="leakage of the active circuit over the crane file's",
        cause="worn pumps or motors, an open valve, or warm oil",
    ),
    Parameter(
        name="displacement",
        unit="1",
        balance="flow",
        columns=FLOW,
        explained=_OIL,
        by=("full", "leak", "rate", "one"),
        value=_same,
        errors=_of_pumps,
        limited=_leakage_nuisances,
        open={"pumps": UNCLOSED},
        with_time=("leak",),
        plausible=(-0.15, 0.15),
        least=0.005,
        floor=0.001,
        meaning="what the motors' displacement is above its reading, part of the full one",
        cause="sensor or control of the motors' displacement, or encoder: speed and displacement have one product",
    ),
    Parameter(
        name="gas",
        unit="",
        balance="gas",
        columns=GAS,
        explained={"p_hp": 1.0},
        by=("gas", "flow", "time"),
        value=_inverse,
        errors=lambda a: {
            "D_pm": ("gas", a.D_pm),
            "alpha_pm": ("setting", a.alpha_pm),
            "make_up": ("make_up", a.make_up),
            "R_piston": ("piston", a.R_piston),
        },
        with_time=("gas",),
        with_speed=("gas",),
        plausible=(0.5, 1.5),
        least=0.08,
        floor=0.02,
        meaning="charge of gas over the crane file's, with its exponent and temperature",
        cause="a vessel shut off, gas lost, or oil above the piston",
    ),
    _delay("pump_delay", 0.010, "pumps"),
    _delay("motor_delay", 0.040, "motors"),
)
