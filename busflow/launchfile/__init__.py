"""From a launch file to a description that can run: YAML with positions, expressions, a checked model."""
