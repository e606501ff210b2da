"""Work on finished bags: compare, convert, verify, recover. Needs no graph."""
