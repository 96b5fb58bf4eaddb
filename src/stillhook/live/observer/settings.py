"""The tables [measured] and [adapt] of a live file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, NamedTuple

from pydantic import Field

from stillhook.errors import IdentifyError, LiveError
from stillhook.library.toml.file import TomlTable
from stillhook.live.estimate import Accuracies, FrictionEstimator
from stillhook.live.observer.signals import SIGNALS
from stillhook.live.residual import read_model
from stillhook.live.watch.virtual import sensors_of
from stillhook.spec.crane import Crane
from stillhook.tables.table import Spec, Text
from stillhook.units import Mass, Time

LEAST_EVERY, MOST_EVERY = 1.0, 600.0
"""Time between two changes of the factor [s]."""
LEAST_STEP, MOST_STEP = 0.01, 0.2
"""Change of the factor at a time [-]."""


class MeasuredTable(Spec):
    """The table [measured]."""

    signals: tuple[Text, ...] = Field(default=tuple(SIGNALS), min_length=1, description="what the crane measures")
    timeout: Annotated[Time, Field(ge=0.1, le=60.0)] = Field(default=1.0, description="age of stale measured values")
    load: Mass | None = Field(default=None, description="payload on the hook; default what the load cell shows")
    window: Time = Field(default=300.0, description="window of the friction estimate")
    gas_side: bool = Field(default=False, description="p_hp is read at the gas")
    accuracies: dict[str, float] = Field(default_factory=dict, description="limits of error of the sensors, SI")
    residual: Text | None = Field(default=None, description="model of what adaptation leaves over (level 4), shown")


class AdaptTable(Spec):
    """The table [adapt]."""

    step: Annotated[float, Field(ge=LEAST_STEP, le=MOST_STEP)] = Field(
        default=0.05, description="largest change of the factor at a time"
    )
    every: Annotated[Time, Field(ge=LEAST_EVERY, le=MOST_EVERY)] = Field(
        default=5.0, description="time between two changes"
    )


class AdaptSettings(NamedTuple):
    """Largest change of the factor at a time [-], and time between two of them [s]."""

    step: float = 0.05
    every: float = 5.0


class ObserverSettings(NamedTuple):
    """signals that are measured; timeout of their values [s]; load, accuracies, window [s] and gas_side as for a
    `FrictionEstimator`; adapt: how the twin follows, None where it does not; virtual: names of the crane's virtual
    sensors; residual: file of a model of level 4."""

    signals: tuple[str, ...] = tuple(SIGNALS)
    timeout: float = 1.0
    load: float | None = None
    accuracies: Accuracies | None = None
    window: float = 300.0
    gas_side: bool = False
    adapt: AdaptSettings | None = None
    virtual: tuple[str, ...] = ()
    residual: Path | None = None


def settings_of(
    table: TomlTable, measured: MeasuredTable | None, adapt: AdaptTable | None, crane: Crane
) -> ObserverSettings | None:
    """Settings of both tables; None without them. Errors: StillhookError of one line."""
    if measured is None:
        if adapt is not None:
            raise table.wrong("adapts to what is measured. Add the table [measured].", "adapt")
        return None
    _check(table, measured.signals)
    try:
        accuracies = Accuracies(**measured.accuracies)
    except TypeError:
        allowed = ", ".join(Accuracies.__dataclass_fields__)
        raise table.wrong(f"an unknown name. Choose of {allowed}.", "measured", "accuracies") from None
    except IdentifyError as problem:
        raise LiveError(f"{table.place('measured', 'accuracies')}: {problem}") from None
    settings = ObserverSettings(
        measured.signals,
        measured.timeout,
        measured.load,
        accuracies,
        measured.window,
        measured.gas_side,
        None if adapt is None else AdaptSettings(adapt.step, adapt.every),
        tuple(s.name for s in sensors_of(crane)),
        None if measured.residual is None else table.relative_file(measured.residual, "measured", "residual"),
    )
    if settings.residual is not None:
        read_model(settings.residual, crane)
    try:
        of = estimator(crane, settings)
    except IdentifyError as problem:
        if adapt is None and settings.residual is None and measured.window == ObserverSettings().window:
            return settings  # a winch whose friction is not estimated
        raise LiveError(f"{table.place('measured' if adapt is None else 'adapt')}: {problem}") from None
    rows = {name: [0.0] for name in (*settings.signals, "time")}
    if (adapt is not None or settings.residual is not None) and (missing := of.missing(rows)):
        raise table.wrong(f"needs {', '.join(missing)} to estimate friction. Measure them.", "measured", "signals")
    return settings


def estimator(crane: Crane, settings: ObserverSettings) -> FrictionEstimator:
    """The estimator of these settings. Errors: IdentifyError for a winch without pressures of its motors."""
    s = settings
    return FrictionEstimator(crane, load=s.load, accuracies=s.accuracies, window=s.window, gas_side=s.gas_side)


def _check(table: TomlTable, names: Sequence[str]) -> None:
    for name in names:
        if name not in SIGNALS:
            raise table.wrong(f"no signal that is measured. Choose of {', '.join(SIGNALS)}.", "measured", "signals")
    if len(set(names)) < len(names):
        raise table.wrong("a signal is named twice. Leave one.", "measured", "signals")
