"""From demands of a phase and rules to limiting sea states."""
