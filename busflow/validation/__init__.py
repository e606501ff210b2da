"""Checks of values and texts about their faults: annotations, ranges, durations, and the user's line of an exception.

Imports only `errors` and `text`.
"""
