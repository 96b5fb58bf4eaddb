"""The twin beside a running crane: what its logs and its PLC say of it while it works."""
