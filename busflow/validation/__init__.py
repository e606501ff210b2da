"""What is wrong with a value, in words: annotations, ranges, durations, and the user's line behind an exception.

Imports only `errors` and `text`.
"""
