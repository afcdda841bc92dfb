"""Warnings next to the verdict: mistakes and oddities of the scan that was sent."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from registration import Beams

from .consensus.estimator import Estimate
from .context import SearchContext
from .explanations import Answer, Explanations
from .result import AssociationWarning, SearchReport, WarningCode
from .scan.extents import facing_away, inner_extent
from .tuning import (
    DOUBTING_DEVIATIONS,
    EXCEEDING,
    FACING,
    FARTHEST,
    LARGEST_MAP,
    LEAST_FACTOR,
    LEAST_OFF_WALLS,
    LEAST_STUCK,
    STUCK_SHARE,
)
from .verdict.verdict import Verdict

NOT_IN_ORDER = (
    "The points are not in scanning order, so walls are missed: segments are extracted from consecutive points. "
    "Expected is one turn around the viewpoint in one direction or, without a viewpoint, neighbour after neighbour. "
    "Send the points of one scan in the order in which they were measured."
)
TOO_LARGE = (
    "The map's diagonal is {:.0f} m, expected at most {:.0f} m: the map seems to be in millimetres. Divide its "
    "coordinates by 1000; a drawing, import it again with its unit (`--units mm`)."
)
NO_SEGMENTS = "The scan has no segments, so nothing was searched. Check the ranges, and the least length of segments."


def warnings_of(context: SearchContext, search: SearchReport, verdict: Verdict) -> tuple[AssociationWarning, ...]:
    """List the warnings about scan and search."""
    room = context.index.diagonal
    found: dict[WarningCode, str | None] = {
        "no_segments": None if len(context.scan.measured) else NO_SEGMENTS,
        "points_not_in_order": None if context.scan.ordered else NOT_IN_ORDER,
        **{warning.code: warning.message for warning in context.scan.warnings},
        "stuck_ranges": _stuck_ranges(context.scan.beams),
        "scan_exceeds_map": _exceeding(context),
        "unlikely_map_size": None if verdict.usable or room <= LARGEST_MAP else TOO_LARGE.format(room, LARGEST_MAP),
        "faces_away": _facing_away(context),
        "prior_contradicted": "A clearly better pose lies where the prior excludes it. Check the prior, or search "
        "without it."
        if verdict.contradicted
        else None,
        "search_incomplete": None if search.complete else _incomplete(context),
    }
    return _listed(found)


def warnings_of_map(
    context: SearchContext, explanations: Explanations, answer: Answer
) -> tuple[AssociationWarning, ...]:
    """List the warnings about the map around an answer, and about a sensor that turned."""
    found = answer.estimate
    return _listed(
        {
            "map_scale": None if explanations.scale == 1.0 else _off_scale(explanations.scale, found),
            "common_offset": _offset(found, context.index.sigma or 0.0),
            "map_distorted": _distorted(found),
            "turned": _turned(context, explanations, found),
        }
    )


def _listed(found: Mapping[WarningCode, str | None]) -> tuple[AssociationWarning, ...]:
    return tuple(AssociationWarning(code, message) for code, message in found.items() if message is not None)


def _incomplete(context: SearchContext) -> str:
    if context.can_look:
        return (
            "The deadline ended the search; a better pose may have been missed. Extend the deadline, or send a prior."
        )
    return (
        f"Up to {context.index.most_near} walls lie in one place of the map, too many to compute lines of sight: a "
        "wrong pose may score too high. Remove repeated and overlapping segments from the map."
    )


def _off_scale(scale: float, found: Estimate) -> str:
    deviation = 0.5 * math.hypot(*found.strain[1][:2].tolist())
    return (
        f"The scan fits much better with its lengths times {scale:.4f} (+-{deviation:.4f}), and was "
        "searched with this factor. The pose is in the unscaled map. Check the scale of the map and of the ranges."
    )


def _offset(found: Estimate, sigma: float) -> str | None:
    """Describe an offset of all walls that is beyond noise, and greater than the map's sigma."""
    offset, deviation = found.offset
    if not found.with_columns or abs(offset) <= max(sigma, LEAST_OFF_WALLS, DOUBTING_DEVIATIONS * deviation):
        return None
    side = "nearer to the sensor" if offset > 0.0 else "farther from the sensor"
    return (
        f"All walls are {100.0 * abs(offset):.1f} cm (+-{100.0 * deviation:.1f} cm) {side} than the map "
        "has them. The pose is corrected for this offset. Check the range bias of the laser, and whether the map has "
        "the faces of walls or their centre lines."
    )


