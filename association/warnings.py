"""What a caller should know beside the verdict: what is wrong, or strange, about the scan that was sent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from registration import Beams

from .causes import Cause, Mistake, unit_mistake
from .context import SearchContext
from .extents import extent, inner_extent
from .kernels.extents import facing_away
from .layout import POINT, as_records
from .result import AssociationWarning, SearchReport, WarningCode
from .to_scale import Factor
from .tuning import EXCEEDING, FACING, LEAST_STUCK, STUCK_SHARE
from .verdict import Verdict

# By what a scan is multiplied that was sent in them.
UNITS = {
    0.001: "millimetres",
    0.01: "centimetres",
    0.1: "decimetres",
    1000.0: "kilometres",
    0.3048: "feet",
    0.0254: "inches",
}
SENTENCES: Mapping[Mistake, str] = {
    Mistake.MIRRORED: "With left and right exchanged the scan fits much better: is the laser mounted upside down, or "
    "are its angles counted clockwise? Send its ranges in reverse order, or negate every y and exchange begin and end.",
    Mistake.REVERSED: "With begin and end of every segment exchanged the scan fits much better: free space has to lie "
    "on the left of the segments of scan and map alike. Exchange the ends of those that have it on the right, or say "
    '"oriented": false.',
}
NOT_IN_ORDER = (
    "The points are not in scanning order: once around the viewpoint in one direction, or, without a viewpoint, one "
    "next to the other. Segments are found in points that follow one another, so walls are missed. "
    "Send the points of one scan in the order in which they were measured."
)


def warnings_of(
    context: SearchContext,
    search: SearchReport,
    verdict: Verdict,
    causes: Sequence[Cause] = (),
    factor: Factor | None = None,
) -> tuple[AssociationWarning, ...]:
    """List what is strange about the scan, about the search, and about the map; then what mistakes would explain."""
    found = _of_scan(context) | {
        "prior_contradicted": "A clearly better pose lies where the prior says it should not."
        if verdict.contradicted
        else None,
        "search_incomplete": None if search.complete else _incomplete(context),
        "map_scale": None if factor is None else _off_scale(factor),
    }
    return _listed(found | {cause.mistake.code: _mistaken(cause) for cause in causes})


def warnings_of_scan(context: SearchContext) -> tuple[AssociationWarning, ...]:
    """List what is strange about the scan alone, whatever was found."""
    return _listed(_of_scan(context))


def _of_scan(context: SearchContext) -> dict[WarningCode, str | None]:
    return {
        "no_segments": _no_segments(context),
        "points_not_in_order": None if context.scan.ordered else NOT_IN_ORDER,
        **{warning.code: warning.message for warning in context.scan.warnings},
        "stuck_ranges": _stuck_ranges(context.scan.beams),
        "scan_exceeds_map": _exceeding(context),
        "faces_away": _facing_away(context),
    }


def _listed(found: Mapping[WarningCode, str | None]) -> tuple[AssociationWarning, ...]:
    return tuple(AssociationWarning(code, message) for code, message in found.items() if message is not None)


def _mistaken(cause: Cause) -> str:
    if cause.mistake is not Mistake.UNIT_SCALE:
        return SENTENCES[cause.mistake]
    unit, taken = None if cause.of_map else UNITS.get(cause.factor), unit_mistake(cause.factor)
    what = "the scan or the map is not to scale"
    if unit is not None:
        what = f"the scan seems to be in {unit}"
    elif taken is not None:
        what = f"the map seems to be in {taken}"
    return (
        f"With all lengths times {cause.factor:.4g} the scan fits much better: {what}. Send both in metres: multiply "
        "the scan by this, or divide the map."
    )


def _incomplete(context: SearchContext) -> str:
    if context.can_look:
        return "The deadline ended the search; a better pose may have been missed."
    return (
        f"Up to {context.index.most_near} walls lie in one place of the map, too many to follow lines of sight: a "
        "wrong pose may score too high. Remove segments that repeat or overlap one another from the map."
    )


def _off_scale(factor: Factor) -> str:
    return (
        f"With its lengths times {factor.value:.4f} (+-{factor.deviation:.4f}) the scan fits much better, and so it "
        "was searched: the map, or the laser's ranges, are not to scale. The pose is in the map as it is."
    )


def _no_segments(context: SearchContext) -> str | None:
    if len(context.scan.measured):
        return None
    return "The scan has no segments, so that nothing could be searched."


def _stuck_ranges(beams: Beams | None) -> str | None:
    """Tell where most of the ranges have one value: walls are never so."""
    if beams is None:
        return None
    returns = beams.ranges[np.isfinite(beams.ranges)]
    values, counts = np.unique(returns, return_counts=True)
    most = int(counts.max(initial=0))
    if most < LEAST_STUCK or most < STUCK_SHARE * len(returns):
        return None
    value = float(values[counts.argmax()])
    return (
        f"{most} of {len(returns)} ranges are {value:g} m to the digit: does the laser hang, is it covered, or does it "
        "report this value where nothing came back? Send such beams as null, or, where nothing came back, as more than "
        "range_max."
    )


def _exceeding(context: SearchContext) -> str | None:
    """Tell where the scan, but for its outermost pieces, would not fit into the box around the map."""
    segments, room = context.scan.measured.segments, context.index.diagonal
    # With its outermost pieces it is no less wide, which is sooner told.
    if extent(context.ends) <= EXCEEDING * room:
        return None
    reach = inner_extent(segments)
    if reach <= EXCEEDING * room:
        return None
    return (
        f"The scan is {reach:.3g} m wide, the map {room:.3g} m from corner to corner: is one of them not in metres, or "
        "is most of what is seen not on the map?"
    )


def _facing_away(context: SearchContext) -> str | None:
    """Tell where segments have another left, where free space is, than where the sensor stood."""
    if context.scan.viewpoint is None or not context.options.oriented:
        return None
    views = context.scan.views
    # What has no viewpoint, nan, shows its back to none.
    seen_from = context.sights.places if views is None else as_records(POINT, views.viewpoints[views.of_segment])
    away = facing_away(context.ends, seen_from, FACING)
    if not away:
        return None
    return (
        f"{away} of {len(context.ends)} segments show their back to the viewpoint, from where nobody can see them: are "
        "begin and end exchanged, or is this not the sensor's frame?"
    )
