"""Kernels of this stage. Each has a slow NumPy reference in ``tests/association/kernels/reference.py``."""
