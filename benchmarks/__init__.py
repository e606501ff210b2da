"""Benchmarks: what busflow costs, beside what a user would pick instead; `python -m benchmarks` runs them."""
