"""The compensated winch as the frequency-domain method sees it."""
