"""Reasons why an answer is not usable: a code for programs and a message for people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from registration.values import value

from ..result import Reason, ReasonCode, Status
from .features import Features
from .models import USUAL, Model
from .tuning import NO_ALTERNATIVE, TELLING_REASON


@value(frozen=True, slots=True)
class Doubts:
    """Evidence against an answer, except for its features.

    Attributes
    ----------
    status : Status
    complete, contradicted : bool
        True if the search was complete; true if the prior contradicts the answer.
    not_on_map : bool
        True if there is little evidence for this map at all.
    few_walls : bool
        True if few walls fix the pose, and one of them alone decides.
    similar_place : bool
        True if alternatives alone make the answer too uncertain.
    alone : bool
        True if no other explanation was found where the prior allows one.
    mirrored : bool
        True if the scan fits the map better with left and right exchanged.
    out_of_step : bool
        True if the view from the scan's own place fits far worse than the views on the way.
    off_scale : bool
        True if scan and map differ by a factor that is too great to be corrected.
    """

    status: Status
    complete: bool
    contradicted: bool
    not_on_map: bool
    few_walls: bool = False
    similar_place: bool = False
    alone: bool = False
    mirrored: bool = False
    out_of_step: bool = False
    off_scale: bool = False


INCOMPLETE: Literal["search_incomplete"] = "search_incomplete"
SENTENCES: Mapping[ReasonCode, str] = {
    "prior_contradicted": "The pose that the scan supports contradicts the prior. Check the prior, or search without "
    "it.",
    INCOMPLETE: "The search is incomplete: the deadline passed, or too many walls of the map lie in one place. A "
    "better pose may have been missed. Extend the deadline, or see `warnings`.",
    "unobservable_direction": "The observed walls do not fix the position along one direction (`unobservable`). Move "
    "until other walls are in view, and scan again.",
    "not_on_map": "The scan fits this map no better than an unrelated scan would. The robot may be in a place that "
    "the map does not contain.",
    "similar_place": "Another pose fits the scan about as well: see `alternatives`. Send a prior, or move and scan "
    "again.",
    "single_wall": "The pose depends on a single wall (`critical_wall`). Move and scan again.",
    "map_mismatch": "The scan and the map differ: much of the scan is not on the map, or mapped walls are not in the "
    "scan. Check that the map is up to date.",
    "insufficient_evidence": "The scan has too few walls to distinguish this place from others. Move and scan again.",
}

MIRRORED = (
    "The scan fits this map better with left and right exchanged. Check whether the laser is mounted upside down, and "
    "whether this is the right map."
)
OFF_SCALE = (
    "The scan fits this map better with its lengths changed by more than 4 %. Check that scan and map are in metres, "
    "and that this is the right map."
)

# The features of each reason. The decrease of a usual right answer's odds by a feature is attributed to its reason.
FEATURES_OF: Mapping[ReasonCode, tuple[str, ...]] = {
    "similar_place": ("lead", "solitude", "squared_solitude"),
    "single_wall": ("critical_displacement", "critical_deviation", "deviation"),
    "map_mismatch": (
        "inlier_fraction", "beyond_nearly_all", "longest_unmatched", "root_unmatched", "agreement", "read", "passed",
        "root_farther", "root_nearer", "misfit", "misfit_of_many", "blocked",
    ),
    "insufficient_evidence": ("root_count", "inverse_count", "root_length", "log_significance", "root_score", "walls"),
    "not_on_map": ("null", "null_gap", "null_better"),
}  # fmt: skip


def reasons_of(doubts: Doubts, features: Features | None, cautious: Model | None) -> tuple[Reason, ...]:
    """List why an answer is not usable, the weightiest first.

    Parameters
    ----------
    doubts : Doubts
    features : Features or None
        Of the best explanation; None where there is none.
    cautious : Model or None
        Whose odds fall short.
    """
    codes: list[ReasonCode] = []
    if doubts.contradicted:
        codes.append("prior_contradicted")
    if not doubts.complete:
        codes.append(INCOMPLETE)
    if doubts.not_on_map or (doubts.mirrored and doubts.status is Status.AMBIGUOUS):
        codes.append("not_on_map")
    if doubts.status is Status.DEGENERATE:
        codes.append("unobservable_direction")
    elif doubts.status is Status.AMBIGUOUS and features is not None and cautious is not None:
        codes += ["insufficient_evidence", "single_wall"] if doubts.few_walls else []
        codes += ["map_mismatch"] if doubts.out_of_step or doubts.off_scale else []
        codes += ["similar_place"] if doubts.similar_place else []
        codes += [code for code in _weighed(features, cautious, alone=doubts.alone) if code not in codes]
    sentences = dict(SENTENCES)
    if doubts.mirrored:
        sentences["not_on_map"] = MIRRORED
    if doubts.off_scale:
        sentences["map_mismatch"] = OFF_SCALE
    return tuple(Reason(code, sentences[code]) for code in codes)


def _weighed(features: Features, cautious: Model, *, alone: bool) -> list[ReasonCode]:
    """Order the reasons by the decrease of the log odds by their features; at least the first of them.

    `alone`: whether there is no other explanation; then the lead is the answer's own score.
    """
    lacking = {code: _taken(features, cautious, names) for code, names in FEATURES_OF.items()}
    if alone or features.lead > NO_ALTERNATIVE:
        # Many places explain a little of the scan, and none explains it about as well.
        lacking["insufficient_evidence"] += max(0.0, lacking.pop("similar_place"))
    ordered = sorted(lacking, key=lambda code: -lacking[code])
    return [code for k, code in enumerate(ordered) if k == 0 or lacking[code] > TELLING_REASON]


def _taken(features: Features, cautious: Model, names: tuple[str, ...]) -> float:
    """Return the decrease of the logarithm of the odds by some features, nats.

    This is the mean of two differences. One is the loss of a usual right answer if these features become as they are
    here. The other is the gain of this answer if they become as usual. The mean splits the terms of pairs of features
    between both.
    """
    here = {name: getattr(features, name) for name in names}
    usual = {name: getattr(USUAL, name) for name in names}
    loses = cautious.logit(USUAL) - cautious.logit(USUAL._replace(**here))
    gains = cautious.logit(features._replace(**usual)) - cautious.logit(features)
    return 0.5 * (loses + gains)
