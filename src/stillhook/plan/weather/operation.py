"""Reads the weather that a plan names."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stillhook.base.nearest import nearest
from stillhook.errors import PlanError, WeatherError
from stillhook.formats.weather.file import SENSES, read_weather
from stillhook.plan.definition.lift_plan import WeatherUse
from stillhook.units import quote
from stillhook.weather.series import Weather


def weather_used(use: WeatherUse) -> Weather:
    """The weather, read as the plan says; columns without any number are left out.

    Errors: WeatherError of one line for the file and where no height is known, PlanError for a sense that is none.
    """
    if use.sense is not None and use.sense not in SENSES:
        raise PlanError(
            f"weather.sense = {quote(use.sense)}: is not one of {', '.join(SENSES)}{nearest(use.sense, tuple(SENSES))}"
        )
    sense = None if use.sense is None else SENSES[use.sense]
    weather = read_weather(
        use.file, sense=sense, columns_as=use.columns, time_column=use.time, date_order=use.date_order
    )
    known = {name: x for name, x in weather.columns.items() if np.isfinite(x).any()}
    if "H_m0" in weather.columns and "H_m0" not in known:
        raise WeatherError(
            f"{weather.source}: no record of wave height: all {len(weather)} are missing. Give weather that has them."
        )
    return replace(weather, columns=known)
