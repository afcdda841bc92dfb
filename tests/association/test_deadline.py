"""A deadline sets the flag that kernels read, and a search ends soon after it."""

from __future__ import annotations

import json
import os
import threading
import time
from dataclasses import asdict

import numpy as np
import pytest

from association import AssociationOptions, AssociationResult, CancelledError, Deadline, MapIndex, Scan, associate
from association.layout import Integers

from .scenes import INSIDE, equal_rooms, index_of, scan_of, seen

EXHAUSTIVE = AssociationOptions(exhaustive=True)
BUILDING, MANY = index_of(equal_rooms(6)), 10**9
MOST_SECONDS = 60.0  # s, that a test waits for what has to happen


def long_search() -> tuple[MapIndex, Scan]:
    """Return a map and a scan whose exhaustive search takes minutes: crossing walls of kilometres, and 400 bases."""
    along, far, none = np.linspace(0.0, 9000.0, 300), np.full(300, 9999.0), np.zeros(300)
    index = index_of(np.vstack([np.stack([none, along, far, along], 1), np.stack([along, none, along, far], 1)]))
    at, length = 1.3 * np.arange(20), 3.0 + 0.1 * np.arange(20)
    begin = np.zeros(20)
    return index, scan_of(np.vstack([np.stack([begin, at, length, at], 1), np.stack([at, begin, at, length], 1)]))


def is_set(flag: Integers) -> bool:
    """Return whether a flag is set before this test has waited too long."""
    until = time.monotonic() + MOST_SECONDS
    while not flag[0] and time.monotonic() < until:
        os.sched_yield()
    return bool(flag[0])


def test_without_a_time_the_flag_is_set_by_cancelling_alone() -> None:
    deadline = Deadline()
    with deadline.watched() as flag:
        assert (flag[0], deadline.passed) == (0, False)
        deadline.cancel()
        assert (flag[0], deadline.passed, deadline.cancelled) == (1, True, True)
    with deadline.watched() as flag:
        assert flag[0] == 1


def test_the_flag_of_a_time_that_is_over_is_set_at_once() -> None:
    with Deadline(time.monotonic()).watched() as flag:
        assert flag[0] == 1


def test_each_flag_is_set_when_its_own_time_is_over() -> None:
    """In whatever order they are watched; what is no longer watched stays as it is."""
    now = time.monotonic()
    late, soon, never = (Deadline(now + seconds) for seconds in (0.2, 0.1, 1e6))
    with never.watched() as last, late.watched() as second, soon.watched() as first:
        with soon.watched() as left:
            pass
        assert is_set(first)
        assert soon.passed
        assert is_set(second)
        assert late.passed
        assert (last[0], left[0]) == (0, 0)


def test_an_inner_deadline_comes_no_later_and_is_cancelled_with_the_outer_one() -> None:
    outer = Deadline(time.monotonic() + 1e6)
    inner, sooner = outer.within(time.monotonic() + 2e6), outer.within(time.monotonic())
    assert inner.at == outer.at
    assert (sooner.passed, outer.passed) == (True, False)
    with inner.watched() as flag:
        sooner.cancel()
        assert (flag[0], outer.cancelled) == (0, False)
        outer.cancel()
        assert (flag[0], inner.cancelled) == (1, True)


def test_a_search_that_is_cancelled_returns() -> None:
    """From another thread, while it searches."""
    index, scan = long_search()
    deadline, began, raised = Deadline(), threading.Event(), threading.Event()
    associate(index, scan, None, EXHAUSTIVE, Deadline(0.0))  # compiled

    def search() -> None:
        began.set()
        try:
            associate(index, scan, None, EXHAUSTIVE, deadline)
        except CancelledError:
            raised.set()

    thread = threading.Thread(target=search, daemon=True)
    thread.start()
    assert began.wait(MOST_SECONDS)
    thread.join(0.3)
    assert thread.is_alive()
    deadline.cancel()
    thread.join(MOST_SECONDS)
    assert raised.is_set()


def test_a_search_beyond_its_deadline_returns_what_it_has() -> None:
    index, scan = long_search()
    result = associate(index, scan, None, EXHAUSTIVE, Deadline(time.monotonic() + 0.2))
    assert not result.search.complete
    assert not result.usable


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")
def test_a_forked_process_has_a_clock_of_its_own() -> None:
    with Deadline(time.monotonic() + 1e6).watched():
        pass  # the thread of this process has begun
    child = os.fork()
    if child == 0:
        with Deadline(time.monotonic() + 0.05).watched() as flag:
            os._exit(0 if is_set(flag) else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def as_json(found: AssociationResult) -> str:
    return json.dumps(asdict(found), default=lambda value: value.tolist())


class Looks(Deadline):
    """A deadline that passes at a look, whatever the time."""

    def __init__(self, left: int) -> None:
        super().__init__()
        self.left = left

    @property
    def passed(self) -> bool:
        self.left -= 1
        return self.left < 0


@pytest.mark.parametrize("viewpoint", [(0.0, 0.0), None])
def test_whenever_the_deadline_passes_a_complete_answer_is_that_without_one(
    viewpoint: tuple[float, float] | None,
) -> None:
    """Of an answer that claims to be complete, alternatives and the margin were left out where it passed late."""
    sent = scan_of(seen(equal_rooms(6), INSIDE, noise=0.01, cut=0.4, clutter=3)[0], viewpoint=viewpoint)
    options = AssociationOptions(max_alternatives=20)

    def found(deadline: Deadline) -> AssociationResult:
        return associate(BUILDING, sent, None, options, deadline)

    counted = Looks(MANY)
    whole, looks = as_json(found(counted)), MANY - counted.left
    answers = [found(Looks(left)) for left in range(looks + 1)]
    assert not any(one.usable for one in answers if not one.search.complete)
    assert all(as_json(one) == whole for one in answers if one.search.complete)
    assert {one.search.complete for one in answers} == {True, False}
