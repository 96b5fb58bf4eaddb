"""Files that come in and go out: logs of ship motion, tables of crane-tip motion."""
