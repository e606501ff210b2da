"""Output for a terminal: tables, YAML, drawings, progress. Asks no run."""
