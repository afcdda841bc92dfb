"""Maps and scans in the forms that people have them in, to the search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from association import AssociationOptions, AssociationResult, Deadline, MapIndex, Prior, Scan, assemble, associate
from registration import InvalidArgumentError, MeasuredSegments, Segments
from vectorization import LaserScan

from .mounted import MountedScan, ranges_scan, view_of

if TYPE_CHECKING:
    from formats import ImportedMap, LineMap

MAP_FIELDS = frozenset(("segments", "sigma", "oriented", "frame_id", "meta"))  # of a map document


def locate(
    map: MapIndex | LineMap | ImportedMap | Segments | ArrayLike,
    scan: Scan | MountedScan | LaserScan | Segments | ArrayLike,
    angles: tuple[float, float] | None = None,
    *,
    prior: Prior | None = None,
    options: AssociationOptions | None = None,
    deadline: Deadline | None = None,
) -> AssociationResult:
    """Find where in a map a scan was taken, and how sure that is.

    Parameters
    ----------
    map : MapIndex, LineMap, ImportedMap, Segments, or array-like of shape (n, 4)
        Metres in the map frame, free space on the left of every segment. For many scans of one map index it once, by
        `index_map`: that takes longer than a search.
    scan : Scan, LoggedScan or other MountedScan, LaserScan, Segments, or array-like
        In the sensor's frame, metres: ranges of shape (m,), points of shape (m, 2) in scanning order, or segments of
        shape (n, 4). A scan of a log counts with its mount, its motion, and upside down where it is mounted so.
    angles : (float, float), optional
        For an array of ranges, and needed there: angle of the first beam, and from beam to beam; radians,
        counter-clockwise.
    prior : SoftPrior or HardPrior, optional
        Of the pose that is returned.
    options : AssociationOptions, optional
        Default: those of the service. Directions count where they do in the map, and `options.oriented` is true.
    deadline : Deadline, optional
        Of the search. A map is indexed first, whatever the deadline; an index whose directions count is indexed once
        more by the first search for which they do not.

    Returns
    -------
    AssociationResult
        Its `usable` is the one flag to gate on; `pose` is map_from_scan. Of a `MountedScan` it is that of the robot at
        the first beam, map_from_base, if the mount is known, else that of the sensor. If a scan took time and its
        motion is not known, the covariance allows for 0.5 m/s and 1 rad/s (one standard deviation).

    Raises
    ------
    InputError
        When map, scan or options are not valid; the message names the argument.

    Examples
    --------
    An L-shaped room, and ranges all around from (1, 1), looking along the map's y axis:

    >>> import math
    >>> import numpy as np
    >>> import linefix
    >>> room = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
    >>> scanner = linefix.simulation.Scanner(beams=720, sigma=0.01)
    >>> truth = linefix.RigidTransform(1.0, 1.0, math.pi / 2)
    >>> seen = linefix.simulation.scan(linefix.Segments.from_array(room), truth, scanner, np.random.default_rng(1))
    >>> answer = linefix.locate(room, seen.ranges, (scanner.angle_min, scanner.angle_increment))
    >>> answer.usable, answer.status.value
    (True, 'ok')
    >>> f"{answer.pose.x:.2f} {answer.pose.y:.2f} {answer.pose.theta:.2f}"
    '1.00 1.00 1.57'
    """
    index, how = prepared(map, options)
    return associate(index, scan_of(scan, angles), prior, how, deadline)


def prepared(
    map: MapIndex | LineMap | ImportedMap | Segments | ArrayLike, options: AssociationOptions | None
) -> tuple[MapIndex, AssociationOptions]:
    """Return a map's index and the options of a search; directions count where they do in both."""
    index, how = index_map(map), options or AssociationOptions()
    how = replace(how, oriented=how.oriented and len(index.segments) == index.directed)
    return index if how.oriented else index.undirected, how


