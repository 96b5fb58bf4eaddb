"""Active circuit: flow, leakage, pressures, settings."""
