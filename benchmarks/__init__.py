"""Timings: `pytest benchmarks` for the parts, `python -m benchmarks.report` for a table."""
