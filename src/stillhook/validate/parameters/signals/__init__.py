"""Clock, delay and reference of the logged signals."""
