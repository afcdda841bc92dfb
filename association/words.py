"""What an answer means for a robot, in one sentence that needs no knowledge of the search."""

from __future__ import annotations

import math

from registration import wrap_angle

from .result import AssociationResult, Status

AS_WELL = 5.0  # nats below the best score, within which another pose explains a scan about as well
MOST = 99.99  # %; nothing is certain
OTHER_WAY_ROUND = 0.5 * math.pi  # rad


def message_of(result: AssociationResult) -> str:
    """Return the verdict in words.

    Parameters
    ----------
    result : AssociationResult
    """
    if result.status is Status.NO_MATCH or result.pose is None or result.diagnostics is None:
        return "Nothing on this map explains the scan."
    least = result.diagnostics.score - AS_WELL
    others = [other for other in result.alternatives if other.score >= least]
    if result.status is Status.DEGENERATE:
        theta = result.pose.theta
        turned = any(abs(wrap_angle(one.pose.theta - theta)) > OTHER_WAY_ROUND for one in others)
        which = ", nor which way round" if turned else ""
        if result.unobservable is None:
            return f"The walls that are seen do not fix where the robot is{which}."
        dx, dy = (round(part, 2) + 0.0 for part in result.unobservable)  # no negative zeros
        return f"It cannot be told where along ({dx:.2f}, {dy:.2f}) the robot is{which}."
    chance = f"{min(100.0 * (result.probability or 0.0), MOST):.2f} %"
    if result.usable:
        return f"The robot is here, with a chance of {chance}."
    if any(reason.code == "similar_place" for reason in result.reasons) and others:
        many = "1 other place explains" if len(others) == 1 else f"{len(others)} other places explain"
        return f"{many} the scan about as well: the robot cannot know which is right."
    return f"Most likely the robot is here, with a chance of {chance}, but that is not to be relied on."
