"""Search a scan on several maps at once: one joint index, one search and one verdict over all of them."""

from __future__ import annotations

import math
import threading
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from registration import RigidTransform
from registration.layout import Floats

from .associating import DEFAULT_OPTIONS, run_stages
from .context import SearchContext
from .deadline import Deadline
from .errors import InvalidMapError, InvalidSearchError
from .index.joint import JointIndex, MapPart, checked_parts, gap_of, usual_gap
from .options import AssociationOptions, MapsPrior, Prior
from .own_frames import in_own_frames
from .result import AssociationResult
from .scan.extents import whole_extent
from .scan.scan import Scan
from .tuning import SOFT_FLOOR

MOST_WEIGHT = 1.0 + 1e-9  # of all maps together, rounding


class MapSet:
    """Several maps that are searched together; immutable for its users, shared between threads.

    Attributes
    ----------
    ids : tuple of str
        Name of each map, all different.
    parts : tuple of MapPart
    index : JointIndex
        For scans as wide as the largest of the maps.
    """

    def __init__(
        self, maps: Mapping[str, MapPart] | Sequence[tuple[str, MapPart]], deadline: Deadline | None = None
    ) -> None:
        """Index several maps together.

        Parameters
        ----------
        maps : mapping of str to MapPart, or sequence of pairs
            By name; 1 to 256.
        deadline : Deadline, optional
            Looked at every few tenths of a second.

        Raises
        ------
        InvalidMapError
            When a map cannot be searched, or two have the same name.
        IndexingEndedError
            When the deadline passes, or is cancelled, first.
        """
        pairs = list(maps.items() if isinstance(maps, Mapping) else maps)
        self.ids = tuple(name for name, _ in pairs)
        if twice := [name for name, count in Counter(self.ids).items() if count > 1]:
            raise InvalidMapError(
                f"found the id {twice[0]!r} twice, expected a different one for each map", argument="maps"
            )
        self.parts = checked_parts(tuple(part for _, part in pairs))
        self.oriented = all(part.oriented for part in self.parts)
        gap = usual_gap(self.parts)
        self.index = JointIndex.of_parts(self.parts, gap, oriented=self.oriented, deadline=deadline)
        self._wider: JointIndex | None = None
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def nbytes(self) -> int:
        """Memory held at most, bytes: the index, and as much again for scans that are wider than the maps."""
        return 2 * self.index.nbytes

    def index_for(self, scan: Scan, deadline: Deadline | None = None) -> JointIndex:
        """Return the index in which no ray of a scan reaches from one map to another.

        A scan that is wider than the maps needs wider gaps. Their index is built when such a scan comes. It is cached
        if it takes no more memory than the usual one.

        Raises
        ------
        IndexingEndedError
            When the deadline passes, or is cancelled, before it is built.
        """
        needed = gap_of(whole_extent(scan))
        if needed <= self.index.gap:
            return self.index
        with self._lock:
            wider = self._wider
            if wider is not None and needed <= wider.gap:
                return wider
            wider = JointIndex.of_parts(self.parts, 2.0 * needed, oriented=self.oriented, deadline=deadline)
            self._wider = wider if wider.nbytes <= self.index.nbytes else None
        return wider

    def number_of(self, map_id: str, argument: str) -> int:
        """Return which map has a name; raises `InvalidSearchError` where none has."""
        if map_id not in self.ids:
            raise InvalidSearchError(
                f"expected the id of one of the {len(self)} maps that are searched, found another", argument=argument
            )
        return self.ids.index(map_id)


@dataclass(frozen=True, slots=True)
class KnownOfMaps:
    """Prior knowledge of a scan that is searched on several maps.

    Attributes
    ----------
    prior : SoftPrior, HardPrior or None
        Of the pose, in the frame of the map `prior_map`.
    prior_map : str or None
        Name of the map that the prior is on; required with a prior.
    map_weights : mapping of str to float or None
        Probability of maps, by name; the other maps share the rest equally. It is part of the score, and never fused.
    """

    prior: Prior | None = None
    prior_map: str | None = None
    map_weights: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        """Raise `InvalidSearchError` where the prior is none."""
        if not isinstance(self.prior, Prior | None):
            raise InvalidSearchError(f"expected a SoftPrior or a HardPrior, found {self.prior!r}", argument="prior")


