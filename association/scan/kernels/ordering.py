"""Sort numbers. Numba compiles its sorting again for each signature: here it has one."""

import numpy as np

from compiled import kernel
from registration.layout import Floats

from ...layout import Indices


@kernel
def ascending(values: Floats) -> Indices:
    """Return the places of values in their order, ties by place."""
    return np.argsort(values, kind="mergesort")
