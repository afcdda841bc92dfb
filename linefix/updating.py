"""Updating a map from scans of several visits."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from association import Deadline, MapIndex, Scan
from map_quality import MapUpdate, VisitScan, finished, updating
from registration import InvalidArgumentError, Segments
from vectorization import LaserScan

from .locating import index_map, scan_of
from .ranges import MountedScan, RangeScan

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from formats import ImportedMap, LineMap


def update_map(
    map: MapIndex | LineMap | ImportedMap | Segments | Mapping[str, Any] | ArrayLike,
    visits: Mapping[str, Iterable[Scan | MountedScan | LaserScan | VisitScan]],
    deadline: Deadline | None = None,
    *,
    accept: float | None = None,
    refuse: Collection[int] = (),
) -> MapUpdate:
    """Propose changes of a map that scans of several visits show; nothing is stored.

    Parameters
    ----------
    map : MapIndex, LineMap, ImportedMap, Segments, mapping, or array-like of shape (n, 4)
        As of `index_map`.
    visits : mapping of str to iterable of scans
        The scans of each visit, by its name; at least two visits are needed for a change. Scans with ranges, in a form
        that `scan_of` takes. A `VisitScan` may have a pose of its own; it keeps its scan, and takes the visit's name.
        The `pose` of a scan of a log is its odometry; scans with odometry are in the order of time.
    deadline : Deadline, optional
        If it passes before the proposal is verified, nothing is proposed.
    accept : float, optional
        Confidence from 0 to 1 below which a change is proposed, but not in the new map. None: all are in it.
    refuse : collection of int
        Indices of proposed changes that are not in the new map.

    Returns
    -------
    MapUpdate
        Its `segments` are the new map, its `changes` have their evidence. See `map_quality.updating` for the steps.

    Raises
    ------
    InputError
        When a part is not valid; the message names the argument.
    CancelledError
        When the deadline was cancelled.

    Examples
    --------
    A pillar is gone since the map was made:

    >>> import numpy as np
    >>> import linefix
    >>> room = [[0, 0, 9, 0], [9, 0, 9, 3], [9, 3, 6, 3], [6, 3, 6, 7], [6, 7, 0, 7], [0, 7, 0, 0]]
    >>> pillar = [[3, 3, 3, 4], [3, 4, 4, 4], [4, 4, 4, 3], [4, 3, 3, 3]]
    >>> scanner, rng = linefix.simulation.Scanner(beams=360, angle_increment=0.01745), np.random.default_rng(1)
    >>> def seen_from(x, y):
    ...     pose = linefix.RigidTransform(x, y, 0.5)
    ...     ranges = linefix.simulation.scan(linefix.Segments.from_array(room), pose, scanner, rng).ranges
    ...     return linefix.LaserScan(scanner.angle_min, scanner.angle_increment, ranges)
    >>> places = [(1, 1), (5, 1), (2, 5.5), (5, 6), (1, 3.5), (7.5, 1.5)]
    >>> visits = {day: [seen_from(*place) for place in places] for day in ("monday", "tuesday")}
    >>> update = linefix.update_map({"segments": room + pillar, "sigma": 0.005}, visits)
    >>> [(change.code, change.segments) for change in update.changes]
    [('removed', (6, 7, 8, 9))]
    >>> len(update.segments)
    6
    """
    index = index_map(map)
    scans = [_visit_scan(one, name, number) for name, some in visits.items() for number, one in enumerate(some)]
    return finished(updating(index, scans, deadline, accept=accept, refuse=refuse))


def _visit_scan(one: Any, visit: str, number: int) -> VisitScan:
    """Return a scan of a visit; raises `InputError` where it is none with ranges."""
    if isinstance(one, VisitScan):
        return replace(one, visit=visit)
    odometry = None
    if isinstance(one, MountedScan):  # the mount does not matter to the map; odometry is that of the sensor
        odometry = getattr(one, "pose", None)
        one = RangeScan(one.laser, one.time_increment, None, one.flipped)
    scan = scan_of(one)
    if scan.beams is None:
        told = "found a scan without ranges, expected ranges: segments and points do not show free space"
        raise InvalidArgumentError(told, argument=f"visits.{visit}.{number}")
    return VisitScan(scan, visit, odometry=odometry)
