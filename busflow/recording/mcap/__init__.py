"""MCAP records, chunks, index and writer. Knows no message type."""
