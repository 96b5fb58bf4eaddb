"""The reference plant: a winch with more physics than the twin's, to make logs that the twin has never seen."""
