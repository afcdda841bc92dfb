"""The role of each feature of the verdict: the reason that it gives, and the direction in which it counts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from ..result import ReasonCode

FOR, AGAINST, EITHER = 1, -1, 0


class Role(NamedTuple):
    """The role of a feature.

    Attributes
    ----------
    reason : str
        The reason that the decrease of a usual right answer's odds by this feature is attributed to.
    sign : int
        `FOR`: a greater value never counts against an answer. `AGAINST`: never for it. `EITHER`: as fitted.
    needs_beams : bool
        True if only a scan with ranges has it.
    """

    reason: ReasonCode
    sign: int
    needs_beams: bool = False


# A deviation or a misfit says as much of how far the walls are off as of the place: a rough map is no sign of being
# elsewhere. And the length that is matched counts next to the fraction and to what is not matched. So these are fitted
# without a sign.
ROLES: Mapping[str, Role] = {
    "lead": Role("similar_place", FOR),
    "solitude": Role("similar_place", FOR),
    "squared_solitude": Role("similar_place", EITHER),
    "critical_displacement": Role("single_wall", EITHER),
    "critical_deviation": Role("single_wall", EITHER),
    "deviation": Role("single_wall", EITHER),
    "inlier_fraction": Role("map_mismatch", FOR),
    "longest_unmatched": Role("map_mismatch", AGAINST),
    "root_unmatched_walls": Role("map_mismatch", AGAINST),
    "agreement": Role("map_mismatch", FOR),
    "root_passed": Role("map_mismatch", AGAINST, needs_beams=True),
    "root_farther": Role("map_mismatch", EITHER, needs_beams=True),
    "root_nearer": Role("map_mismatch", AGAINST, needs_beams=True),
    "root_passed_any": Role("map_mismatch", AGAINST, needs_beams=True),
    "misfit": Role("map_mismatch", EITHER),
    "misfit_of_many": Role("map_mismatch", EITHER),
    "blocked": Role("map_mismatch", AGAINST),
    "root_length": Role("insufficient_evidence", EITHER),
    "walls": Role("insufficient_evidence", FOR),
    "null": Role("not_on_map", AGAINST),
    "null_gap": Role("not_on_map", FOR),
    "null_better": Role("not_on_map", AGAINST),
}
"""By the names of `Features`, except for the constant."""

FEATURES_OF: Mapping[ReasonCode, tuple[str, ...]] = {
    reason: tuple(name for name, role in ROLES.items() if role.reason == reason)
    for reason in dict.fromkeys(role.reason for role in ROLES.values())
}
"""The features of each reason."""
