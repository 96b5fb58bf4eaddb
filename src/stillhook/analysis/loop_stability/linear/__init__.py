"""The plant linearised: differences, operating point of the closed form, running engine, and the PLC that closes it."""
