"""Reasons why an answer is not usable: a code for programs and a message for people."""

from __future__ import annotations

from collections.abc import Mapping

from registration.values import value

from ..result import Reason, ReasonCode, Status
from .features import Features
from .models import USUAL, Model
from .roles import FEATURES_OF
from .tuning import NO_ALTERNATIVE, TELLING_REASON
from .vetoes import Veto


@value(frozen=True, slots=True)
class Doubts:
    """Evidence against an answer, except for its features.

    Attributes
    ----------
    status : Status
    vetoes : tuple of Veto
        Those that count with the status.
    not_on_map : bool
        True if there is little evidence for this map at all.
    similar_place : bool
        True if alternatives alone make the answer too uncertain.
    alone : bool
        True if no other explanation was found where the prior allows one.
    """

    status: Status
    vetoes: tuple[Veto, ...] = ()
    not_on_map: bool = False
    similar_place: bool = False
    alone: bool = False


REASON_MESSAGES: Mapping[ReasonCode, str] = {
    "prior_contradicted": "The pose that the scan supports contradicts the prior. Check the prior, or search without "
    "it.",
    "search_incomplete": "The search is incomplete: the deadline passed, or too many walls of the map lie in one "
    "place. A better pose may have been missed. Extend the deadline, or see `warnings`.",
    "unobservable_direction": "The observed walls do not fix the position along one direction (`unobservable`). Move "
    "until other walls are in view, and scan again.",
    "not_on_map": "The scan fits this map no better than an unrelated scan would. The robot may be in a place that "
    "the map does not contain. If it is on the map, run `linefix map check MAP --log LOG`: scale, mirror, unit or "
    "mount may be wrong.",
    "similar_place": "Another pose fits the scan about as well: see `alternatives`. Send a prior, or move and scan "
    "again.",
    "single_wall": "The pose depends on a single wall (`critical_wall`). Move and scan again.",
    "map_mismatch": "The scan and the map differ: much of the scan is not on the map, or mapped walls are not in the "
    "scan. Check that the map is up to date.",
    "insufficient_evidence": "The scan has too few walls to distinguish this place from others. Move and scan again.",
}

# The order of the reasons that do not come from the contributions of the features.
ORDER: tuple[ReasonCode, ...] = (
    "prior_contradicted", "search_incomplete", "not_on_map", "unobservable_direction", "insufficient_evidence",
    "single_wall", "map_mismatch", "similar_place",
)  # fmt: skip


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
    settled: set[ReasonCode] = {code for veto in doubts.vetoes for code in veto.reasons}
    if doubts.not_on_map:
        settled.add("not_on_map")
    if doubts.similar_place and doubts.status is Status.AMBIGUOUS:
        settled.add("similar_place")
    codes = [code for code in ORDER if code in settled]
    if doubts.status is Status.AMBIGUOUS and features is not None and cautious is not None:
        codes += [code for code in _weighed(features, cautious, alone=doubts.alone) if code not in settled]
    sentences = dict(REASON_MESSAGES)
    sentences |= {veto.reasons[-1]: veto.message for veto in doubts.vetoes if veto.message is not None}
    return tuple(Reason(code, sentences[code]) for code in codes)


def _weighed(features: Features, cautious: Model, *, alone: bool) -> list[ReasonCode]:
    """Order the reasons by the decrease of the log odds by their features; at least the first of them.

    `alone`: whether there is no other explanation; then the lead is the answer's own score.
    """
    lacking = taken_by_reason(features, cautious)
    if alone or features.lead > NO_ALTERNATIVE:
        # Many places explain a little of the scan, and none explains it about as well.
        lacking["insufficient_evidence"] += max(0.0, lacking.pop("similar_place"))
    ordered = sorted(lacking, key=lambda code: -lacking[code])
    return [code for k, code in enumerate(ordered) if k == 0 or lacking[code] > TELLING_REASON]


def taken_by_reason(features: Features, cautious: Model) -> dict[ReasonCode, float]:
    """Return for each reason the decrease of the logarithm of the odds by its features, nats."""
    return {code: _taken(features, cautious, names) for code, names in FEATURES_OF.items()}


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
