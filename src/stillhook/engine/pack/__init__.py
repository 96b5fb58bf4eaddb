"""From crane, scenario and lift to the records that kernels read."""
