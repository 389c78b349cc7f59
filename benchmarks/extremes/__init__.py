"""The extremes: everything that a case gives, far larger and smaller than any brake has it, and what comes of it.

`python -m benchmarks.extremes` computes all of it and writes docs/extremes.md.
"""
