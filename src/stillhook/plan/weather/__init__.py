"""Limits compared with weather: windows, waiting, forecasts."""
