"""Kernels of this stage."""
