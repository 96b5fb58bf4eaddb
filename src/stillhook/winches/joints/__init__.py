"""What joins hook and payload: slings, and units above them, a module each."""
