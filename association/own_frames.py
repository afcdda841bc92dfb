"""From the answer in the joint frame of several maps to poses and indices of each map's own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from registration import RegistrationOptions, RigidTransform, register
from registration.layout import POSE

from .associating import Stages
from .consensus.consensus_set import ConsensusSet
from .context import SearchContext
from .index.joint import JointIndex
from .options import MapsPrior
from .report import probabilities_of_others
from .result import AssociationDiagnostics, AssociationResult, Correspondence, MapVerdict, Reason, Status

FIRST_NAMES = 5  # of maps, in a message
AS_LIKELY = 0.02  # of the probability of the answer, tables; a pose with less is no similar place


def in_own_frames(found: Stages, ids: Sequence[str]) -> AssociationResult:
    """Return an answer with its poses, segments and alternatives on the map that each is on.

    Parameters
    ----------
    found : Stages
        In the joint frame of a `JointIndex`, with its correspondences.
    ids : sequence of str
        Name of each map.
    """
    context, result = found.context, found.result
    index = context.index
    assert isinstance(index, JointIndex)
    at = [_map_at(context, other.pose) for other in result.alternatives]
    others = tuple(
        replace(other, pose=_back(index, other.pose, m), map_id=ids[m])
        for other, m in zip(result.alternatives, at, strict=True)
    )
    best = None if result.pose is None else _map_of(context, index, result)
    own = result if best is None else _on_map(context, index, result, best)
    verdicts = _map_verdicts(found, index, ids, best, own.pose)
    result = replace(own, alternatives=others, map_id=None if best is None else ids[best], maps=verdicts)
    return replace(result, reasons=tuple(_named(reason, result) for reason in result.reasons))


def _on_map(context: SearchContext, index: JointIndex, result: AssociationResult, m: int) -> AssociationResult:
    """Return the answer's pose and segments on map `m`; its alternatives stay where they are."""
    first, last = int(index.starts[m]), int(index.starts[m + 1])
    assert result.pose is not None
    pairs = tuple(
        replace(pair, map=pair.map - first, alternatives=tuple(i - first for i in pair.alternatives))
        for pair in result.correspondences
    )
    pose = _back(index, result.pose, m)
    diagnostics = result.diagnostics
    if diagnostics is not None:
        wall = diagnostics.critical_wall
        if wall is not None:
            wall = replace(wall, map=tuple(i - first for i in wall.map))
        diagnostics = replace(_registered_on_map(context, index, diagnostics, pairs, (m, pose)), critical_wall=wall)
    missing = tuple(i - first for i in result.missing_map if first <= i < last)
    result = replace(result, frame_id=index.parts[m].frame_id, pose=pose, diagnostics=diagnostics)
    return replace(result, correspondences=pairs, missing_map=missing)


def _registered_on_map(
    context: SearchContext,
    index: JointIndex,
    diagnostics: AssociationDiagnostics,
    pairs: Sequence[Correspondence],
    at: tuple[int, RigidTransform],
) -> AssociationDiagnostics:
    """Return diagnostics with the ambiguity before registration in the frame of a map; `at`: that map, and the pose."""
    m, pose = at
    if not pairs:
        return diagnostics
    indices = np.array([(pair.scan, pair.map) for pair in pairs], dtype=np.intp)
    options = RegistrationOptions(rotation=context.options.rotation, weights=np.array([pair.weight for pair in pairs]))
    sigma = index.sigma or 0.0
    registered = register(index.parts[m].segments, context.scan.measured, indices, sigma, options, pose)
    return replace(diagnostics, ambiguity_before=registered.diagnostics.ambiguity_before)


def _map_of(context: SearchContext, index: JointIndex, result: AssociationResult) -> int:
    """Return the map of an answer: that of its correspondences, which are all on one map."""
    if result.correspondences:
        return int(index.map_of(np.array([result.correspondences[0].map]))[0])
    assert result.pose is not None
    return _map_at(context, result.pose)


def _map_at(context: SearchContext, pose: RigidTransform) -> int:
    """Return the map of a pose of the joint frame."""
    return int(context.maps_at(np.array([(pose.theta, pose.x, pose.y)], POSE))[0])


