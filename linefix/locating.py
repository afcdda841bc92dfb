"""Maps and scans in the forms that people have them in, to the search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from association import (
    AssociationOptions,
    AssociationResult,
    Deadline,
    KnownOfMaps,
    MapIndex,
    MapPart,
    MapPoints,
    MapSet,
    Prior,
    Scan,
    assemble,
)
from registration import InvalidArgumentError, MeasuredSegments, Segments
from vectorization import LaserScan

from .driving import Explanation, explain_search, search
from .ranges import MountedScan, ranges_scan, view_of

if TYPE_CHECKING:
    from formats import ImportedMap, LineMap


def locate(
    map: MapIndex | MapSet | LineMap | ImportedMap | Segments | ArrayLike,
    scan: Scan | MountedScan | LaserScan | Segments | ArrayLike,
    angles: tuple[float, float] | None = None,
    *,
    prior: Prior | None = None,
    prior_map: str | None = None,
    map_weights: Mapping[str, float] | None = None,
    options: AssociationOptions | None = None,
    deadline: Deadline | None = None,
) -> AssociationResult:
    """Find where in a map, or on which of several maps, a scan was taken, and how sure that is.

    Parameters
    ----------
    map : MapIndex, MapSet, LineMap, ImportedMap, Segments, or array-like of shape (n, 4)
        Metres in the map frame, free space on the left of every segment. For many scans of one map index it once, by
        `index_map`: that takes longer than a search. Several maps are indexed by `index_maps`.
    scan : Scan, LoggedScan or other MountedScan, LaserScan, Segments, or array-like
        In the sensor's frame, metres: ranges of shape (m,), points of shape (m, 2) in scanning order, or segments of
        shape (n, 4). A scan of a log counts with its mount, its motion, and upside down where it is mounted so.
    angles : (float, float), optional
        For an array of ranges, and needed there: angle of the first beam, and from beam to beam; radians,
        counter-clockwise.
    prior : SoftPrior or HardPrior, optional
        Of the pose that is returned.
    prior_map : str, optional
        Of several maps the one that the prior is on, and required with a prior there.
    map_weights : mapping of str to float, optional
        Probabilities of several maps, by name. Maps without one share the rest equally. They are part of the score,
        and never fused.
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
        motion is not known, the covariance allows for 0.5 m/s and 1 rad/s (one standard deviation). Of several maps
        `map_id` names that of the pose, and `maps` lists the best pose of each.

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
    known = KnownOfMaps(prior, prior_map, map_weights)
    maps, how = (map, options) if isinstance(map, MapSet) else prepared(map, options)
    return search(maps, scan_of(scan, angles), known, how, deadline)


def explain(
    map: MapIndex | LineMap | ImportedMap | Segments | ArrayLike,
    scan: Scan | MountedScan | LaserScan | Segments | ArrayLike,
    angles: tuple[float, float] | None = None,
    *,
    prior: Prior | None = None,
    options: AssociationOptions | None = None,
    deadline: Deadline | None = None,
) -> Explanation:
    """Locate a scan, and return how the verdict on the answer came about, number by number.

    Parameters
    ----------
    map, scan, angles, prior, options, deadline
        As of `locate`.

    Returns
    -------
    Explanation
        `result` is the answer of `locate`. `verdict` has the features with their contributions, the alternatives with
        their weights, the null score, each veto, the probabilities and their thresholds. `last_view` is that of the
        last view of a drive, if that was searched alone.

    Raises
    ------
    InputError
        When map, scan or options are not valid; the message names the argument.

    Examples
    --------
    Of two equal rooms each explains the scan:

    >>> import linefix
    >>> room = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
    >>> other = [[x1 + 9, y1, x2 + 9, y2] for x1, y1, x2, y2 in room]
    >>> seen = [[-1, 1, -1, -5], [-1, -5, 1, -5], [1, -5, 1, -3], [1, -3, 4, -3], [4, -3, 4, 1], [4, 1, -1, 1]]
    >>> verdict = linefix.explain(room + other, seen).verdict
    >>> verdict.usable, [reason.code for reason in verdict.reasons]
    (False, ['similar_place'])
    >>> len(verdict.alternatives), round(verdict.among, 3)
    (1, 0.5)
    """
    index, how = prepared(map, options)
    return explain_search(index, scan_of(scan, angles), KnownOfMaps(prior), how, deadline)


