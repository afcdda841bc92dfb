"""Compiled vectorization of ordered points over records; see ``layout.py`` for what these hold.

Nothing here validates: callers pass finite numbers and valid indices. The kernels have slow references in
``tests/vectorization/reference.py``.
"""
