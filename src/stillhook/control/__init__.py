"""The winch's PLC: motor levels, semi-secondary control, heave compensation, passive circuit, modes."""
