"""Files of measured wave spectra."""
