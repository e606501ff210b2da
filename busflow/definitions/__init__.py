"""Definition files of message, service and action types (`.msg`, `.srv`, `.action`): read, found in folders, written.

Imports no message class, no numpy and no pydantic, and nothing of a run. `reader` is the one parser of this text: of
files, and (`recorded`) of the definitions that recordings hold.
"""
