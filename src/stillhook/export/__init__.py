"""Models and controllers for other programs: FMU, Structured Text, external functions."""
