"""One association from request models to the contract's answer; runs in a search thread."""

from __future__ import annotations

import time
from typing import Any

from association import CancelledError, Deadline, associate

from ..admission.gate import too_late
from ..maps import CachedMap
from ..schemas.parts import (
    HardPriorFields,
    InlineMap,
    LaserScan,
    PointScan,
    SearchOptions,
    SegmentScan,
    SoftPriorFields,
    StoredMap,
)
from ..telemetry.metrics import Metrics
from .answers import association_json
from .inputs import association_options_of, prior_of, scanned_of

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
