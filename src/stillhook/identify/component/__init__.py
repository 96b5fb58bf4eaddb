"""Components from data of their own: leakage of motors and pumps, displacement controls, line restrictions."""
