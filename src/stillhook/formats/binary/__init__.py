"""Binary files, each read in a separate process."""
