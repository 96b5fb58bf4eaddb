"""Trials that are not in the wheel: programs that draw what users bring, and check what must hold."""
