"""Files of ship and crane-tip motion."""
