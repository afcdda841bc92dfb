"""Results about maps to the JSON documents of the API: checks, analyses and imports."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from association import Status
from map_quality import Analysis, Change, Finding, MapCheck, MapUpdate, PlaceVerdict, Sample

from .answers import Json, direction_json, pose_json
from .checking import CheckedMap

if TYPE_CHECKING:
    from formats import ImportedMap, LineMap

MOST_INDICES = 1000  # of one finding


def map_json(line_map: LineMap) -> Json:
    """Return a map as a map document; one without points does not mention them."""
    document = line_map.document
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in document.items()}


def import_json(imported: ImportedMap, found: MapCheck) -> Json:
    """Return the answer of an import: the map, the report of its files, and its doubtful parts."""
    return {"map": map_json(imported.map), "report": asdict(imported.report), "check": check_json(found)}


def check_json(found: MapCheck) -> Json:
    """Return the check of a map without scans as JSON."""
    return {
        "findings": [_finding_json(one) for one in found.findings],
        "size": {name: getattr(found.size, name) for name in ("segment_count", "walls", "length", "diagonal")},
        "advice": {"sigma": found.advice.sigma, "oriented": found.advice.oriented},
        "places": [{"pose": pose_json(one.pose), "similar_pose": pose_json(one.similar_pose)} for one in found.places],
        "viewpoints": found.viewpoints,
        "complete": found.complete,
    }


def checked_json(checked: CheckedMap) -> Json:
    """Return the answer of a check; its ``samples`` are null without sample scans."""
    samples, report = None, checked.report
    if report is not None:
        samples = {
            "usable": report.usable,
            "usable_as_advised": report.usable_as_advised,
            "wall_thickness": report.wall_thickness,
            "scans": [_sample_json(number, one) for number, one in enumerate(checked.samples)],
        }
    return {**check_json(checked.all), "samples": samples}


def analysis_json(analysis: Analysis, found: Mapping[int, PlaceVerdict | None]) -> Json:
    """Return the answer of an analysis; `found` by the poses' numbers, None where no robot can stand."""
    verdicts = [one for _, one in sorted(found.items()) if one is not None]
    by_status, tried = Counter(one.status for one in verdicts), len(analysis.standing.order)
    return {
        "places": [_place_json(one) for one in verdicts],
        "summary": {
            "places": len(verdicts),
            "usable": sum(one.usable for one in verdicts),
            **{str(one): by_status[one] for one in (Status.OK, Status.AMBIGUOUS, Status.DEGENERATE, Status.NO_MATCH)},
            "similar_pose": sum(one.similar_pose is not None for one in verdicts),
            "resolved_within": sum(one.resolved_after is not None for one in verdicts) if analysis.drive else None,
            "usable_with_landmark": None
            if analysis.landmark is None
            else sum(one.with_landmark is not None and one.with_landmark.usable for one in verdicts),
            "not_free": len(found) - len(verdicts),
            "left_out": tried - len(found),
        },
        "spacing": analysis.standing.spacing,
        "complete": len(found) == tried,
    }


def update_json(update: MapUpdate, document: Mapping[str, Any]) -> Json:
    """Return the answer of an update; `document` is the old map, whose frame and notes the new one has."""
    changed = {"segments": update.segments.endpoints.tolist(), "sigma": update.sigma}
    pairs = zip(update.changes, update.accepted, strict=True)
    return {
        "map": {**document, **changed},
        "changes": [_change_json(one, accepted=accepted) for one, accepted in pairs],
        "scans": update.usable.scans + update.held_back.scans,
        "usable_before": update.usable.before + update.held_back.before,
        "usable_after": update.usable.after + update.held_back.after,
        "held_back": {
            "scans": update.held_back.scans,
            "usable_before": update.held_back.before,
            "usable_after": update.held_back.after,
        },
        "sharpened": {
            "segments": update.sharpened.segments.tolist(),
            "ends": update.sharpened.ends.tolist(),
            "sigma": update.sharpened.sigma.tolist(),
        },
        "refused_visits": [asdict(one) for one in update.refused_visits],
        "complete": update.complete,
    }


def _change_json(one: Change, *, accepted: bool) -> Json:
    told = one.evidence
    return {
        "code": one.code,
        "segments": list(one.segments),
        "new": [
            {"segment": ends, "sigma": sigma} for ends, sigma in zip(one.new.tolist(), one.sigma.tolist(), strict=True)
        ],
        "evidence": {
            "beams_through": told.beams_through,
            "beams_on": told.beams_on,
            "poses": told.poses,
            "visits": told.visits,
            "from": told.first,
            "to": told.last,
        },
        "confidence": one.confidence,
        "accepted": accepted,
    }


def _finding_json(finding: Finding) -> Json:
    return {
        "code": finding.code,
        "message": finding.message,
        "segments": list(finding.segments[:MOST_INDICES]),
        "count": len(finding.segments),
    }


def _sample_json(number: int, one: Sample | None) -> Json:
    if one is None:
        return {"index": number, "status": None, "usable": False, "pose": None}
    status, usable = str(one.result.status), one.result.usable
    return {"index": number, "status": status, "usable": usable, "pose": pose_json(one.result.pose)}


def _place_json(one: PlaceVerdict) -> Json:
    return {
        "pose": pose_json(one.pose),
        "status": str(one.status),
        "usable": one.usable,
        "probability": one.probability,
        "similar_pose": pose_json(one.similar_pose),
        "unobservable": direction_json(one.unobservable),
        "reasons": list(one.reasons),
        "resolved_after": one.resolved_after,
        "with_landmark": _with_landmark_json(one.with_landmark),
    }


def _with_landmark_json(one: PlaceVerdict | None) -> dict[str, Any] | None:
    if one is None:
        return None
    return {"status": str(one.status), "usable": one.usable, "probability": one.probability}