def prepared(
    map: MapIndex | LineMap | ImportedMap | Segments | ArrayLike, options: AssociationOptions | None
) -> tuple[MapIndex, AssociationOptions]:
    """Return a map's index and the options of a search; directions count where they do in both."""
    index, how = index_map(map), options or AssociationOptions()
    how = replace(how, oriented=how.oriented and index.oriented)
    return index if how.oriented else index.undirected, how


def index_map(map: MapIndex | LineMap | ImportedMap | Segments | Mapping[str, Any] | ArrayLike) -> MapIndex:
    """Prepare a map for many scans.

    Parameters
    ----------
    map : MapIndex, LineMap, ImportedMap, Segments, mapping, or array-like of shape (n, 4)
        An index is returned as it is. The error of bare segments is not known: each answer estimates it. A
        mapping is a map document as in a map file: ``segments``, and optionally ``sigma``, ``oriented``, ``points`` and
        ``points_sigma``.

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
    return map_part(map, "map").indexed()


def index_maps(maps: Mapping[str, Any] | Sequence[Any]) -> MapSet:
    """Prepare several maps for scans that are searched on all of them at once.

    Parameters
    ----------
    maps : mapping of str to map, or sequence of maps
        1 to 256, each in a form that `index_map` takes, by name. Those of a sequence are named "0", "1" and so on.

    Raises
    ------
    InputError
        When one is no map that can be searched; the argument names it, as ``maps.3.segments``.

    Examples
    --------
    >>> import linefix
    >>> room = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
    >>> hall = [[0, 0, 9, 0], [9, 0, 9, 4], [9, 4, 0, 4], [0, 4, 0, 0]]
    >>> seen = [[-1, 1, -1, -5], [-1, -5, 1, -5], [1, -5, 1, -3], [1, -3, 4, -3], [4, -3, 4, 1], [4, 1, -1, 1]]
    >>> answer = linefix.locate(linefix.index_maps({"room": room, "hall": hall}), seen)
    >>> answer.usable, answer.map_id
    (True, 'room')
    >>> [(one.map_id, str(one.status)) for one in answer.maps]
    [('room', 'ok'), ('hall', 'no_match')]
    """
    named = list(maps.items()) if isinstance(maps, Mapping) else [(str(n), one) for n, one in enumerate(maps)]
    return MapSet([(name, map_part(one, f"maps.{number}")) for number, (name, one) in enumerate(named)])


def map_part(map: Any, argument: str) -> MapPart:
    """Return one of several maps; raises `InputError` where it is none."""
    if isinstance(map, MapIndex):
        return MapPart.of(map)
    if isinstance(map, Mapping):
        return _document_part(map, argument)
    if isinstance(map, str | PathLike):
        raise InvalidArgumentError(f"found the name {str(map)!r}, expected a map; use read_map", argument=argument)
    inner: Any = getattr(map, "map", map)  # an imported map comes with a report
    segments = getattr(inner, "segments", None)
    if isinstance(segments, Segments):
        points = MapPoints.of(inner.points, inner.points_sigma, path=f"{argument}.")
        return MapPart(segments, inner.sigma, inner.oriented, points, inner.frame_id)
    return MapPart(inner if isinstance(inner, Segments) else Segments.from_array(inner, argument=argument))


def _document_part(document: Mapping[str, Any], argument: str) -> MapPart:
    """Return the map of a document; raises `InputError` where a field is unknown, or not what it should be."""
    from .documents.errors import InvalidRequestError
    from .documents.parts import InlineMap
    from .documents.reading import validate

    try:  # both may be arrays of NumPy here
        fields = validate(InlineMap, {**document, "segments": [], "points": []})
    except InvalidRequestError as error:
        fault = error.faults[0]
        raise InvalidArgumentError(fault.message, argument=argument + fault.pointer.replace("/", ".")) from None
    segments = Segments.from_array(document.get("segments", []), argument=f"{argument}.segments")
    points = MapPoints.of(document.get("points", []), fields.points_sigma, path=f"{argument}.")
    return MapPart(segments, fields.sigma, fields.oriented is not False, points, fields.frame_id)


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
        frame, stamp = (getattr(scan, name, None) for name in ("located_frame", "stamp"))
        return replace(assemble([view_of(scan)]), frame_id=frame, stamp=stamp)
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
