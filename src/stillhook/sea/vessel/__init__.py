"""Vessel and crane tip in waves."""
