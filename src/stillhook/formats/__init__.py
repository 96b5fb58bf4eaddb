"""Files that come in and go out, apart from logs: cases, lifts, motions, vessels, waves, weather, results."""
