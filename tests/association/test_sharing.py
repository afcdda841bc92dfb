"""A search that helpers take part in answers as it does alone, to the bit, wherever the clock is looked at."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

from association import AssociationOptions, Deadline, HardPrior, Prior, SoftPrior, associate, candidates, sharing

from .scenes import beams_of, index_of, maze, pose, scan_of, seen

ON_A_GRID = np.round(maze(3, 90, 40.0) * 2.0) / 2.0  # crossings lie where cells meet
ON_A_GRID = ON_A_GRID[np.hypot(*(ON_A_GRID[:, 2:] - ON_A_GRID[:, :2]).T) > 0.4]
INDEX = index_of(ON_A_GRID)
AT = pose(15.0, 14.0, 0.5)
SCANS = [scan_of(seen(ON_A_GRID, AT, noise=0.02, cut=0.4, clutter=clutter, radius=9.0)[0]) for clutter in (2, 12)]
SOFT, HARD = SoftPrior(AT, np.diag([4.0, 4.0, 0.5])), HardPrior(AT, 3.0, 1.0)
QUESTIONS: list[tuple[Prior | None, dict[str, Any]]] = [
    (None, {}),
    (SOFT, {}),
    (HARD, {}),
    (None, {"sampling": "random", "seed": 5}),
    (None, {"exhaustive": True}),
    (None, {"min_overlap": 0.3, "oriented": False}),
]


class Threads:
    """Threads that help, always or as long as they are welcome."""

    def __init__(self, count: int = 2) -> None:
        self._threads, self._count = ThreadPoolExecutor(count), count
        self._asked: list[Future[None]] = []
        self.helped, self.welcome = 0, True

    @property
    def free(self) -> bool:
        self._asked = [one for one in self._asked if not one.done()]
        return len(self._asked) < self._count

    def run(self, function: Callable[[], None]) -> Future[None]:
        self.helped += 1
        self._asked.append(self._threads.submit(function))
        return self._asked[-1]

    def close(self) -> None:
        self._threads.shutdown()


class NeverBegin(Threads):
    def run(self, function: Callable[[], None]) -> Future[None]:
        self.helped += 1
        return Future()


class LeaveOff(Threads):
    """Are welcome for a moment only, again and again."""

    def run(self, function: Callable[[], None]) -> Future[None]:
        self.welcome = self.helped % 3 == 0
        return super().run(function)


class Fail(Threads):
    def run(self, function: Callable[[], None]) -> Future[None]:
        def failing() -> None:
            raise MemoryError

        return super().run(failing)


def answer(number: int, scan: int, deadline: Deadline) -> str:
    prior, options = QUESTIONS[number]
    found = associate(INDEX, SCANS[scan], prior, AssociationOptions(**options), deadline)
    return json.dumps(asdict(found), default=lambda value: value.tolist())


@pytest.fixture
def helpers(request: pytest.FixtureRequest) -> Iterator[Threads]:
    made: Threads = getattr(request, "param", Threads)()
    yield made
    made.close()


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look at the clock after every few poses, so that small searches are long."""
    monkeypatch.setattr(candidates, "CHUNK", 100)
    monkeypatch.setattr(sharing, "ROOM", 3)


@pytest.mark.parametrize("scan", [0, 1])
@pytest.mark.parametrize("number", range(len(QUESTIONS)))
def test_where_the_clock_is_looked_at_makes_no_difference(
    number: int, scan: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = answer(number, scan, Deadline())
    for chunk in (1, 40, 1000):
        monkeypatch.setattr(candidates, "CHUNK", chunk)
        assert answer(number, scan, Deadline()) == whole


@pytest.mark.parametrize("helpers", [Threads, NeverBegin, LeaveOff], indirect=True)
@pytest.mark.parametrize("scan", [0, 1])
@pytest.mark.parametrize("number", range(len(QUESTIONS)))
@pytest.mark.usefixtures("impatient")
def test_helpers_change_nothing(number: int, scan: int, helpers: Threads) -> None:
    alone, deadline = answer(number, scan, Deadline()), Deadline()
    deadline.helpers = helpers
    assert answer(number, scan, deadline) == alone
    assert answer(number, scan, deadline.within(time.monotonic() + 60.0)) == alone
    assert helpers.helped > 4


@pytest.mark.usefixtures("impatient")
def test_with_beams_too(helpers: Threads) -> None:
    scan = scan_of(seen(ON_A_GRID, AT, noise=0.02, clutter=4, radius=9.0)[0], beams=beams_of(INDEX, AT))
    deadline = Deadline()
    deadline.helpers = helpers
    alone, helped = (associate(INDEX, scan, None, AssociationOptions(), one) for one in (Deadline(), deadline))
    assert alone.search == helped.search
    assert (alone.pose, alone.probability) == (helped.pose, helped.probability)
    assert helpers.helped > 4


@pytest.mark.usefixtures("impatient")
def test_a_deadline_ends_helpers_too(helpers: Threads) -> None:
    deadline = Deadline(time.monotonic() - 1.0)
    deadline.helpers = helpers
    assert not associate(INDEX, SCANS[1], None, AssociationOptions(exhaustive=True), deadline).search.complete
    helpers.close()


@pytest.mark.parametrize("helpers", [Fail], indirect=True)
@pytest.mark.usefixtures("impatient")
def test_a_helper_that_fails_fails_the_search(helpers: Threads) -> None:
    deadline = Deadline()
    deadline.helpers = helpers
    with pytest.raises(MemoryError):
        answer(0, 1, deadline)
