"""Reasons why an answer is not usable: a code for programs and a message for people."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ..result import Reason, ReasonCode, Status
from .features import ROLES, Features
from .model import USUAL, Model
from .tuning import NO_ALTERNATIVE, TELLING_REASON
from .vetoes import Veto

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
SETTLED: tuple[ReasonCode, ...] = (
    "prior_contradicted", "search_incomplete", "not_on_map", "unobservable_direction", "similar_place",
)  # fmt: skip


def reasons_of(
    status: Status, vetoes: Iterable[Veto], settled: Iterable[ReasonCode], weighed: Iterable[ReasonCode] = ()
) -> tuple[Reason, ...]:
    """List why an answer is not usable: vetoes and what is settled in their order, then those of the features."""
    codes: set[ReasonCode] = {veto.reason for veto in vetoes} | set(settled)
    listed = [code for code in SETTLED if code in codes]
    if status is Status.AMBIGUOUS:
        listed += [code for code in weighed if code not in codes]
    return tuple(Reason(code, REASON_MESSAGES[code]) for code in listed)


def taken_by_reason(model: Model, features: Features, on_map: float) -> dict[ReasonCode, float]:
    """Return for each reason by how much the log odds rise if its features are those of a usual right answer, nats."""
    here = model.log_odds(features, on_map)
    taken: dict[ReasonCode, float] = {}
    for reason in dict.fromkeys(role.reason for role in ROLES.values()):
        usual = {name: getattr(USUAL, name) for name, role in ROLES.items() if role.reason == reason}
        taken[reason] = model.log_odds(features._replace(**usual), on_map) - here
    return taken


def weighed_reasons(model: Model, features: Features, on_map: float) -> list[ReasonCode]:
    """Order the reasons by the decrease of the log odds by their features; at least the first of them."""
    taken = taken_by_reason(model, features, on_map)
    if features.lead > NO_ALTERNATIVE:
        # Many places explain a little of the scan, and none explains it about as well.
        taken["insufficient_evidence"] += max(0.0, taken.pop("similar_place"))
    ordered = sorted(taken, key=lambda code: -taken[code])
    return [code for k, code in enumerate(ordered) if k == 0 or taken[code] > TELLING_REASON]
