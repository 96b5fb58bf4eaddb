"""The winch as C99 for other programs: its variables, its source, its library."""
