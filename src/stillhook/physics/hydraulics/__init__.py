"""Hydraulic components: motors, pumps, valves, lines, gas and accumulator."""