def _distorted(found: Estimate) -> str | None:
    """Describe a distortion that is beyond doubt, and as great as a factor that a scan would be searched with."""
    if not found.with_columns:
        return None
    xx, yy, xy = found.strain[0].tolist()
    along, strain = 0.5 * math.atan2(2.0 * xy, xx - yy), 2.0 * math.hypot(0.5 * (xx - yy), xy)
    deviation = math.hypot(*found.strain[1].tolist())
    if not strain >= max(LEAST_FACTOR, DOUBTING_DEVIATIONS * deviation):
        return None
    return (
        f"The map is distorted here: along {math.degrees(along):.0f} degrees it is "
        f"{100.0 * strain:.1f} % (+-{100.0 * deviation:.1f} %) longer than across. The pose is "
        "corrected for this. Check the map against the building, or survey the building again."
    )


def _turned(context: SearchContext, explanations: Explanations, found: Estimate) -> str | None:
    """Describe a rotation of the sensor during the scan."""
    turn = explanations.shown_turn
    if not turn:
        return None
    at = "in the middle of the scan" if context.scan.sweep_s is None else "at the first beam"
    return (
        f"The sensor turned by {math.degrees(turn):.1f} degrees (+-{math.degrees(found.turn[1]):.1f}) during the scan, "
        f"as the walls show it. The pose is corrected for this, and is that {at}. Send `twist` and "
        "`time_increment`, or check `angle_increment`."
    )


def _stuck_ranges(beams: Beams | None) -> str | None:
    """Describe ranges most of which have one value; ranges to walls never do."""
    if beams is None:
        return None
    returns = beams.ranges[np.isfinite(beams.ranges)]
    values, counts = np.unique(returns, return_counts=True)
    most = int(counts.max(initial=0))
    if most < LEAST_STUCK or most < STUCK_SHARE * len(returns):
        return None
    value = float(values[counts.argmax()])
    return (
        f"{most} of {len(returns)} ranges are exactly {value:g} m. The laser may be stuck or covered, or it may report "
        "this value where it has no return. Send beams without a return as more than `range_max`, and faulty ones as "
        "null."
    )


def _exceeding(context: SearchContext) -> str | None:
    """Describe a scan that, without its outermost pieces, is larger than the box around the map."""
    segments, room = context.scan.measured.segments, context.index.diagonal
    # The box around it is no less wide, and that is computed faster.
    if not len(segments) or np.hypot(*np.ptp(segments.endpoints.reshape(-1, 2), axis=0)) <= EXCEEDING * room:
        return None
    reach = inner_extent(segments)
    if reach <= EXCEEDING * room:
        return None
    wide = f"The scan is {reach:.1f} m wide, but the map's diagonal is only {room:.1f} m."
    if reach > FARTHEST:
        return f"{wide} No laser sees so far: the scan seems to be in millimetres or centimetres. Send it in metres."
    return f"{wide} Check that the scan is in metres, that the map is, and that it contains this place."


def _facing_away(context: SearchContext) -> str | None:
    """Describe segments whose free side, the left, is not the side of the sensor."""
    if context.scan.viewpoint is None or not context.options.oriented:
        return None
    views = context.scan.views
    # A segment without a viewpoint, nan, does not face away from any.
    places = context.viewpoints if views is None else context.viewpoints[views.of_segment]
    ends = context.scan.measured.segments.endpoints
    away = facing_away(ends, places, FACING)
    if not away:
        return None
    return (
        f"{away} of {len(ends)} segments have the viewpoint on their right, but a sensor sees only their left "
        "side. Exchange their begin and end, or check that they are in the sensor's frame."
    )
