"""Launch files: reads one into a description of a graph. Knows no node class, imports no plugin and runs nothing.

`yaml` reads documents with positions, `model` defines the keys and the description, and `load` builds the description
from files. `runner/planning` compares it with the plugins before anything starts.

`yaml/edit` changes a file: `edit(text, path, value)` replaces or adds one value by the positions of YAML's events and
keeps every other line. It returns the edited text only if that loads as the old one with the new value.
"""
