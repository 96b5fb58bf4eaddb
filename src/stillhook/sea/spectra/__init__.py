"""Wave spectra, parametric and measured, with their directions."""
