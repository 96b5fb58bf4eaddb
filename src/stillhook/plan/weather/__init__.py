"""Limits held against weather: windows, waiting, forecasts."""
