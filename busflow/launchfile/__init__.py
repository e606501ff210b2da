"""Launch files: reads one into a checked description of a graph. Runs nothing.

`yaml` reads documents with positions, `model` defines the keys and the description, `load` builds the description from
files, and `check` compares it with the plugins before anything starts.

Two pure functions of `check/drift` save parameters: `drifts(spec, values)` returns the current values that differ from
the launch file's, and `written_back(text, file, drifts)` returns the text that states them. The latter uses
`yaml/edit`: `edit(text, path, value)` replaces or adds one value by the positions of YAML's events and keeps every
other line. It returns the edited text only if that loads as the old one with the new value.
"""
