"""Speed and quality: the measured figures of Linefix, each with its goal."""

import os

# One core; read when numpy and numba are loaded.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"
