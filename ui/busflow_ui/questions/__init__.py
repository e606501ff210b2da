"""Questions of a page about a run: what Foxglove's protocol has no word for, asked and answered as JSON."""
