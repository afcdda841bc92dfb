"""Kernels of this stage. Each has a slow NumPy reference implementation in ``tests/association/reference``."""
