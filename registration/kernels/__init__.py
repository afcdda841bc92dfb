"""Compiled arithmetic over records, and loops over the arrays of a map; see ``layout.py`` for what records hold.

Nothing here validates: callers pass finite numbers and valid indices. Below are those that the kernels of other
packages may call.
"""

from .arrays import keep_alive
from .sums import MAX_DEVIATION, invert3, joint_add, joint_cost, joint_information, joint_solve

__all__ = [
    "MAX_DEVIATION",
    "invert3",
    "joint_add",
    "joint_cost",
    "joint_information",
    "joint_solve",
    "keep_alive",
]
