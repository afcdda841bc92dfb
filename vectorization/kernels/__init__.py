"""Compiled vectorization of ordered points over records; see ``layout.py`` for what these hold.

Nothing here validates: callers hand over finite numbers and indices in range. The kernels have slow twins in
``tests/vectorization/reference.py``.
"""