NOTHING_KNOWN = KnownOfMaps()


def associate_on_maps(
    maps: MapSet,
    scan: Scan,
    known: KnownOfMaps = NOTHING_KNOWN,
    options: AssociationOptions = DEFAULT_OPTIONS,
    deadline: Deadline | None = None,
) -> AssociationResult:
    """Find on which of several maps, and where on it, a scan was taken.

    1. Put the maps into one index, far from one another.
    2. Search, rank, estimate and judge there, so that a pose on another map is an alternative as any other.
    3. Return poses and indices in the frames of their maps, and the best pose of each map.

    Parameters
    ----------
    maps : MapSet
    scan : Scan
        In the sensor's frame.
    known : KnownOfMaps
    options : AssociationOptions
        Directions are evidence if they are on all of the maps.
    deadline : Deadline or None
        Of the whole search.

    Returns
    -------
    AssociationResult
        Its `map_id` names the map of the pose. `usable` holds only if no pose on another map explains the scan about
        as well. `probability` is given that the robot is on one of the maps.

    Raises
    ------
    InvalidSearchError
        When the prior or the weights name another map, or are out of range.
    IndexingEndedError
        When the deadline passes before a scan that is wider than the maps can be searched.
    CancelledError
        When the deadline was cancelled.
    """
    until = deadline or Deadline()
    index = maps.index_for(scan, until)
    prior = _joint_prior(maps, index, known)
    # Directions count where they do on all maps; then the index is directed.
    searched = index if options.oriented and maps.oriented else index.undirected_by(until)
    oriented = replace(options, oriented=options.oriented and maps.oriented)
    # The map of the answer, and its registration there, follow from its correspondences.
    wanted = replace(oriented, include=tuple(dict.fromkeys((*options.include, "correspondences"))))
    found = run_stages(SearchContext.of(searched, scan, prior, wanted, until))
    result = in_own_frames(found, maps.ids)
    return result if "correspondences" in options.include else replace(result, correspondences=())


def _joint_prior(maps: MapSet, index: JointIndex, known: KnownOfMaps) -> Prior | MapsPrior | None:
    """Return prior knowledge in the joint frame."""
    if known.prior is not None and known.prior_map is None:
        raise InvalidSearchError(
            "the prior names no map; expected the id of the map whose frame its pose is in", argument="prior.map_id"
        )
    prior = known.prior
    if prior is not None and known.prior_map is not None:
        by = index.shifts[maps.number_of(known.prior_map, "prior.map_id")]
        prior = _moved(prior, float(by[0]), float(by[1]))
    if not known.map_weights:
        return prior
    return MapsPrior(log_weights(maps, known.map_weights), prior)


def _moved(prior: Prior, x: float, y: float) -> Prior:
    return replace(prior, pose=RigidTransform(prior.pose.x + x, prior.pose.y + y, prior.pose.theta))


def log_weights(maps: MapSet, weights: Mapping[str, float]) -> Floats:
    """Return the logarithm of each map's weight over the largest, (k,) nats, `SOFT_FLOOR` at least.

    Raises
    ------
    InvalidSearchError
        When a weight is no probability, they sum up to more than 1, or all maps have the weight 0.
    """
    given = {maps.number_of(name, f"map_weights.{name}"): weight for name, weight in weights.items()}
    for name, weight in weights.items():
        if isinstance(weight, bool) or not isinstance(weight, int | float) or not 0.0 <= weight <= 1.0:
            raise InvalidSearchError(
                f"found {weight!r}, expected a probability from 0 to 1", argument=f"map_weights.{name}"
            )
    total = math.fsum(given.values())
    if total > MOST_WEIGHT:
        raise InvalidSearchError(
            f"the weights sum up to {total:g}, expected at most 1: each is the probability of its map",
            argument="map_weights",
        )
    rest = max(0.0, 1.0 - total) / max(1, len(maps) - len(given))
    every = np.array([given.get(number, rest) for number in range(len(maps))])
    if not every.max() > 0.0:
        raise InvalidSearchError("all maps have the weight 0, expected one above it", argument="map_weights")
    with np.errstate(divide="ignore"):
        logarithms: Floats = np.maximum(SOFT_FLOOR, np.log(every / every.max()))
    return logarithms