def _back(index: JointIndex, pose: RigidTransform, m: int) -> RigidTransform:
    """Return a pose of the joint frame in the frame of map `m`."""
    x, y = index.shifts[m].tolist()
    return RigidTransform(pose.x - x, pose.y - y, pose.theta)


def _map_verdicts(
    found: Stages, index: JointIndex, ids: Sequence[str], best: int | None, pose: RigidTransform | None
) -> tuple[MapVerdict, ...]:
    """Return the best pose of each map, the best first; maps without one in their order.

    A map whose best pose explains the scan about as well as the answer is ambiguous, unless the answer is usable. The
    probabilities of all maps sum to at most 1.
    """
    context, result = found.context, found.result
    weights = context.prior.of_maps if isinstance(context.prior, MapsPrior) else np.zeros(len(ids))
    firsts: dict[int, ConsensusSet] = {}
    for one in found.explanations.ranked:
        firsts.setdefault(_map_at(context, context.in_map(one.pose)), one)
    similar, likely = _of_others(found)
    verdicts: list[MapVerdict] = []
    if best is not None and result.diagnostics is not None:
        score = result.diagnostics.score + float(weights[best])
        verdicts.append(MapVerdict(ids[best], result.status, score, result.probability, pose))
    for m, one in firsts.items():
        if m == best:
            continue
        status = Status.AMBIGUOUS if m in similar else Status.NO_MATCH
        score = one.score + float(weights[m])
        there = None if best is None else _back(index, context.in_map(one.pose), m)
        verdicts.append(MapVerdict(ids[m], status, score, None if likely is None else likely.get(m, 0.0), there))
    none = None if result.probability is None else 0.0
    listed = {verdict.map_id for verdict in verdicts}
    return (*verdicts, *(MapVerdict(name, Status.NO_MATCH, None, none, None) for name in ids if name not in listed))


def _of_others(found: Stages) -> tuple[set[int], dict[int, float] | None]:
    """Return what the alternatives say of their maps.

    Returns
    -------
    the maps with a pose that explains the scan about as well as an answer that is not usable
    the probability of each map's poses together; None where the answer has none
    """
    context, comparison, result = found.context, found.verdict.comparison, found.result
    similar, likely = set[int](), dict[int, float]()
    if comparison is None:
        return similar, None
    open_still = not result.usable and result.status is not Status.NO_MATCH
    limit = AS_LIKELY
    if any(reason.code == "similar_place" for reason in result.reasons):  # which the likeliest place is in any case
        limit = min(limit, max(comparison.weights.tolist(), default=limit))
    each = probabilities_of_others(found.verdict, comparison.others)
    for one, weight, probability in zip(comparison.others, comparison.weights.tolist(), each, strict=True):
        m = _map_at(context, context.in_map(one.pose))
        likely[m] = likely.get(m, 0.0) + (probability or 0.0)
        if open_still and weight >= limit:
            similar.add(m)
    return similar, None if result.probability is None else likely


def _named(reason: Reason, result: AssociationResult) -> Reason:
    """Return a reason that names the map of the similar place."""
    if reason.code == "not_on_map":
        return replace(
            reason,
            message="The scan fits none of these maps better than an unrelated scan would. The robot may be in a place "
            "that no map contains. Search other maps, too. If the robot is on one of them, run "
            "`linefix map check MAP --log LOG`: scale, mirror, unit or mount may be wrong.",
        )
    if reason.code != "similar_place":
        return reason
    places = [verdict.map_id for verdict in result.maps if verdict.status is Status.AMBIGUOUS]
    others = [name for name in places if name != result.map_id]
    if not others:
        return reason
    named = f"A pose on the map {others[0]} fits" if len(others) == 1 else f"Poses on the maps {_some(others)} fit"
    return replace(
        reason,
        message=f"{named} the scan about as well: see `maps` and `alternatives`. Send `map_weights` or a prior, or "
        "move and scan again.",
    )


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - FIRST_NAMES} more" if len(names) > FIRST_NAMES else ""
    return ", ".join(names[:FIRST_NAMES]) + more