def index_map(map: MapIndex | LineMap | ImportedMap | Segments | Mapping[str, Any] | ArrayLike) -> MapIndex:
    """Prepare a map for many scans.

    Parameters
    ----------
    map : MapIndex, LineMap, ImportedMap, Segments, mapping, or array-like of shape (n, 4)
        An index is returned as it is. The error of bare segments is not known: each answer estimates it. A
        mapping is a map document as in a map file: ``segments``, and optionally ``sigma`` and ``oriented``.

    Raises
    ------
    InputError
        When it is no map that can be searched.

    Examples
    --------
    >>> import linefix
    >>> index = linefix.index_map([[0, 0, 6, 0], [6, 0, 6, 4], [6, 4, 0, 4], [0, 4, 0, 0]])
    >>> len(index.segments)
    4
    """
    if isinstance(map, MapIndex):
        return map
    if isinstance(map, Mapping):
        return _index_document(map)
    inner: Any = getattr(map, "map", map)  # an imported map comes with a report
    segments = getattr(inner, "segments", None)
    if isinstance(segments, Segments):
        return MapIndex.build(segments, inner.sigma, oriented=inner.oriented)
    return MapIndex.build(inner if isinstance(inner, Segments) else Segments.from_array(inner, argument="map"))


def _index_document(document: Mapping[str, Any]) -> MapIndex:
    """Index a map document; raises `InputError` where a field is unknown, or not what it should be."""
    unknown = sorted(set(map(str, document)) - MAP_FIELDS)
    if unknown:
        raise InvalidArgumentError(
            f"found the field {unknown[0]}, expected {', '.join(sorted(MAP_FIELDS))}", argument="map"
        )
    oriented, sigma = document.get("oriented"), document.get("sigma")
    if not (oriented is None or isinstance(oriented, bool)):
        raise InvalidArgumentError(f"expected true, false or null, found {oriented!r}", argument="map.oriented")
    if sigma is not None and (isinstance(sigma, bool) or not isinstance(sigma, int | float)):
        raise InvalidArgumentError(f"expected metres or null, found {sigma!r}", argument="map.sigma")
    segments = Segments.from_array(document.get("segments", []), argument="map.segments")
    return MapIndex.build(segments, sigma, oriented=oriented is not False)


def scan_of(
    scan: Scan | MountedScan | LaserScan | Segments | ArrayLike, angles: tuple[float, float] | None = None
) -> Scan:
    """Return a scan as the search takes it; ranges stay evidence in addition to the segments that are found in them.

    Parameters
    ----------
    scan : Scan, MountedScan, LaserScan, Segments, or array-like
        In the sensor's frame, metres: ranges (m,), points (m, 2) in scanning order, or segments (n, 4). A `Scan` is
        returned as it is; a `MountedScan` comes out in the robot's frame, see `locate`.
    angles : (float, float), optional
        Of an array of ranges: angle of the first beam, and from beam to beam; radians.

    Raises
    ------
    InputError
        When it is no scan.

    Examples
    --------
    >>> import linefix
    >>> wall = [[x / 10, -1.0] for x in range(20)]
    >>> linefix.scan_of(wall).measured.segments.endpoints.round(3).tolist()
    [[0.0, -1.0, 1.9, -1.0]]
    """
    if isinstance(scan, Scan):
        return scan
    if isinstance(scan, Segments):
        return Scan(MeasuredSegments.from_segments(scan))
    if isinstance(scan, LaserScan):
        return ranges_scan(scan)
    if isinstance(scan, MountedScan):
        return assemble([view_of(scan)])
    shape = np.shape(scan)
    if len(shape) == 1:
        if angles is None:
            raise InvalidArgumentError(
                "an array of ranges requires angles; expected (angle_min, angle_increment), radians", argument="angles"
            )
        return ranges_scan(LaserScan(*angles, scan))
    if len(shape) == 2 and shape[1] == 2:
        return ranges_scan(scan)
    return Scan(MeasuredSegments.from_segments(Segments.from_array(scan, argument="scan")))
