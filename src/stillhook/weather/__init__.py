"""Weather over years and days: limits on it, windows between gaps, waiting, forecasts with their uncertainty."""
