"""What runs a winch, and a lowering below it: functions that kernels are compiled from."""
