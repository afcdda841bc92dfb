"""Compiled sums and solvers over records; see ``layout.py`` for what these hold.

Nothing here validates: callers pass finite numbers and valid indices. Every kernel has a slow reference in
``tests/reference.py``. Below are those that the kernels of other packages may call.
"""

from .joint import joint_add, joint_cost, joint_information, joint_solve
from .matrices import carried, eigen2, invert3, invert3_scaled, is_regular3
from .observability import MAX_DEVIATION
from .one_step import one_step_add
from .records import keep_alive

__all__ = [
    "MAX_DEVIATION",
    "carried",
    "eigen2",
    "invert3",
    "invert3_scaled",
    "is_regular3",
    "joint_add",
    "joint_cost",
    "joint_information",
    "joint_solve",
    "keep_alive",
    "one_step_add",
]
