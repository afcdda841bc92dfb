"""The update of a map from scans of several visits."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from association import CancelledError, Deadline, IndexingEndedError, MapIndex
from registration import InvalidArgumentError, Segments

from ..views import Steps
from . import tuning
from .additions import candidates, unexplained
from .changes import Shown, draft_changes
from .evidence import gather
from .odometry import Carrying
from .result import Bools, MapUpdate, RefusedVisit, Sharpened, apply, apply_changes, with_ends
from .scans import (
    Localized,
    TimeOverError,
    UpdateError,
    VisitScan,
    by_content,
    choose_evidence,
    go_on,
    held_back,
    is_vouched,
    search,
)
from .sharpening import sharpen
from .verifying import Proposed, is_better, keeps_usable, kept_walls, usable_of

FIRST_SEARCHES = 0.4  # of the time; the searches on the new map take as long again


def updating(
    index: MapIndex,
    scans: Sequence[VisitScan],
    deadline: Deadline | None = None,
    *,
    accept: float | None = None,
    refuse: Collection[int] = (),
) -> Steps[MapUpdate]:
    """Propose changes of a map that scans of several visits show, one search at a step.

    1. Localize: search each scan in the map. Usable and precise ones give evidence, except one in ten.
    2. Suggest: join lines of scans that the map does not show to walls that may be new.
    3. Gather: follow all beams through old and new walls; count those that end on each chunk, or pass through.
    4. Decide: two visits and three places agree, or three visits; no visit contradicts.
    5. Verify: search the scans that see a change in the new map. A change that lowers the score of its scans, or moves
       their poses, is dropped. If 1 % of the scans fit less and are no longer usable, nothing is proposed.
    6. Sharpen: estimate the walls of a map that declares 8 mm or more from all scans, and verify again.

    Parameters
    ----------
    index : MapIndex
        Directions count as they do in the index.
    scans : sequence of VisitScan
    deadline : Deadline, optional
        If it passes before all is verified, nothing is proposed.
    accept : float, optional
        Confidence from 0 to 1 below which a change is proposed, but not in the new map. None: all are in it.
    refuse : collection of int
        Indices of proposed changes that are not in the new map.

    Returns
    -------
    MapUpdate

    Raises
    ------
    UpdateError
        When there are no scans.
    InvalidArgumentError
        When `accept` or `refuse` is out of range.
    CancelledError
        When the deadline was cancelled.
    """
    if not len(scans):
        raise UpdateError("found no scans, expected scans of at least two visits", argument="scans")
    if accept is not None and not 0.0 <= accept <= 1.0:
        raise InvalidArgumentError(f"found {accept!r}, expected a confidence from 0 to 1", argument="accept")
    begun = _Update.of(index, scans, deadline or Deadline())
    first = yield from begun.localize()
    chosen, refused = choose_evidence(begun.names, first, begun.known, begun.sigma)
    proposed = Proposed()
    with contextlib.suppress(TimeOverError, IndexingEndedError):
        proposed = yield from begun.propose(chosen, first)
        proposed = yield from begun.sharpen(proposed, chosen, first)
    if begun.deadline.cancelled:
        raise CancelledError
    return begun.proposal(proposed, first, refused, accept, refuse)


@dataclass(frozen=True, slots=True, eq=False)
class _Update:
    """An update in the making; its steps raise TimeOverError when the deadline passes."""

    index: MapIndex
    known: Segments  # the map as sent
    sigma: float  # of its walls, metres
    scans: list[VisitScan]
    names: list[str]  # of the visits, in the order in which they came
    deadline: Deadline

    @classmethod
    def of(cls, index: MapIndex, scans: Sequence[VisitScan], deadline: Deadline) -> _Update:
        """Begin an update."""
        known = Segments.derived(index.segments.endpoints[: index.directed])
        sigma = tuning.USUAL_SIGMA if index.sigma is None else index.sigma
        names = list(dict.fromkeys(one.visit for one in scans))
        # The proposal must not depend on the order of the visits.
        return cls(index, known, sigma, by_content(scans), names, deadline)

    def localize(self) -> Steps[list[Localized]]:
        """Search all scans that there is time for: each alone, and those that are not usable by odometry."""
        held, found = held_back(one.visit for one in self.scans), []
        now = time.monotonic()
        at = math.inf if self.deadline.at is None else now + FIRST_SEARCHES * (self.deadline.at - now)
        for number, one in enumerate(self.scans):
            if time.monotonic() > at:
                break
            visit, result = self.names.index(one.visit), search(self.index, one, self.deadline)
            vouched = is_vouched(one, result)
            found.append(Localized(visit, one, result, held[number], vouched))
            yield
        yield from Carrying(self.index, found, self.deadline, at).carry()
        return found

    def propose(self, chosen: Sequence[Localized], first: Sequence[Localized]) -> Steps[Proposed]:
        """Draft changes, and verify them."""
        known, deadline = self.known, self.deadline
        new, sigmas = candidates(unexplained(chosen, known, deadline), known, deadline)
        walls = Segments.derived(np.concatenate([known.endpoints, new]))
        oriented = self.index.oriented
        evidence = yield from gather(walls, first, set(chosen), self.sigma, deadline, oriented=oriented)
        shown = draft_changes(evidence, known, sigmas, self.sigma, self.names, deadline)
        proposed = yield from self.verify(shown, first)
        drafted = {k for one in shown for k in one.change.segments}
        changed = {k for change in proposed.changes for k in change.segments}
        return replace(proposed, kept=tuple(kept_walls(evidence, len(known), drafted, changed)))

    def verify(self, shown: Sequence[Shown], first: Sequence[Localized]) -> Steps[Proposed]:
        """Search scans on the new map; drop changes that lower the score of their scans, or move their poses."""
        left, dropped, found = list(shown), list(shown), list(first)
        held = np.array([one.held_back for one in first], dtype=bool)
        while left:
            changes = tuple(one.change for one in left)
            segments = apply(self.known, changes)
            if not len(segments):
                break
            again = np.any([held, *(one.seen_by for one in dropped)], axis=0)
            found = yield from self._search_again(self._indexed(segments), found, again)
            dropped = [one for one in left if not is_better(one.seen_by, first, found)]
            if not dropped:
                return Proposed(changes, tuple(found)) if keeps_usable(first, found) else Proposed()
            left = [one for one in left if one not in dropped]
        return Proposed()

    def sharpen(self, proposed: Proposed, chosen: Sequence[Localized], first: Sequence[Localized]) -> Steps[Proposed]:
        """Estimate the walls that no change names from all scans, and search all scans on the sharper map.

        Returns
        -------
        Proposed
            The same if the map is sharp enough, or if the sharper one fits the scans less.
        """
        if self.index.sigma is None or self.index.sigma < tuning.LEAST_BLUR or not chosen:
            return proposed
        better = sharpen(self.index, chosen, self.sigma, self.deadline)
        mine = ~np.isin(better.segments, [k for change in proposed.changes for k in change.segments])
        if not mine.any():
            return proposed
        sharpened = Sharpened(better.segments[mine], better.ends[mine], better.sigma[mine])
        new = self._indexed(apply(with_ends(self.known, sharpened), proposed.changes))
        found, everyone = proposed.found or tuple(first), np.ones(len(first), dtype=bool)
        again = yield from self._search_again(new, first, everyone)
        better_for_all = is_better(everyone, found, again) and keeps_usable(found, again)
        return replace(proposed, found=tuple(again), sharpened=sharpened) if better_for_all else proposed

    def _indexed(self, segments: Segments) -> MapIndex:
        index, deadline = self.index, self.deadline
        return MapIndex.build(segments, index.sigma, oriented=index.oriented, points=index.points, deadline=deadline)

    def _search_again(self, index: MapIndex, found: Sequence[Localized], again: Bools) -> Steps[list[Localized]]:
        """Search some of the scans, `again`, in another map; return all."""
        out = list(found)
        for k in np.flatnonzero(again).tolist():
            go_on(self.deadline)
            out[k] = found[k].searched(index, self.deadline)
            yield
        go_on(self.deadline)
        return out

    def proposal(
        self,
        proposed: Proposed,
        first: Sequence[Localized],
        refused: Sequence[RefusedVisit],
        accept: float | None,
        refuse: Collection[int],
    ) -> MapUpdate:
        """Return the proposal with the new map."""
        changes = sorted(proposed.changes, key=lambda one: -one.confidence)
        wrong = [k for k in refuse if not 0 <= k < len(changes)]
        if wrong:
            told = f"found {wrong[0]}, expected an index of the {len(changes)} proposed changes"
            raise InvalidArgumentError(told, argument="refuse")
        accepted = tuple(
            (accept is None or one.confidence >= accept) and k not in refuse for k, one in enumerate(changes)
        )
        after, taken = proposed.found or first, [one for one, is_in in zip(changes, accepted, strict=True) if is_in]
        segments, sigma = apply_changes(self.known, self.index.sigma, taken, proposed.sharpened)
        usable, held = (usable_of(first, after, held=one) for one in (False, True))
        complete = len(first) == len(self.scans) and not self.deadline.passed
        given = (usable, held, proposed.sharpened, tuple(refused), proposed.kept, complete)
        return MapUpdate(segments, sigma, tuple(changes), accepted, *given)
