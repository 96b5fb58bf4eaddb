"""Sensors of the user between the winch and its PLC: the contract, and those that are loaded."""
