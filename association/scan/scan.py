"""The scan of a robot: segments and beams, from one place or from several."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from registration import Beams, MeasuredSegments, RigidTransform, Segments

from ..result import AssociationWarning
from .tuning import VIEWS_APART

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

MIRROR = np.array([1.0, -1.0])
_MIRRORED_ERROR = np.array([1.0, -1.0, -1.0])  # of (x, y, theta)


@dataclass(frozen=True, slots=True)
class Views:
    """The places from which a scan was put together.

    Attributes
    ----------
    poses : tuple of RigidTransform
        scan_from_view, as far as it is known.
    viewpoints : (v, 2)
        Position of each sensor, metres in the scan frame; nan where the view is not from one place.
    of_segment, of_beam : (n,), (m,)
        The view of each segment and of each beam.
    root : (3 v, u)
        Uncertainty of the poses: their errors, of additive (x, y, theta) in the scan frame, are `root` times u
        independent standard normal variates. No columns where all are exact.
    found : (u,)
        The estimates of these variates, as far as the poses already include them.
    spread : (u, u)
        Covariance of the variates that remains.
    """

    poses: tuple[RigidTransform, ...]
    viewpoints: Floats
    of_segment: Indices
    of_beam: Indices
    root: Floats
    found: Floats
    spread: Floats

    def __len__(self) -> int:
        return len(self.poses)

    @property
    def viewpoint(self) -> tuple[float, float] | None:
        """The position of the first view that is from one place; None where none is."""
        known = self.viewpoints[~np.isnan(self.viewpoints[:, 0])]
        return (float(known[0, 0]), float(known[0, 1])) if len(known) else None

    @property
    def uncertain(self) -> bool:
        """Return whether any pose is not exact."""
        return bool(self.root.shape[1] > 0)

    @property
    def covariance(self) -> Floats:
        """Of the errors that remain, (3 v, 3 v)."""
        return self.root @ self.spread @ self.root.T

    @property
    def weights(self) -> Floats:
        """The weight of each view, (v,): one, or less where others see from the same place, so that these count as one.

        Views without a viewpoint count fully.
        """
        gaps = self.viewpoints[:, None] - self.viewpoints
        squares = np.einsum("ijk,ijk->ij", gaps, gaps) / (2.0 * VIEWS_APART**2)
        near = np.where(np.isnan(squares), np.eye(len(self)), np.exp(-squares))
        return np.asarray(1.0 / near.sum(axis=1))

    def mirrored(self) -> Views:
        """Return them with left and right exchanged."""
        poses = tuple(RigidTransform(p.x, -p.y, -p.theta) for p in self.poses)
        root = self.root * np.tile(_MIRRORED_ERROR, len(self))[:, None]
        return replace(self, poses=poses, viewpoints=self.viewpoints * MIRROR, root=root)

    def scaled(self, factor: float) -> Views:
        """Return them with all lengths multiplied."""
        poses = tuple(RigidTransform(p.x * factor, p.y * factor, p.theta) for p in self.poses)
        root = self.root * np.tile([factor, factor, 1.0], len(self))[:, None]
        return replace(self, poses=poses, viewpoints=self.viewpoints * factor, root=root)

    def blind(self) -> Views:
        """Return them without lines of sight and beams."""
        return replace(self, viewpoints=np.full_like(self.viewpoints, np.nan), of_beam=self.of_beam[:0])


@dataclass(frozen=True, slots=True)
class Scan:
    """The scan of a robot, in the sensor's frame; of several views, in the frame that they share.

    Attributes
    ----------
    measured : MeasuredSegments
    viewpoint : (float, float) or None
        Position of the sensor, metres. None if the segments were not seen from one place; lines of sight are then no
        evidence. Of several views it is that of the first that has one.
    beams : Beams or None
        The raw ranges, where the scan came as such; they start at `viewpoint`, or at an origin of their own.
    views : Views or None
        The views that it was put together from, if there are several.
    ordered : bool
        True unless the scan was made of points that are not in scanning order.
    warnings : tuple of AssociationWarning
        Defects of how it was taken; each answer has them.
    sweep_s : float or None
        Seconds from the first beam to the last, during which the sensor may have turned; 0 if its motion is known and
        corrected, or none; None if the duration is not known, and the scan is taken for one of a moment.
    frame_id : str or None
        Name of its frame.
    stamp : any
        When it was taken, in any form; the answer repeats it.
    """

    measured: MeasuredSegments
    viewpoint: tuple[float, float] | None = (0.0, 0.0)
    beams: Beams | None = None
    views: Views | None = None
    ordered: bool = True
    warnings: tuple[AssociationWarning, ...] = ()
    sweep_s: float | None = None
    frame_id: str | None = None
    stamp: Any = None

    @property
    def timed(self) -> bool:
        """Return whether it is known in which order its points were seen, while the sensor may have turned."""
        one = self.views is None or len(self.views) == 1
        return one and self.beams is not None and self.ordered and len(self.beams.angles) > 1 and self.sweep_s != 0.0

    @property
    def moment(self) -> float:
        """The share of the sweep at which the pose is: that of the first beam, or one of a moment, the middle."""
        return 0.5 if self.sweep_s is None else 0.0


def mirrored(scan: Scan, *, segments: bool = True) -> Scan:
    """Return a scan with left and right exchanged: y becomes -y, and free space stays on the left.

    Without its `segments` for a caller that has them otherwise.
    """
    at, views = scan.viewpoint, scan.views
    beams = None if scan.beams is None else scan.beams.mirrored()
    seen = scan.measured
    measured = replace(seen, segments=seen.segments.mirrored(), centroids=seen.centroids * MIRROR)
    measured = measured if segments else MeasuredSegments.from_segments(Segments.from_array(()))
    at, views = at and (at[0], -at[1]), views and views.mirrored()
    return replace(scan, measured=measured, viewpoint=at, beams=beams, views=views)


def turned_round(scan: Scan) -> Scan:
    """Return a scan whose segments begin where they ended.

    The segments then face away from the viewpoint; if the scan came as ranges, the map is the wrong way round. So
    neither beams nor lines of sight count.
    """
    ends = scan.measured.segments.endpoints[:, [2, 3, 0, 1]]
    measured = replace(scan.measured, segments=Segments.derived(ends))
    return Scan(measured, None, None, scan.views and scan.views.blind(), warnings=scan.warnings)


def scaled(scan: Scan, factor: float) -> Scan:
    """Return a scan of which all lengths are multiplied."""
    seen, at, beams, views = scan.measured, scan.viewpoint, scan.beams, scan.views
    measured = replace(
        seen,
        segments=Segments.derived(seen.segments.endpoints * factor),
        sigma=seen.sigma * factor,
        centroids=seen.centroids * factor,
        spreads=seen.spreads * factor**2,
    )
    place = at and (at[0] * factor, at[1] * factor)
    views = views and views.scaled(factor)
    return replace(scan, measured=measured, viewpoint=place, beams=beams and beams.scaled(factor), views=views)


def shifted(scan: Scan, by: Floats) -> Scan:
    """Return a scan of one place, moved in its frame by (2,) metres."""
    seen, at, beams = scan.measured, scan.viewpoint, scan.beams
    ends = Segments.derived(seen.segments.endpoints + np.tile(by, 2))
    measured = replace(seen, segments=ends, centroids=seen.centroids + by)
    if beams is not None and beams.origins is not None:
        beams = replace(beams, origins=beams.origins + by)
    place = at and (at[0] + float(by[0]), at[1] + float(by[1]))
    return replace(scan, measured=measured, viewpoint=place, beams=beams)


def corrected_scan(scan: Scan, factor: float, turn: float) -> Scan:
    """Return a scan with its lengths from the sensor times a factor, and turned back by how its sensor turned.

    The sensor's place, or the origin if that is not known, stays.

    Parameters
    ----------
    scan : Scan
        Of one place.
    factor : float
    turn : float
        Radians from the first beam to the last.
    """
    sensor = np.array(scan.viewpoint or (0.0, 0.0))
    if factor != 1.0:
        scan = shifted(scaled(scan, factor), (1.0 - factor) * sensor)
    if turn == 0.0 or scan.beams is None:
        return scan
    first, last = float(scan.beams.angles[0]), float(scan.beams.angles[-1])
    centre, way, sweep = sensor, math.copysign(1.0, last - first), abs(last - first)

    def turned(points: Floats) -> Floats:
        """Turn points by when they were seen."""
        away = points - centre
        bearings = way * (np.arctan2(away[:, 1], away[:, 0]) - first) % math.tau
        angles = turn * (bearings / sweep - scan.moment)
        c, s = np.cos(angles), np.sin(angles)
        back = np.stack([c * away[:, 0] - s * away[:, 1], s * away[:, 0] + c * away[:, 1]], axis=1)
        return np.asarray(back + centre)

    seen = scan.measured
    # A line through the sensor's sweep is seen bent: its middle and its ends are turned by the time of each.
    begins, finishes = turned(seen.segments.endpoints[:, :2]), turned(seen.segments.endpoints[:, 2:])
    measured = replace(seen, segments=Segments.derived(np.hstack([begins, finishes])), centroids=turned(seen.centroids))
    angles = scan.beams.angles + turn * (np.abs(scan.beams.angles - first) / sweep - scan.moment)
    return replace(scan, measured=measured, beams=replace(scan.beams, angles=angles))
