"""Pre-flight: finds everything wrong with a description and its plugins before anything starts. Starts nothing."""
