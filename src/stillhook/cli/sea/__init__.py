"""Commands of waves, vessels, payloads, tip motion and response."""
