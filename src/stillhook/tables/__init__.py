"""What every file of a user is made of: closed tables with units, plausible ranges, mistakes in one line."""
