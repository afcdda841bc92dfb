"""Why an answer is not usable: the vetoes of the contract, and the reasons with their messages."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from ..consensus.tuning import CONTRADICTION
from ..result import Reason, ReasonCode, Status
from .features import ROLES, Features
from .model import USUAL, Model
from .tuning import FAR_FROM_PRIOR, NO_ALTERNATIVE, TELLING_REASON


@dataclass(frozen=True, slots=True)
class Findings:
    """The numbers that vetoes decide by.

    Attributes
    ----------
    complete : bool
        True if nothing was left unsearched or uncompared.
    score, score_elsewhere : float
        Of the answer, and the best of the other explanations, also outside the prior's window, nats.
    prior : float
        Log-density of a soft prior at the pose over its maximum, nats.
    outside_window : bool
        True if the pose lies outside the window of a hard prior.
    unobservable : bool
        True if the walls leave a direction of the position open.
    """

    complete: bool
    score: float = -math.inf
    score_elsewhere: float = -math.inf
    prior: float = 0.0
    outside_window: bool = False
    unobservable: bool = False


@dataclass(frozen=True, slots=True)
class Veto:
    """A condition under which an answer is not usable, and the reason that it gives."""

    name: str
    applies: Callable[[Findings], bool]
    reason: ReasonCode


INCOMPLETE = Veto("search_incomplete", lambda found: not found.complete, "search_incomplete")
VETOES: tuple[Veto, ...] = (
    Veto("better_elsewhere", lambda found: found.score_elsewhere > found.score + CONTRADICTION, "prior_contradicted"),
    Veto("far_from_prior", lambda found: found.prior < FAR_FROM_PRIOR, "prior_contradicted"),
    Veto("outside_window", lambda found: found.outside_window, "prior_contradicted"),
    INCOMPLETE,
    Veto("unobservable_direction", lambda found: found.unobservable, "unobservable_direction"),
)


def applied(findings: Findings) -> tuple[Veto, ...]:
    """Return the vetoes whose conditions the findings meet, in the order of the table."""
    return tuple(veto for veto in VETOES if veto.applies(findings))


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


def weighed_reasons(model: Model, features: Features, on_map: float, among: float) -> list[ReasonCode]:
    """Order the reasons by the decrease of the log odds by their features; at least the first of them.

    `among` is the probability of the answer among its alternatives.
    """
    taken = taken_by_reason(model, features, on_map)
    if among > NO_ALTERNATIVE:
        # Many places explain a little of the scan, and none explains it about as well.
        taken["insufficient_evidence"] += max(0.0, taken.pop("similar_place"))
    ordered = sorted(taken, key=lambda code: -taken[code])
    return [code for k, code in enumerate(ordered) if k == 0 or taken[code] > TELLING_REASON]
