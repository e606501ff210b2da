"""Work on finished bags: compare, convert, verify, recover. Needs no graph.

`diff` pairs messages and leaves their fields to `message_diff`; each form of `convert` is a `sink` for entries. A
result goes to a `target`, which has its name only when it is whole, and replaces no file.
"""
