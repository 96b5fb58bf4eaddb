"""What each controller gains in a lift plan, in days."""
