"""Torque-loss models of hydraulic motors from supplier maps."""
