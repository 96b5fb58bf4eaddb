"""Who vouches for a file: keys, signatures, the keys that a user trusts, and the one place that puts it into words."""
