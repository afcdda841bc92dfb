"""A long search that goes through several bases at once, where processors are free: with the same answer to the bit.

Bases are gone through in an order that does not depend on what is found. One that is gone through ahead of its turn
leaves off later, for want of what others find, and what may have to be kept is only noted. When its turn comes that is
kept as if it had been gone through then.
"""

from __future__ import annotations

from collections import deque
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from registration.layout import Records

from .context import SearchContext
from .kernels.advancing import BUDGET, EXHAUSTED, merge
from .kernels.planning import next_base
from .kernels.searching import go_on
from .layout import TRIED
from .planning_tables import Plan
from .tables import Question, Workspace

ROOM = 1024  # poses that are noted at a time
MOST_AHEAD = 4  # bases at once: what is ahead when the search ends was for nothing, and each thread has a workspace
LOOK_SECONDS = 0.005  # after which who waits for a helper looks at the deadline


@dataclass(slots=True)
class _Ahead:
    """One base that is gone through ahead of its turn.

    Attributes
    ----------
    state : (1,) of `PROGRESS`
    tried : list of (k,) of `TRIED`
    finished : bool
        Whether it was gone through to its end.
    helper : Future or None
        Of the helper that goes through it; None where the search does so itself.
    """

    state: Records
    tried: list[Records] = field(default_factory=list)
    finished: bool = False
    helper: Future[None] | None = None

    @property
    def left(self) -> bool:
        """Whether its helper has not begun, and now will not, or has left off before the end."""
        if self.helper is None or self.finished:
            return False
        if self.helper.cancel():
            return True
        if self.helper.done():
            self.helper.result()
            return not self.finished
        return False


class Sharing:
    """Bases of a search, shared with helpers.

    Parameters
    ----------
    context : SearchContext
        With a deadline that has helpers.
    question : Question
    plan : Plan
    found, progress : Records
        The best poses so far, and how far the search is.
    how : (1,) of `HOW`
    """

    def __init__(
        self, context: SearchContext, question: Question, plan: Plan, found: Records, progress: Records, how: Records
    ) -> None:
        self._context, self._question, self._plan = context, question, plan
        self._found, self._progress, self._how = found, progress, how
        assert context.deadline.helpers is not None
        self._helpers = context.deadline.helpers
        self._pending: deque[_Ahead] = deque()
        self._spare: list[Workspace] = []
        self._ended = False

    def go_on(self) -> int:
        """Go through bases as `advance` does, as long as there are helpers; return as it does."""
        try:
            return self._go_on()
        finally:
            self._ended = True  # helpers leave off soon

    def _go_on(self) -> int:
        helpers, deadline = self._helpers, self._context.deadline
        own: _Ahead | None = None
        while True:
            while self._pending and self._pending[0].finished:
                why = self._merge(self._pending.popleft())
                if why != BUDGET:
                    return why
            if deadline.passed or (not self._pending and not helpers.free):
                return BUDGET
            own = own or self._taken_back() or self._next()
            while helpers.free and len(self._pending) < MOST_AHEAD and (other := self._next()) is not None:
                other.helper = helpers.run(partial(self._help, other))
            if own is not None:
                self._search(own, self._context.workspace)
                own = None if own.finished else own
            elif self._pending:
                wait([one.helper for one in self._pending if one.helper is not None], LOOK_SECONDS, FIRST_COMPLETED)
            else:
                return EXHAUSTED

    def _taken_back(self) -> _Ahead | None:
        """Return the first base that a helper has left, for the search to go through it itself."""
        for one in self._pending:
            if one.left:
                one.helper = None
                return one
        return None

    def _next(self) -> _Ahead | None:
        """Take the next base: that which was begun, or else the best that is left."""
        state, plan = self._progress.copy(), self._plan
        if self._progress["current"][0] < 0 or self._pending:
            state["current"] = next_base(self._question, plan)
            state["anchor"] = state["step"] = state["entry"] = 0
            if state["current"][0] < 0:
                return None
        state["hypotheses"] = state["tried"] = 0
        self._pending.append(_Ahead(state))
        return self._pending[-1]

    def _help(self, ahead: _Ahead) -> None:
        """Go through a base in a helper's thread, as long as helpers are welcome."""
        work = self._spare.pop() if self._spare else self._context.another_workspace()
        while not (ahead.finished or self._ended or self._context.deadline.passed) and self._helpers.welcome:
            self._search(ahead, work)
        self._spare.append(work)

    def _search(self, ahead: _Ahead, work: Workspace) -> None:
        """Go on with a base for a while."""
        state, room = ahead.state, np.zeros(ROOM, TRIED)
        # What was kept of the bases before it makes it leave off sooner.
        for name in ("best_value", "least_kept", "least_freedom"):
            state[name] = max(state[name][0], self._progress[name][0])
        state["tried"] = 0
        tables = self._context.index.tables
        why = go_on(self._question, tables, self._plan, self._found, room, state, work, self._how)
        ahead.tried.append(room[: int(state["tried"][0])].copy())
        ahead.finished = why != BUDGET

    def _merge(self, ahead: _Ahead) -> int:
        tried, allowed = np.concatenate(ahead.tried), float(self._how["allowed"][0])
        found, progress, work = self._found[: self._how["kept"][0]], self._progress, self._context.workspace
        return merge(self._question, self._plan, tried, ahead.state, found, progress, work, allowed)
