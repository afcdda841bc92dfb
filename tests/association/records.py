"""Between plain values, which the references speak in, and the records that kernels are handed."""

from __future__ import annotations

from typing import Any

import numpy as np

from association.consensus.beams import beam_rows
from association.layout import ESTIMATE, POINT, SIGHTING, record
from association.tables import Rays, Sights, Workspace
from registration import RigidTransform
from registration.layout import Floats, Record, Records
from registration.observability import most_parallel_up_to

UPPER = ("xx", "xy", "xt", "yy", "yt", "tt")
NOTHING_KNOWN = np.zeros((3, 3))  # as a covariance: the pose is exact


def work_of(count: int, walls: int) -> Workspace:
    """Return a workspace for a scan of `count` lines and a map of that many walls."""
    return Workspace.of(count, walls, most_parallel_up_to(count))


def estimate_of(at: RigidTransform, covariance: Floats = NOTHING_KNOWN) -> Records:
    """Return a pose with its covariance, (1,) of `ESTIMATE`."""
    upper = dict(zip(UPPER, covariance[np.triu_indices(3)], strict=True))
    return record(ESTIMATE, theta=at.theta, x=at.x, y=at.y, **upper)


def pose_of(estimate: Record) -> RigidTransform:
    return RigidTransform(float(estimate["x"]), float(estimate["y"]), float(estimate["theta"]))


def covariance_of(estimate: Record) -> Floats:
    matrix = np.zeros((3, 3))
    matrix[np.triu_indices(3)] = [estimate[name] for name in UPPER]
    return np.asarray(matrix + np.triu(matrix, 1).T)


def assert_records(got: Records, expected: Records, **tolerance: Any) -> None:
    """Compare records field by field."""
    assert got.dtype == expected.dtype
    for name in expected.dtype.names or ():
        np.testing.assert_allclose(got[name], expected[name], err_msg=name, **tolerance)


def rays_of(angles: Floats, ranges: Floats, viewpoint: Any = (0.0, 0.0), reach: float = 20.0) -> Rays:
    """Return beams that all begin at one place."""
    return Rays(beam_rows(viewpoint, angles, ranges), reach)


def sights_of(scan: Records, viewpoint: Any = (0.0, 0.0), *, sighted: bool = True) -> Sights:
    """Return the rows of a scan as one view saw them; without lines of sight where it is not `sighted`."""
    seen = np.zeros(len(scan) if sighted else 0, SIGHTING)
    for name in ("dx", "dy", "x", "y", "length") if sighted else ():
        seen[name] = scan[name]
    seen["row"] = np.arange(len(seen))
    return Sights(
        record(POINT, x=viewpoint[0], y=viewpoint[1]), np.array([0, len(seen)]), seen, np.arange(len(seen)), np.ones(1)
    )
