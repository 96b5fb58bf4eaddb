"""Reads the weather that a plan names."""

from __future__ import annotations

from stillhook.errors import PlanError
from stillhook.io.weather_file import SENSES, read_weather
from stillhook.library.files import nearest
from stillhook.plan.lift_plan import WeatherUse
from stillhook.sea.weather import Weather
from stillhook.units import came


def weather_used(use: WeatherUse) -> Weather:
    """The weather, read as the plan says. Errors: WeatherError of one line for the file, PlanError for a sense that is none."""
    if use.sense is not None and use.sense not in SENSES:
        raise PlanError(f"weather.sense = {came(use.sense)}: is not one of {', '.join(SENSES)}{nearest(use.sense, tuple(SENSES))}")
    sense = None if use.sense is None else SENSES[use.sense]
    return read_weather(use.file, sense=sense, columns_as=use.columns, time_column=use.time, date_order=use.date_order)
