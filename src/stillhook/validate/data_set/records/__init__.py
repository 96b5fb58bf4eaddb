"""Records of a campaign: signals on one even grid, clocks repaired, cut into load cases."""
