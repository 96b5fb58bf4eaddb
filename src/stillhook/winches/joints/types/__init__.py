"""Units between hook and slings, a module each."""
