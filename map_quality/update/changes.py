"""From evidence to drafts of changes: walls that belong together become one change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from association import Deadline
from registration import Segments

from . import tuning
from .beams import lie_on
from .evidence import Judged, WallEvidence, are_enough
from .result import Bools, Change, Evidence, Floats
from .scans import go_on
from .walls import NO_SIGMA, NO_WALLS, Draft, corner_error, find_cuts, runs


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """A change that evidence shows, and which scans saw the walls that it takes away or brings, (n,)."""

    change: Change
    seen_by: Bools


def draft_changes(
    evidence: WallEvidence, known: Segments, sigmas: Floats, sigma: float, names: Sequence[str], deadline: Deadline
) -> list[Shown]:
    """Return the changes that the evidence shows, with the scans that saw their walls.

    Parameters
    ----------
    evidence : WallEvidence
        About the walls of the map, and behind them about those that may be new.
    known : Segments
        Of the map.
    sigmas : (k,)
        Of the walls that may be new, metres.
    sigma : float
        Of the map's walls, metres.
    names : sequence of str
        Of the visits.
    deadline : Deadline
    """

    def shown(drafts: Sequence[Draft]) -> list[Draft]:
        go_on(deadline)
        return [one for one in drafts if change_of(one, evidence, names) is not None]

    judged = evidence.judge()
    cuts, passed = find_cuts(evidence, judged, known, sigma, deadline)
    extended, added = _new_walls(judged, known, {cut.segments[0] for cut in cuts}, sigmas, sigma, deadline)
    near = tuning.JOINED + corner_error(sigma)
    added = shown(_joined(added, known, tuning.JOINED, deadline))
    # Nothing of a wall that moved is seen again; its faces may have no end in common.
    unread = [replace(cut, code="removed", new=NO_WALLS, sigma=NO_SIGMA) for cut in cuts if not cut.rest_read]
    whole = {cut.segments[0]: cut for cut in (*unread, *passed)}
    gone = shown(_joined([whole[wall] for wall in sorted(whole)], known, near, deadline))
    moved, added = _moves(gone, added, known, deadline)
    taken = {segment for one in moved for segment in one.segments}

    left = [cut for cut in cuts if cut.segments[0] not in taken]
    removed = _joined([cut for cut in left if cut.code == "removed"], known, near, deadline)
    shortened = [cut for cut in left if cut.code == "shortened"]
    drafts = (*moved, *removed, *added, *extended, *shortened)
    told = ((change_of(one, evidence, names), one.seen_by(evidence)) for one in drafts)
    return [Shown(change, seen_by) for change, seen_by in told if change is not None]


def _new_walls(
    judged: Judged, known: Segments, cut: set[int], sigmas: Floats, map_sigma: float, deadline: Deadline
) -> tuple[list[Draft], list[Draft]]:
    """Return extensions of walls of the map, one for each wall, and walls that continue none."""
    extended: dict[int, Draft] = {}
    added, chunks = [], judged.chunks
    pieces: list[Floats] = []
    for wall, sigma in enumerate(sigmas, len(known)):
        # Of two walls that face the same way the one in front hides the other, so that both are never seen. Flat beams
        # show a wall too near, for example.
        direction, new = chunks.walls.directions[wall], Segments.derived(np.array(pieces).reshape(-1, 4))
        is_double = lie_on(chunks.middles(wall), direction, new, deadline, near=tuning.DOUBLED)
        own = chunks.of_wall(wall)
        for begin, end in runs(judged.there[own] & ~is_double):
            piece, read = chunks.part(wall, begin, end), own.start + np.arange(begin, end)
            if np.hypot(*(piece[2:] - piece[:2])) < tuning.LEAST_PIECE:
                continue
            pieces.append(piece)
            off = tuning.DEVIATIONS * float(np.hypot(sigma, map_sigma))
            old, door = _continued(known, piece, off), _may_be_door(known, piece)
            if old is None or old in cut:
                added.append(Draft("added", (), piece[None], np.array([sigma]), there=read, door=door))
                continue
            before = extended.get(old, Draft("extended", (old,), known.endpoints[old : old + 1]))
            extended[old] = replace(
                before.with_also(Draft("extended", (), there=read, door=door)),
                new=_prolonged(known, old, before.new[0], piece)[None],
                sigma=np.array([sigma]),
            )
    return list(extended.values()), added


def _continued(known: Segments, piece: Floats, step: float) -> int | None:
    """Return the wall of the map that a new piece continues, off its line by a step at most; None if there is none."""
    along = piece[2:] - piece[:2]
    direction = along / np.hypot(*along)
    parallel = known.directions @ direction >= np.cos(tuning.SAME_ANGLE)
    middle = 0.5 * (piece[:2] + piece[2:])
    beside = np.abs(known.normals @ middle - known.offsets) <= min(step, tuning.SAME_LINE)
    begin = known.endpoints[:, :2] @ direction - piece[2:] @ direction
    end = piece[:2] @ direction - known.endpoints[:, 2:] @ direction
    gaps = np.maximum(begin, end)  # the wall lies ahead of the piece, or behind it
    fitting = np.flatnonzero(parallel & beside & (gaps <= tuning.SAME_GAP) & (gaps >= -tuning.SAME_GAP))
    return int(fitting[np.argmin(np.abs(gaps[fitting]))]) if len(fitting) else None


def _may_be_door(known: Segments, piece: Floats) -> bool:
    """Return whether a new wall may be a part of the leaf of a door: the end of another wall is near on its line.

    An open leaf may be seen at its tip only.
    """
    along = piece[2:] - piece[:2]
    length = float(np.hypot(*along))
    if length > tuning.LONGEST_LEAF:
        return False
    off = known.endpoints.reshape(-1, 2) - piece[:2]
    at = off @ along / length
    across = np.abs(off @ np.array([-along[1], along[0]])) / length
    beyond = np.maximum(-at, at - length)
    reach = max(tuning.JAMB, tuning.LONGEST_LEAF - length)
    return bool(((across <= tuning.JAMB) & (beyond >= -tuning.JAMB) & (beyond <= reach)).any())


def _prolonged(known: Segments, wall: int, line: Floats, piece: Floats) -> Floats:
    """Return a wall of the map that reaches as far as a piece that continues it, (4,)."""
    place, along = known.endpoints[wall, :2], known.directions[wall]
    reach = [(point - place) @ along for point in (line[:2], line[2:], piece[:2], piece[2:])]
    return np.concatenate([place + min(reach) * along, place + max(reach) * along])


def _joined(drafts: Sequence[Draft], known: Segments, near: float, deadline: Deadline) -> list[Draft]:
    """Join changes of walls, old or new, whose ends are within `near` metres of one another: they are one thing."""
    ends = [np.concatenate([known.endpoints[list(one.segments)], one.new]) for one in drafts]
    label = np.arange(len(drafts))
    corners = np.concatenate([NO_WALLS, *ends]).reshape(-1, 2)
    owner = np.repeat(label, [2 * len(one) for one in ends])
    for corner, own in zip(corners, owner, strict=True):
        go_on(deadline)
        met = label[owner[np.hypot(*(corners - corner).T) <= near]]
        label[np.isin(label, met)] = label[own]
    joined: dict[int, Draft] = {}
    for one, of in zip(drafts, label.tolist(), strict=True):
        joined[of] = joined[of].with_also(one) if of in joined else one
    return list(joined.values())


def _moves(
    gone: Sequence[Draft], added: Sequence[Draft], known: Segments, deadline: Deadline
) -> tuple[list[Draft], list[Draft]]:
    """Pair things that are gone with new ones of the same sides nearby; return moves, and what is new and left."""
    moves, left = [], list(added)
    for old in gone:
        go_on(deadline)
        was, middle = known.take(np.array(old.segments)), known.midpoints[list(old.segments)].mean(axis=0)
        near = [
            (away, k)
            for k, new in enumerate(left)
            if (away := float(np.hypot(*(new.new.reshape(-1, 2).mean(axis=0) - middle)))) <= tuning.NEAR_MOVE
            and _fits(Segments.derived(new.new), was)
        ]
        if near:
            moves.append(old.with_also(left.pop(min(near)[1]), "moved"))
    return moves, left


def _fits(is_now: Segments, was: Segments) -> bool:
    """Return whether each new side but stubs has an old one of its own; the longest is as long, others may be hidden.

    An obstacle before a side hides all of it, or a part: it never seems longer. A wall, which has no four sides, stays
    parallel to itself.
    """
    new, old = is_now.lengths, was.lengths
    turn = abs(float(is_now.directions[new.argmax()] @ was.directions[old.argmax()]))
    if len(was) < tuning.SIDES and turn < tuning.SAME_SIDE:
        return False
    sides, free = (sorted(one[one >= min(tuning.LONGEST_STUB, one.max())].tolist()) for one in (new, old))
    for length in sides[::-1]:
        same = max(tuning.SAME_LENGTH, tuning.SAME_FRACTION * length)
        best = min(free, key=lambda one: abs(one - length), default=0.0)
        if length - best > same or (length == sides[-1] and best - length > same):
            return False
        free.remove(best)
    return True


def change_of(draft: Draft, evidence: WallEvidence, names: Sequence[str]) -> Change | None:
    """Return a change with its evidence; None if too little shows it."""
    gone, there = evidence.rows_of(draft.gone), evidence.rows_of(draft.there)
    through, contra, _ = evidence.counts[gone].sum(axis=0).tolist()
    passed, on, _ = evidence.counts[there].sum(axis=0).tolist()
    against = contra + passed
    sides = [(rows, is_on) for rows, is_on in ((gone, False), (there, True)) if len(rows)]
    visits = sorted({visit for rows, is_on in sides for visit in evidence.visits_of(rows, on=is_on)})
    poses = [evidence.places_of(rows, on=is_on) for rows, is_on in sides]
    if not are_enough(len(visits), min(poses)) or (draft.door and len(visits) < tuning.DOOR_VISITS):
        return None
    doubt = tuning.DOUBT_VISIT ** len(visits) * tuning.DOUBT_POSE ** min(poses)
    doubt += 0.1 * against / (through + on + against)
    confidence = float(np.clip(1.0 - doubt, 0.01, tuning.MOST_CONFIDENCE))
    told = Evidence(through, on, min(poses), len(visits), names[visits[0]], names[visits[-1]])
    return Change(draft.code, draft.segments, draft.new, draft.sigma, told, confidence)
