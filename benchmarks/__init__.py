"""Benchmarks: ``pytest benchmarks`` times single functions, each module a larger task."""
