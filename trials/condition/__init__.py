"""Does the condition that is followed over years hold? Years of campaigns as numbers, and some as logs."""
