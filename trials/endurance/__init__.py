"""The live twin over hours, under kills and for a day in time-lapse. None of it is in `make test`."""
