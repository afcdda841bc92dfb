"""Several views put together to one scan, and moved to where they are found to have been."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from registration import IDENTITY, Beams, MeasuredSegments, RigidTransform, Segments

from ..errors import InvalidSearchError
from .scan import Scan, Views

Floats = NDArray[np.float64]

MAX_VIEWS = 64
MOST_VARIANCE = 100.0  # m^2 and rad^2, rounding; a step that is worse known says nothing


@dataclass(frozen=True, slots=True)
class View:
    """A scan from one place, with its pose.

    Attributes
    ----------
    scan : Scan
        In the sensor's frame, from one place.
    pose : RigidTransform
        The sensor's in the scan's frame, scan_from_view.
    covariance : (3, 3) or None
        Covariance of the step from the view `relative_to` to this one: of additive (x, y, theta) of this view's pose
        in the frame of that one. None: the step is exact.
    relative_to : int or None
        Index of that view; None: the scan's frame itself.
    motion : (3, 3) or None
        Error by a motion that is not known and that all views share, as scanners of one robot do: additive
        (x, y, theta) of this view's pose in the scan's frame, metres and radians, for one standard deviation of the
        speed along x and y and of the turn rate, by columns. Proportional to the duration of the view. Views that are
        relative to this one do not have it. Of a single view of ranges whose duration is known the turn rate does not
        count, for the walls show the rotation. None: no such error.
    """

    scan: Scan
    pose: RigidTransform = IDENTITY
    covariance: Floats | None = None
    relative_to: int | None = None
    motion: Floats | None = None


def assemble(views: Sequence[View]) -> Scan:
    """Put views together to one scan; one that is exact and in the scan's frame is that scan itself.

    Single beams are evidence where all views have them.

    Raises
    ------
    InvalidSearchError
        If there are no views, or too many, or they are relative to one another in a circle. Also if the error of a step
        has a deviation beyond 10 m or rad.
    """
    if not 1 <= len(views) <= MAX_VIEWS:
        raise InvalidSearchError(f"expected 1 to {MAX_VIEWS} views, found {len(views)}", argument="scan.views")
    for v, view in enumerate(views):
        variance = 0.0 if view.covariance is None else float(np.diag(view.covariance).max())
        if not variance <= MOST_VARIANCE:
            raise InvalidSearchError(
                f"expected variances of at most {MOST_VARIANCE:g}, found {variance:.4g}; check the units",
                argument=f"scan.views.{v}.covariance",
            )
    order = _outward(views)
    if len(views) == 1 and not _uncertain(views[0]) and views[0].motion is None and views[0].pose == IDENTITY:
        return views[0].scan
    root = np.hstack([_root(views, order), _motion_root(views)])
    with_beams = all(view.scan.beams is not None for view in views)
    beams = _together([moved_beams(view) for view in views]) if with_beams else None
    counts = [len(view.scan.measured) for view in views]
    own = [len(view.scan.beams.angles) if with_beams and view.scan.beams else 0 for view in views]
    together = Views(
        poses=tuple(view.pose for view in views),
        viewpoints=np.array([_viewpoint(view) or (math.nan, math.nan) for view in views]),
        of_segment=np.repeat(np.arange(len(views)), counts),
        of_beam=np.repeat(np.arange(len(views)), own),
        root=root,
        found=np.zeros(root.shape[1]),
        spread=np.eye(root.shape[1]),
    )
    return Scan(
        measured=_joined([moved(view.scan.measured, view.pose) for view in views]),
        viewpoint=together.viewpoint,
        beams=beams,
        views=together,
        ordered=all(view.scan.ordered for view in views),
        sweep_s=views[0].scan.sweep_s,
        warnings=tuple({one.code: one for view in reversed(views) for one in view.scan.warnings}.values()),
    )


def corrected(scan: Scan, found: Floats, spread: Floats) -> Scan:
    """Move the views of a scan to where their errors are what was `found`; `spread` is what remains of them."""
    views = scan.views
    assert views is not None
    shifts = (views.root @ (found - views.found)).reshape(-1, 3)
    poses = tuple(
        RigidTransform(p.x + x, p.y + y, p.theta + t) for p, (x, y, t) in zip(views.poses, shifts.tolist(), strict=True)
    )
    moves = [after.compose(before.inverse()) for before, after in zip(views.poses, poses, strict=True)]
    measured, beams = _each_moved(scan.measured, views.of_segment, moves), scan.beams
    places = np.array([by.apply(place) for by, place in zip(moves, views.viewpoints, strict=True)])
    if beams is not None:
        assert beams.origins is not None
        turns = np.array([by.theta for by in moves])
        origins = _points_moved(beams.origins, views.of_beam, moves)
        beams = replace(beams, angles=beams.angles + turns[views.of_beam], origins=origins)
    views = replace(views, poses=poses, viewpoints=places, found=found, spread=spread)
    return replace(scan, measured=measured, viewpoint=views.viewpoint, beams=beams, views=views)


def moved(measured: MeasuredSegments, by: RigidTransform) -> MeasuredSegments:
    """Return segments in another frame."""
    ends = by.apply(measured.segments.endpoints.reshape(-1, 2, 2)).reshape(-1, 4)
    return replace(measured, segments=Segments.derived(ends), centroids=by.apply(measured.centroids))


def moved_beams(view: View) -> Beams:
    """Return the beams of a view in the scan's frame."""
    assert view.scan.beams is not None
    return view.scan.beams.moved(view.pose, view.scan.viewpoint or (0.0, 0.0))


