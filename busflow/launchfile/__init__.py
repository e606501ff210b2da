"""From a launch file to a checked description of a graph. Runs nothing.

`yaml` reads documents with positions, `model` has the keys and the description, `load` makes one of the other,
`check` compares the description with its plugins before anything starts.

Saving parameters is two pure functions of `check/drift`: `drifts(spec, values)` says which current values differ from
what the file comes to, `written_back(text, file, drifts)` gives the text that states them. The latter stands on
`yaml/edit`, whose `edit(text, path, value)` replaces or adds one value by the positions of YAML's events and leaves
every other line as it was. The edited text has to load as the old one with the value in it, or it is not returned.
"""
