"""MCAP records, chunks, index and writer. Knows no message type.

`records` frames a file: where a record begins and ends, refused where it claims more than is there; the package
`mcap` parses what is in it. `chunks` unpacks and checks CRCs. `summary` reads the end of a file; `contents` goes
through every record, beyond damage too, for `bag verify` and `bag recover`.
"""
