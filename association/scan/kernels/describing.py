"""Compiled records of a scan's lines; see `association.scan.scan_lines` for what they mean."""

import math

import numpy as np

from compiled import kernel
from registration.kernels import keep_alive
from registration.layout import INFORMATION, Records

from ...layout import SCAN_LINE, SIGHTING, Indices, Integers
from ...tables import Measured
from ...tuning import GAIN, GAIN_LENGTH, GAIN_PER_METRE, LOOSE_WALLS, MODEL_ANGLE, MODEL_OFFSET, ROUGHNESS
from ..tuning import LEAST_SPREAD, LEAST_VARIANCE
from .freedom import freedom_alone
from .joining import lines_of_a_view, longest_first


@kernel
def describe_lines(lines: Records, order: Integers, variances: Records, model: Records) -> Records:
    """Return the `lines` of a scan in `order`, (n,) of `SCAN_LINE`; `variances` and `model` (1,)."""
    given = variances[0]
    n = len(order)
    out = np.zeros(n, SCAN_LINE)
    alone = np.zeros(1, INFORMATION)
    later = 0.0
    for k in range(n - 1, -1, -1):
        line = lines[order[k]]
        one = out[k]
        spread = max(line.spread, LEAST_SPREAD)
        one.dx = line.dx
        one.dy = line.dy
        one.x = line.x
        one.y = line.y
        one.length = line.length
        one.angle = math.atan2(line.dy, line.dx)
        one.centroid_x = line.centroid_x
        one.centroid_y = line.centroid_y
        one.spread = line.spread
        offset = line.variance + given.map + MODEL_OFFSET**2
        angle = (line.variance + given.common) / spread + MODEL_ANGLE**2
        one.offset_variance = max(given.least_offset, offset + line.common_offset)
        one.angle_variance = max(given.least_angle, angle + line.common_angle)
        common = max(line.common_offset, line.common_angle * spread)
        one.weight = 1.0 / max(line.variance + ROUGHNESS**2 + common, given.least_angle * spread)
        one.gain = GAIN + GAIN_PER_METRE * min(line.covered, GAIN_LENGTH)
        if common > 0.0:
            # Matches in wider gates occur by chance more often: such a match gains less.
            one.gain = max(0.0, one.gain - 0.5 * math.log1p(line.common_offset / offset))
            one.gain = max(0.0, one.gain - 0.5 * math.log1p(line.common_angle / angle))
        one.later_gain = later
        # The models of the verdict were fitted to maps of unknown deviation: a declared one would let any misfit up to
        # it pass as expected. Beyond the deviations that they were fitted to it does.
        beyond = max(0.0, given.map - LOOSE_WALLS**2)
        one.plain_variance = max(LEAST_VARIANCE, line.variance + beyond + line.common_offset)
        one.freedom = freedom_alone(one, model[0], alone[0])
        later += one.gain
    keep_alive(alone)
    return out


@kernel
def set_map_sigma(sigma: float, variances: Records, model: Records) -> None:
    """Write the terms that follow from the deviation of the map's lines, metres, to both, (1,) each.

    If the tolerance is wider, the map is taken to be that far off.
    """
    given = variances[0]
    given.map = sigma * sigma
    model[0].wall_variance = max(given.map + (MODEL_OFFSET**2 - ROUGHNESS**2), given.least_offset)


@kernel
def describe_labelled(labels: Integers, lines: Records, variances: Records, model: Records) -> tuple[Indices, Records]:
    """Order lines by their information; return the row of each part that is labelled, and the rows."""
    order = longest_first(lines)
    place = np.empty(len(order), np.int64)
    for k in range(len(order)):
        place[order[k]] = k
    row_of = np.empty(len(labels), np.int64)
    for i in range(len(labels)):
        row_of[i] = place[labels[i]]
    return row_of, describe_lines(lines, order, variances, model)


@kernel
def seen_at_once(rows: Records) -> Records:
    """Return the parts of the rows that one view shows: each of them, in their order, (n,) of `SIGHTING`."""
    seen = np.zeros(len(rows), SIGHTING)
    for i in range(len(rows)):
        seen[i].row = i
        seen[i].dx = rows[i].dx
        seen[i].dy = rows[i].dy
        seen[i].x = rows[i].x
        seen[i].y = rows[i].y
        seen[i].length = rows[i].length
    return seen


@kernel
def describe_view(
    measured: Measured, counted: bool, directed: bool, variances: Records, model: Records
) -> tuple[Indices, Records, Records]:
    """Return the row of each segment of a scan of one view, the rows, and the parts of them that are seen."""
    labels, lines = lines_of_a_view(measured, counted, directed)
    row_of, rows = describe_labelled(labels, lines, variances, model)
    return row_of, rows, seen_at_once(rows)


@kernel
def mirror_lines(rows: Records) -> tuple[Records, Records]:
    """Return the rows of the scan with left and right exchanged, and the parts of them that one view shows.

    Then y is -y, and free space stays on the left.
    """
    out = np.copy(rows)
    for i in range(len(rows)):
        out[i].dx = -rows[i].dx
        out[i].y = -rows[i].y
        out[i].centroid_y = -rows[i].centroid_y
        out[i].angle = math.atan2(out[i].dy, out[i].dx)
    return out, seen_at_once(out)
