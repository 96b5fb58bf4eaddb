"""Leakage, displacement, gas charge and delay: balances that are linear in them, over the half waves that friction is
followed by."""
