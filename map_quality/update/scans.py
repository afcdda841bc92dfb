"""Scans of several visits, and the poses that the search finds for them."""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from association import (
    AssociationOptions,
    AssociationResult,
    CancelledError,
    Deadline,
    MapIndex,
    Scan,
    SoftPrior,
    associate,
)
from registration import InputError, RigidTransform, Segments

from ..scale import Matched, errors_of, pairs_of
from . import tuning
from .result import Floats, RefusedVisit

# Warnings about the ranges or the map: such a scan may be localized, and is no evidence of where walls are.
DOUBTFUL = frozenset(("map_scale", "stuck_ranges", "scan_exceeds_map"))


# Reasons that changes of a building alone may give.
OF_OLD_MAPS = frozenset(("map_mismatch", "insufficient_evidence", "not_on_map", "single_wall"))


class UpdateError(InputError):
    """A scan cannot be evidence of a change."""


class TimeOverError(Exception):
    """The deadline has passed; what is not verified is not proposed."""


def go_on(deadline: Deadline) -> None:
    """Raise CancelledError or TimeOverError if an update has to end."""
    if deadline.cancelled:
        raise CancelledError
    if deadline.passed:
        raise TimeOverError


def blocks(rows: int, columns: int, deadline: Deadline) -> Iterator[slice]:
    """Cut a table of pairs into blocks of rows of bounded size, and look at the deadline before each."""
    step = max(1, tuning.MOST_CELLS // max(1, columns))
    for begin in range(0, rows, step):
        go_on(deadline)
        yield slice(begin, min(rows, begin + step))


@dataclass(frozen=True, slots=True, eq=False)
class VisitScan:
    """A scan with ranges, and the visit that it was taken on.

    Attributes
    ----------
    scan : Scan
        With its beams.
    visit : str
        Scans of one visit share it. A visit should be short, such as a drive or a day.
    pose : RigidTransform or None
        Pose as the sender knows it, map_from_scan; a prior of the search, which finds the pose in any case. A pose that
        is not usable, because the map is too old there, is evidence if this pose confirms it.
    covariance : (3, 3) or None
        Of additive (x, y, theta) of `pose`; required with it.
    odometry : RigidTransform or None
        odom_from_scan, in a frame that is fixed during the visit. Scans of a visit that have it are in the order of
        time. From usable scans it carries poses to others that have no `pose`.

    Raises
    ------
    UpdateError
        When the scan has no beams, or a pose comes without its covariance.
    """

    scan: Scan
    visit: str
    pose: RigidTransform | None = None
    covariance: Floats | None = None
    odometry: RigidTransform | None = None

    def __post_init__(self) -> None:
        if self.scan.beams is None or self.scan.viewpoint is None:
            raise UpdateError("found a scan without ranges, expected ranges; segments do not show free space",
                              argument="scan")  # fmt: skip
        if (self.pose is None) != (self.covariance is None):
            missing = "covariance" if self.covariance is None else "pose"
            raise UpdateError("found none, expected pose and covariance together, or neither", argument=missing)

    @property
    def prior(self) -> SoftPrior | None:
        """The stated pose as a prior."""
        return None if self.pose is None or self.covariance is None else SoftPrior(self.pose, self.covariance)


@dataclass(frozen=True, slots=True, eq=False)
class Localized:
    """A scan and its pose.

    Attributes
    ----------
    visit : int
        Number of its visit.
    sent : VisitScan
        With the pose that odometry carries to it, if any.
    result : AssociationResult
    held_back : bool
        True if it gives no evidence, and tests the new map.
    vouched : bool
        True if the sender's own pose confirms one that is not usable because of the map's age.
    contradicted : bool
        True if other usable scans of the visit contradict its pose by odometry.
    """

    visit: int
    sent: VisitScan
    result: AssociationResult
    held_back: bool
    vouched: bool = False
    contradicted: bool = False

    def searched(self, index: MapIndex, deadline: Deadline, sent: VisitScan | None = None) -> Localized:
        """Return it with the answer of a search in another map, or with another pose of the sender."""
        sent = sent or self.sent
        result = search(index, sent, deadline)
        return replace(self, sent=sent, result=result, vouched=is_vouched(sent, result))

    @property
    def scan(self) -> Scan:
        """The scan as it was sent."""
        return self.sent.scan

    @property
    def usable(self) -> bool:
        """Return whether a robot may use the answer."""
        return self.result.usable

    @property
    def located(self) -> bool:
        """Return whether its pose is known: it is usable, or the sender vouches for it."""
        return self.usable or self.vouched

    @property
    def precise(self) -> bool:
        """Return whether the pose is known well enough, without a warning about the ranges."""
        if not self.located or self.contradicted or self.result.covariance is None:
            return False
        x, y, theta = np.sqrt(np.diag(self.result.covariance))
        doubtful = any(one.code in DOUBTFUL for one in self.result.warnings)
        return bool(max(x, y) <= tuning.MOST_SIGMA and theta <= tuning.MOST_TURN_SIGMA) and not doubtful

    @property
    def pose(self) -> RigidTransform:
        """The pose of a usable scan, map_from_scan."""
        assert self.result.pose is not None
        return self.result.pose

    @property
    def score(self) -> float:
        """Of its consensus set, nats; 0 where nothing was matched."""
        return 0.0 if self.result.diagnostics is None else self.result.diagnostics.score

    @property
    def place(self) -> tuple[int, int]:
        """The square that it was taken in."""
        return math.floor(self.pose.x / tuning.PLACE), math.floor(self.pose.y / tuning.PLACE)


def by_content(scans: Iterable[VisitScan]) -> list[VisitScan]:
    """Return scans visit by visit, the visits in an order that depends on their ranges alone."""
    visits: dict[str, list[VisitScan]] = {}
    for one in scans:
        visits.setdefault(one.visit, []).append(one)
    return [one for some in sorted(visits.values(), key=_digest) for one in some]


def _digest(scans: Iterable[VisitScan]) -> bytes:
    ranges = [one.scan.beams.ranges for one in scans if one.scan.beams is not None]
    return hashlib.blake2b(np.concatenate(ranges).tobytes()).digest()


def held_back(visits: Iterable[Hashable]) -> list[bool]:
    """Return which scans are held back: one in ten of each visit, others where visits repeat a route."""
    held, places = [], dict[Hashable, Iterator[int]]()
    for visit in visits:
        first = tuning.HELD_BACK // 2 - tuning.NEXT_HELD_BACK * len(places)
        held.append(next(places.setdefault(visit, itertools.count(first))) % tuning.HELD_BACK == 0)
    return held


def search(index: MapIndex, one: VisitScan, deadline: Deadline) -> AssociationResult:
    """Search a scan in a map, with the directions that count in the index.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    options = AssociationOptions(max_alternatives=0, oriented=index.oriented, include=("correspondences",))
    return associate(index, one.scan, one.prior, options, deadline)


def is_vouched(one: VisitScan, result: AssociationResult) -> bool:
    """Return whether the sender's pose confirms a pose that is not usable for reasons that an old map gives."""
    if one.pose is None or one.covariance is None or result.pose is None or result.covariance is None:
        return False
    if not {reason.code for reason in result.reasons} <= OF_OLD_MAPS or result.usable:
        return False
    x, y, _ = np.sqrt(np.diag(one.covariance))
    square = one.pose.chi_square(result.pose, one.covariance + result.covariance)
    return bool(max(x, y) <= tuning.MOST_OWN_SIGMA and square <= tuning.AGREEING)


def choose_evidence(
    names: Sequence[str], found: Sequence[Localized], known: Segments, sigma: float
) -> tuple[list[Localized], list[RefusedVisit]]:
    """Return the scans that give evidence, and the visits that give none.

    A visit of another building has few usable scans. A laser with a wrong scale leaves residuals that grow with the
    distance of the walls.
    """
    doubts = [_doubt([one for one in found if one.visit == k], known, sigma) for k in range(len(names))]
    chosen = [one for one in found if one.precise and not one.held_back and doubts[one.visit] is None]
    return chosen, [RefusedVisit(name, why) for name, why in zip(names, doubts, strict=True) if why is not None]


def _doubt(own: Sequence[Localized], known: Segments, sigma: float) -> str | None:
    """Return why a visit gives no evidence; None if it does."""
    precise = [one for one in own if one.precise]
    sure = sum(one.usable for one in precise)
    least = max(tuning.LEAST_SCANS, math.ceil(tuning.LEAST_USABLE * len(own)))
    if sure < least:
        return (
            f"{sure} of {len(own)} scans are usable and precise, expected at least {least}. Check that the scans are "
            "from this building, and that the map shows the places where they were taken."
        )
    matched = [Matched(one.scan, one.result, pairs_of(known, one.scan, one.result)) for one in precise]
    errors = errors_of(matched, sigma)
    if errors.drawn_deviation > tuning.SURE_OF_SCALE:
        return (
            f"The scale of the scans is known to {100.0 * errors.drawn_deviation:.1f} % only, expected "
            f"{100.0 * tuning.SURE_OF_SCALE:g} %: too few walls face one another. Send more scans of this visit."
        )
    # The errors of the map's walls, too, make lengths differ.
    most = math.hypot(tuning.OFF_SCALE, tuning.DEVIATIONS * errors.scale_deviation)
    if abs(errors.scale) > most:
        return (
            f"Lengths of the scans are off by {100.0 * errors.scale:.1f} % from those of the map, expected at most "
            f"{100.0 * most:.1g} %. Check the scale of the map and of the ranges."
        )
    return None
