"""The verdict of an answer in one or two sentences, without terms of the search."""

from __future__ import annotations

import math
from collections.abc import Sequence

from registration import wrap_angle

from .result import Alternative, AssociationResult, Status

AS_WELL = 5.0  # nats below the best score, within which another pose explains a scan about as well
MOST = 99.99  # %; nothing is certain
OTHER_WAY_ROUND = 0.5 * math.pi  # rad


def message_of(result: AssociationResult) -> str:
    """Return the verdict in words."""
    if result.status is Status.NO_MATCH or result.pose is None or result.diagnostics is None:
        return f"No pose on {'these maps' if result.maps else 'this map'} explains the scan."
    least = result.diagnostics.score - AS_WELL
    others = [other for other in result.alternatives if other.score >= least]
    if result.status is Status.DEGENERATE:
        theta = result.pose.theta
        turned = any(abs(wrap_angle(one.pose.theta - theta)) > OTHER_WAY_ROUND for one in others)
        which = ", and the heading may be reversed" if turned else ""
        if result.unobservable is None:
            return f"The observed walls do not fix the robot's position{which}."
        dx, dy = (round(part, 2) + 0.0 for part in result.unobservable)  # no negative zeros
        return f"The position along the direction ({dx:.2f}, {dy:.2f}) is unknown{which}."
    chance = f"{min(100.0 * (result.probability or 0.0), MOST):.2f} %"
    if result.usable:
        on_map = f" on the map {result.map_id}" if result.maps else ""
        return f"The robot is at this pose{on_map} with a probability of {chance}."
    if any(reason.code == "similar_place" for reason in result.reasons) and others:
        many = "1 other pose fits" if len(others) == 1 else f"{len(others)} other poses fit"
        return f"{many} the scan about as well{_where(result, others)}. The scan alone does not decide between them."
    return f"The most likely pose has a probability of {chance}, which is not enough: see `reasons`."


def _where(result: AssociationResult, others: Sequence[Alternative]) -> str:
    """Name the other map that other poses are on, or the number of maps; nothing where all are on the answer's map."""
    maps = sorted({other.map_id for other in others if other.map_id is not None} - {result.map_id})
    if not maps:
        return ""
    return f", on the map {maps[0]}" if len(maps) == 1 else f", on {len(maps)} other maps"