def _viewpoint(view: View) -> tuple[float, float] | None:
    if view.scan.viewpoint is None:
        return None
    x, y = view.pose.apply(view.scan.viewpoint)
    return float(x), float(y)


def _joined(parts: Sequence[MeasuredSegments]) -> MeasuredSegments:
    def column(name: str) -> Floats:
        return np.concatenate([getattr(part, name) for part in parts])

    segments = Segments.derived(np.concatenate([part.segments.endpoints for part in parts]))
    counted = all(part.counted for part in parts if len(part))
    return MeasuredSegments(
        segments, column("sigma"), column("point_counts"), column("centroids"), column("spreads"), counted
    )


def _together(parts: Sequence[Beams]) -> Beams:
    angles, ranges = (np.concatenate([getattr(part, name) for part in parts]) for name in ("angles", "ranges"))
    origins = np.concatenate([part.origins for part in parts if part.origins is not None])
    return Beams(angles, ranges, max(part.range_max for part in parts), origins)


def _points_moved(points: Floats, views: NDArray[np.intp], moves: Sequence[RigidTransform]) -> Floats:
    out = np.empty_like(points)
    for v, by in enumerate(moves):
        own = views == v
        out[own] = by.apply(points[own])
    return out


def _each_moved(
    measured: MeasuredSegments, views: NDArray[np.intp], moves: Sequence[RigidTransform]
) -> MeasuredSegments:
    ends = measured.segments.endpoints
    begins, finishes = (_points_moved(np.ascontiguousarray(part), views, moves) for part in (ends[:, :2], ends[:, 2:]))
    centroids = _points_moved(measured.centroids, views, moves)
    return replace(measured, segments=Segments.derived(np.hstack([begins, finishes])), centroids=centroids)


def _uncertain(view: View) -> bool:
    return view.covariance is not None and bool(np.any(view.covariance))


def _outward(views: Sequence[View]) -> list[int]:
    """Order views so that each comes after the one that it is relative to."""
    order: list[int] = []
    placed: set[int | None] = {None}
    left = list(range(len(views)))
    while left:
        ready = [v for v in left if views[v].relative_to in placed]
        if not ready:
            raise InvalidSearchError(
                "expected the index of a view that does not depend on this one; remove the cycle",
                argument=f"scan.views.{left[0]}.relative_to",
            )
        order += ready
        placed.update(ready)
        left = [v for v in left if v not in placed]
    return order


def _root(views: Sequence[View], order: Sequence[int]) -> Floats:
    """Return `Views.root`, built up step by step: the errors of a view are those of the one before it, and its step's.

    The pose is ``P_v = P_r (s + e)``, where s is the step and e its error. The first order is
    ``dt_v = dt_r + J R_r s dtheta_r + R_r e_t`` and ``dtheta_v = dtheta_r + e_theta``.
    """
    uncertain = [v for v in order if _uncertain(views[v])]
    root = np.zeros((3 * len(views), 3 * len(uncertain)))
    for v in order:
        view = views[v]
        before = view.relative_to
        own, turn = root[3 * v : 3 * v + 3], np.eye(3)
        if before is not None:
            start = views[before].pose
            c, s = math.cos(start.theta), math.sin(start.theta)
            turn[:2, :2] = [[c, -s], [s, c]]
            carried = np.eye(3)
            carried[:2, 2] = [-(view.pose.y - start.y), view.pose.x - start.x]
            own += carried @ root[3 * before : 3 * before + 3]
        if view.covariance is not None and _uncertain(view):
            k = 3 * uncertain.index(v)
            values, vectors = np.linalg.eigh(view.covariance)
            own[:, k : k + 3] += turn @ (vectors * np.sqrt(np.maximum(0.0, values)))
    return root


def _motion_root(views: Sequence[View]) -> Floats:
    """Return the columns of `Views.root` for the motion that views share; none where no view has it.

    It moves all views as one body, and as long as the longest of them lasts: an upper bound for shorter ones. So it is
    not inferred from the distance of two views, because each of them is distorted by the motion, which no root shows.
    """
    longest = max((float(view.motion[2, 2]) for view in views if view.motion is not None), default=0.0)
    if not longest:
        return np.zeros((3 * len(views), 0))
    nothing = np.zeros((3, 3))
    parts = [nothing if view.motion is None else view.motion * (longest / view.motion[2, 2]) for view in views]
    # The walls show the rotation of a single view if the order and the duration of the beams are known.
    shown = len(views) == 1 and views[0].scan.timed and views[0].scan.sweep_s is not None
    return parts[0][:, :2] if shown else np.concatenate(parts)
