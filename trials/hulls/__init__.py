"""How far to trust the motions of the library's own vessels: what hulls/make.py computed."""
