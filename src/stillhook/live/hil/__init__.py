"""Hardware in the loop: a soft PLC over a bus, the twin as its plant, and any PLC compared with the library."""
