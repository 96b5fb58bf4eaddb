"""The compensated winch as the frequency-domain method represents it."""
