"""What is planned: vessel, crane, phases, seas and rules."""
