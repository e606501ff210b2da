"""YAML with positions: documents, values, scalars, and edits in place. Knows no key of a launch file."""
