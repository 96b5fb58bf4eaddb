"""The frequency-domain road from a sea to the load: exact rod, winch residual, linearised drag, statistics."""
