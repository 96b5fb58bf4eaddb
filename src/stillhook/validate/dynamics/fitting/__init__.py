"""The output-error fit of step 4."""
