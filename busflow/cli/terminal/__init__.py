"""What is written to a terminal: tables, YAML, drawings, progress. Asks no run."""
