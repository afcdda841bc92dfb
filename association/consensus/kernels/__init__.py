"""Kernels of this stage. Each has a slow NumPy twin in ``tests/association/reference``."""
