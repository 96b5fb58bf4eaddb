"""Models that say what a phase demands: closed form, frequency domain, time domain."""
