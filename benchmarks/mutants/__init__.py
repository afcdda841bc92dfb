"""Whether the tests notice mistakes: ``python -m benchmarks.mutants``.

Cosmic Ray puts one mistake at a time into a copy of the code; the tests of that module are run until one of them fails.
"""
