"""What may be wrong with a log: samples, signs, frozen signals."""
