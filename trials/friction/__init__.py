"""Friction campaigns of a known truth with drifting transmitters and warming oil."""
