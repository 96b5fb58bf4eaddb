"""Estimates from samples: extremes, bootstrap and jackknife, time lags, optimisation by the complex method."""
