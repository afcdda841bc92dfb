"""One association from request models to the contract's answer; runs in a search thread."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from association import AssociationResult, CancelledError, Deadline, MapIndex, associate
from registration import MeasuredSegments, RegistrationOptions, register

from .answers import association_json
from .gate import too_late
from .inputs import association_options_of, prior_of, scanned_of
from .maps import CachedMap
from .metrics import Metrics
from .schemas.parts import (
    HardPriorFields,
    InlineMap,
    LaserScan,
    PointScan,
    SearchOptions,
    SegmentScan,
    SoftPriorFields,
    StoredMap,
)

AskedScan = SegmentScan | LaserScan | PointScan
AskedPrior = SoftPriorFields | HardPriorFields | None


def search(
    cached: CachedMap, asked: tuple[AskedScan, AskedPrior, SearchOptions], deadline: Deadline, metrics: Metrics
) -> dict[str, Any]:
    """Find a scan in a map.

    Raises
    ------
    ProblemError
        When the deadline has passed before the search starts.
    CancelledError
        When the client has gone.
    """
    asked_scan, prior, options = asked
    scanned = scanned_of(asked_scan)
    if deadline.cancelled:
        raise CancelledError
    if deadline.passed:
        raise too_late()
    begun = time.perf_counter()
    result = associate(cached.index, scanned.scan, prior_of(prior), association_options_of(options), deadline)
    if options.estimator == "one_step":
        result = _by_one_step(result, cached.index, scanned.scan.measured, options)
    seconds = time.perf_counter() - begun
    metrics.observe_association(str(result.status), result.usable, seconds, result.search.hypotheses)
    answer = association_json(result, frozenset(options.include))
    answer["frame_id"] = cached.frame_id
    answer["child_frame_id"] = asked_scan.frame_id
    answer["stamp"] = asked_scan.stamp
    if "segments" in options.include:
        answer["segments"] = None if scanned.segments is None else scanned.segments.tolist()
    return answer


def map_reference(asked: InlineMap | StoredMap, revision: int | None) -> dict[str, Any] | None:
    """Return which stored map was searched."""
    return {"map_id": asked.map_id, "revision": revision} if isinstance(asked, StoredMap) else None


def _by_one_step(
    result: AssociationResult, index: MapIndex, measured: MeasuredSegments, options: SearchOptions
) -> AssociationResult:
    """Estimate the pose of the accepted pairs anew by the paper's closed form, which has no covariance."""
    if result.pose is None or result.diagnostics is None:
        return result
    pairs = np.array([(pair.scan, pair.map) for pair in result.correspondences], dtype=np.intp).reshape(-1, 2)
    how = RegistrationOptions(
        estimator="one_step",
        rotation=options.rotation,
        oriented=options.oriented,
        weights=[pair.weight for pair in result.correspondences],
    )
    again = register(index.segments, measured, pairs, index.sigma, how)
    if again.pose is None:
        return result
    rows = zip(result.correspondences, again.offsets.tolist(), again.angles.tolist(), strict=True)
    return replace(
        result,
        pose=again.pose,
        covariance=None,
        correspondences=tuple(replace(pair, offset=offset, angle=angle) for pair, offset, angle in rows),
        diagnostics=replace(result.diagnostics, registration=again.diagnostics),
    )
